// The explorer over explorerData. What is shown is kept in the address after #, so that a view can
// be linked to. For tests and consoles, pneumorphExplorer has
//   names(): designs shown, in order; select(name): show one; selected(): its name
//   set(filters): {q, legs: [..], regulators: [..], symmetric, with, sort}
const pneumorphExplorer = (() => {
  const data = explorerData;
  const ROW = 32;
  const NONE = "-";
  // Of each location null, or the number of its kind of module, its regulators and its text:
  // 1, b2, 2+3.
  function entries(name) {
    return name.split(".").map((entry) => {
      if (entry === "0") return null;
      const kind = /^[a-z]/.test(entry) ? entry.charCodeAt(0) - 97 : 0;
      const regulators = entry.replace(/^[a-z]/, "").split("+").map(Number);
      return { kind, regulators, text: entry };
    });
  }
  const designs = data.designs.map((name, index) => {
    const legs = entries(name), mounted = legs.filter((leg) => leg);
    const used = new Set(mounted.flatMap((leg) => leg.regulators));
    return {
      index, entries: legs, name, legs: mounted.length,
      regulators: used.size, symmetric: data.symmetric[index] === "1",
      score: data.scores[index],
      probability: data.probability ? data.probability[index] : null,
      pair: data.pairs[index] || null, robots: data.robots[index] || [],
    };
  });
  const places = new Map(designs.map((design) => [design.name, design]));
  const COLUMNS = [
    ["", null], ["design", "name"], ["legs", "legs", "value"], ["regulators", "regulators", "value"],
    [data.score_name, "score", "value"], ["probability", "probability", "value"], ["", "pair"],
  ];
  const find = (selector) => document.querySelector(selector);
  const form = find(".filters"), list = find(".list"), details = find(".details");
  const rows = new Map();  // what is drawn, by its place in the list
  let shown = designs, chosen = null, sort = "-score", player = null;

  // The same robot with its regulators numbered in order of first appearance.
  function canonical(name) {
    const number = new Map();
    return name.replace(/\d+/g, (regulator) => {
      if (regulator === "0") return "0";
      if (!number.has(regulator)) number.set(regulator, number.size + 1);
      return number.get(regulator);
    });
  }

  // A design whose legs are moved: of a move that mirrors, cavities change order as well.
  function moved(name, [to, reflected]) {
    const image = [];
    name.split(".").forEach((entry, location) => {
      const [, kind, regulators] = entry.match(/^([a-z]?)(.*)$/);
      image[to[location]] = kind + (reflected ? regulators.split("+").reverse().join("+") : regulators);
    });
    return data.canonical ? canonical(image.join(".")) : image.join(".");
  }

  // All designs that count as one with a design, itself first.
  const counted = (name) => data.moves.map((move) => moved(name, move));

  // A whole name is looked up whatever its regulators are called and whichever of the designs that count
  // as one it is; a part is looked for as written.
  function searched(text) {
    const wanted = text.trim();
    const parts = wanted.split(".");
    const whole = parts.length === data.locations && parts.every((part) => /^[a-z]?\d+(\+\d+)*$/.test(part));
    if (!whole) return (design) => design.name.includes(wanted);
    const names = new Set(counted(wanted));
    return (design) => names.has(design.name);
  }

  function filters() {
    const picked = (name) => [...form.querySelectorAll(`[name=${name}] input:checked`)]
      .map((box) => Number(box.value));
    return {
      q: form.elements.q.value, legs: picked("legs"), regulators: picked("regulators"),
      symmetric: form.elements.symmetric.value, with: form.elements.with.value, sort,
    };
  }

  function apply() {
    const { q, legs, regulators, symmetric, with: having } = filters();
    const matches = searched(q);
    shown = designs.filter((design) => matches(design)
      && (!legs.length || legs.includes(design.legs))
      && (!regulators.length || regulators.includes(design.regulators))
      && (!symmetric || design.symmetric === (symmetric === "yes"))
      && (having !== "score" || design.score !== null)
      && (having !== "replay" || design.robots.length));
    const falling = sort.startsWith("-"), key = falling ? sort.slice(1) : sort;
    const value = (design) => key === "pair" ? (design.pair ? -Number(design.pair[0].slice(1)) : null)
      : design[key];
    shown.sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === null || y === null) return (x === null) - (y === null) || a.index - b.index;
      const order = typeof x === "string" ? (x < y ? -1 : x > y ? 1 : 0) : x - y;
      return (falling ? -order : order) || a.index - b.index;
    });
    form.querySelector(".count").textContent = `${shown.length} of ${designs.length} designs`;
    find(".spacer").style.height = `${shown.length * ROW}px`;
    list.scrollTop = 0;
    drawHead();
    drawRows();
    remember();
  }

  // The design from above, forward to the right: as plan_view.py draws it.
  function planView(entries, numbered) {
    const half = data.plan.half_width;
    // x and y of the page: forward to the right, left upwards.
    const points = (outline) => outline.map(([x, y]) => `${x},${-y}`).join(" ");
    const legs = entries.map((entry, location) => {
      if (!entry) return "";
      const { outline, bands } = data.plan.legs[location][entry.kind];
      const [x, y] = [0, 1].map((axis) => {
        const values = outline.map((corner) => corner[axis]);
        return (Math.min(...values) + Math.max(...values)) / 2;
      });
      const parts = entry.regulators.length === bands.length ? bands : [outline];
      const box = parts.map((band, i) =>
        `<polygon points="${points(band)}" fill="${data.colours[entry.regulators[i]]}"/>`).join("");
      if (!numbered) return box;
      const { text } = entry, size = 22 * Math.min(1, 1.9 / text.length);
      return `${box}<text x="${x}" y="${-y + 0.36 * size}" fill="#fff" font-size="${size}"`
        + ` text-anchor="middle">${text}</text>`;
    });
    const { payload } = data.plan;
    const carried = payload ? `<polyline points="${points(payload.line)}" stroke="${data.ink}"`
      + ` stroke-width="3"/><polygon class="payload" points="${points(payload.ball)}"`
      + ` fill="${data.ink}" stroke="#fff" stroke-width="3" paint-order="stroke"/>` : "";
    return `<svg viewBox="${-half} ${-half} ${2 * half} ${2 * half}" role="img" aria-label="plan view">`
      + legs.join("") + `<polygon points="${points(data.plan.hub)}" fill="${data.colours[0]}"/>`
      + `<path d="M-30 0H30M16 -10L30 0L16 10" fill="none" stroke="${data.ink}" stroke-width="4"/>${carried}</svg>`;
  }

  const fixed = (value, digits) => value === null ? NONE : value.toFixed(digits);
  const chance = (value) => value === null ? NONE
    : value === 0 ? "0" : value >= 1e-4 ? value.toFixed(4) : value.toExponential(1);

  function drawHead() {
    const head = find(".head");
    head.replaceChildren(...COLUMNS.map(([title, key, kind]) => {
      const cell = document.createElement("span");
      if (kind) cell.className = kind;
      if (key && title) {
        const button = document.createElement("button");
        const mark = sort === key ? " ▲" : sort === `-${key}` ? " ▼" : "";
        button.textContent = title + mark;
        button.addEventListener("click", () => {
          sort = sort === `-${key}` ? key : sort === key ? `-${key}` : key === "name" ? key : `-${key}`;
          apply();
        });
        cell.append(button);
      }
      return cell;
    }));
  }

  // Rows that stay in sight stay as they are: one that is replaced between the press of a button and its
  // release, because the list scrolls to it, would lose the click.
  function drawRows() {
    const first = Math.max(0, Math.floor(list.scrollTop / ROW) - 4);
    const last = Math.min(shown.length, first + Math.ceil(list.clientHeight / ROW) + 8);
    for (const [place, { design, row }] of rows) {
      if (place >= first && place < last && design === shown[place]) continue;
      row.remove();
      rows.delete(place);
    }
    let next = null;
    for (let place = last - 1; place >= first; place -= 1) {
      const design = shown[place];
      if (!rows.has(place)) {
        const row = drawnRow(design, place);
        list.insertBefore(row, next);
        rows.set(place, { design, row });
      }
      next = rows.get(place).row;
      next.setAttribute("aria-selected", String(design === chosen));
    }
  }

  function drawnRow(design, place) {
    const row = document.createElement("div");
    row.className = "row";
    row.setAttribute("role", "option");
    row.style.transform = `translateY(${place * ROW}px)`;
    const tag = [design.pair ? design.pair[0] : "", design.robots.length ? "▶" : ""].join(" ");
    row.innerHTML = `${planView(design.entries, false)}<span>${design.name}</span>`
      + `<span class="value">${design.legs}</span><span class="value">${design.regulators}</span>`
      + `<span class="value">${fixed(design.score, 2)}</span>`
      + `<span class="value">${chance(design.probability)}</span><span class="value">${tag}</span>`;
    row.addEventListener("click", () => choose(design));
    return row;
  }

  function mirrorImage({ name }) {
    const image = moved(name, data.mirror);
    if (image === name) return "itself";
    return counted(name).includes(image) ? `${image}, which counts as one with it` : image;
  }

  function facts(design) {
    const lines = [
      ["legs", design.legs], ["regulators", design.regulators],
      ...(data.mirror ? [["mirror image", mirrorImage(design)]] : []),
      ["score", design.score === null ? "none" : `${design.score.toFixed(2)}${data.unit}`],
    ];
    if (design.probability !== null) lines.push(["probability", chance(design.probability)]);
    if (design.pair) {
      const far = design.pair[1] === null ? "failed" : `${design.pair[1].toFixed(2)}${data.unit}`;
      const mean = data.of_pairs && design.pair[1] !== null ? `, ${data.of_pairs}` : "";
      lines.push(["best pair", `${design.pair[0]}, ${far}${mean}`]);
    }
    return lines.map(([name, value]) => `<dt>${name}</dt><dd>${value}</dd>`).join("");
  }

  function choose(design) {
    chosen = design;
    if (player) player.dispose();
    player = null;
    details.innerHTML = `<h2>${design.name}</h2>${planView(design.entries, true)}`
      + `<dl>${facts(design)}</dl><div class="more"></div>`;
    const more = details.querySelector(".more");
    if (design.robots.length) {
      const stage = document.createElement("div");
      more.append(stage);
      player = pneumorphReplay.mount(stage, data.replay, { robots: design.robots });
    } else {
      more.innerHTML = "<p class='empty'>No trajectory of this design is at hand. This walks it:</p><pre></pre>";
      more.querySelector("pre").textContent = data.command.replaceAll("DESIGN", design.name);
    }
    drawRows();
    remember();
  }

  function remember() {
    const state = filters(), kept = new URLSearchParams();
    for (const [name, value] of Object.entries(state)) {
      if (value.length && !(name === "sort" && value === "-score")) kept.set(name, String(value));
    }
    if (chosen) kept.set("design", chosen.name);
    history.replaceState(null, "", `#${kept}`);
  }

  function set(wanted) {
    form.elements.q.value = wanted.q || "";
    for (const name of ["legs", "regulators"]) {
      const values = (wanted[name] || []).map(Number);
      form.querySelectorAll(`[name=${name}] input`).forEach((box) => {
        box.checked = values.includes(Number(box.value));
      });
    }
    form.elements.symmetric.value = wanted.symmetric || "";
    form.elements.with.value = wanted.with || "";
    sort = wanted.sort || "-score";
    apply();
  }

  function recall() {
    const kept = new URLSearchParams(location.hash.slice(1));
    const many = (name) => (kept.get(name) || "").split(",").filter(Boolean);
    const name = kept.get("design");
    set({ q: kept.get("q"), legs: many("legs"), regulators: many("regulators"),
      symmetric: kept.get("symmetric"), with: kept.get("with"), sort: kept.get("sort") });
    const design = places.get(name) || shown[0];
    if (design) choose(design);
  }

  form.elements.symmetric.closest("label").hidden = !data.mirror;
  for (const [name, values] of [["legs", designs.map((each) => each.legs)],
    ["regulators", designs.map((each) => each.regulators)]]) {
    const boxes = [...new Set(values)].sort((a, b) => a - b).map((value) =>
      `<label><input type="checkbox" value="${value}"> ${value}</label>`);
    form.elements[name].insertAdjacentHTML("beforeend", boxes.join(""));
  }
  form.addEventListener("input", apply);
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", (event) => { event.preventDefault(); set({}); });
  list.addEventListener("scroll", drawRows);
  list.addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 12, PageUp: -12 }[event.key];
    if (!step || !shown.length) return;
    event.preventDefault();
    const place = Math.min(shown.length - 1, Math.max(0, shown.indexOf(chosen) + step));
    choose(shown[place]);
    if (place * ROW < list.scrollTop) list.scrollTop = place * ROW;
    if ((place + 1) * ROW > list.scrollTop + list.clientHeight) {
      list.scrollTop = (place + 1) * ROW - list.clientHeight;
    }
  });
  new ResizeObserver(drawRows).observe(list);
  recall();
  return {
    names: () => shown.map((design) => design.name),
    selected: () => chosen && chosen.name,
    select: (name) => choose(places.get(name)),
    player: () => player,
    set,
  };
})();
