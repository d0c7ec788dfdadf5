// pneumorphReplay.mount(element, data, options) puts a player into an element and returns it.
//   data             what replay_data (Python) returned
//   options.robots   numbers of the robots of data to show; all of them by default
//   options.live     frames are still to come, through append(frame), until finish()
//   options.speed    seconds of the robot's time in one second
//   options.told     what is said once of all robots
// pneumorphReplay.players lists the players of a page. A player has
//   time, duration [s]; robots: label, kind, frames, legs, nodes, frameTimes of each
//   seek(time), play(), pause(), step(frames), setSpeed(x), select(robot)
//   setCamera("orbit" | "follow" | "top" | "side"), setColour("regulator" | "pressure")
//   nodePositions(robot): world positions of the skin's nodes as shown [mm], Float32Array,
//     leg after leg, each (node, 3) in the order of numpy.unique of its skin, without the lane
//   contactPoints(robot): those of them that touch the floor; trackedPoint(robot) [mm];
//   pressures(robot) [kPa]; distance(robot) [cm]
//   frameRate(seconds): a promise of the pictures drawn in a second while playing
//   append(frame), finish(), dispose()
var pneumorphReplay = globalThis.pneumorphReplay || (() => {
  const players = [];
  const CONTROLS = `
    <div class="pr-view"><canvas></canvas><div class="pr-labels"></div>
      <div class="pr-clock" aria-live="off"></div><div class="pr-legend"></div></div>
    <div class="pr-bar">
      <button data-do="back" title="One frame back" aria-label="One frame back">◂</button>
      <button data-do="play" title="Play or pause (space)" aria-label="Play">▶</button>
      <button data-do="forward" title="One frame forward" aria-label="One frame forward">▸</button>
      <label>speed <select data-set="speed"><option>0.1</option><option>0.25</option>
        <option>0.5</option><option selected>1</option><option>2</option><option>4</option>
        <option>8</option></select></label>
      <label>camera <select data-set="camera"><option>orbit</option><option>follow</option>
        <option>top</option><option>side</option></select></label>
      <label>colour <select data-set="colour"><option>regulator</option><option>pressure</option>
        </select></label>
      <label data-many>pressures of <select data-set="robot"></select></label>
      <label><input type="checkbox" data-set="paths" checked> path</label>
      <label><input type="checkbox" data-set="contacts" checked> contact</label>
    </div>
    <input class="pr-slider" type="range" min="0" max="1" step="any" value="0" aria-label="Time">
    <div class="pr-time"><canvas class="pr-chart"></canvas><div class="pr-cursor"></div></div>`;

  class Player {
    constructor(element, data, options = {}) {
      if (data.format !== "pneumorph replay" || data.version !== 2) {
        throw new Error(`not replay data of version 2: ${data.format} ${data.version}`);
      }
      this.element = element;
      this.live = Boolean(options.live);
      this.fullPressure = data.full_kPa || 90; // of all frames, also those that were left out
      this.told = options.told ? ` · ${options.told}` : "";
      this.time = 0;
      this.playing = this.live;
      this.selected = 0;
      this.drawn = 0;
      const shown = options.robots ? options.robots.map((i) => data.robots[i]) : data.robots;
      this.motions = shown.map((robot) => new pneumorphMotion.Motion(robot, data.bases));
      element.classList.add("pneumorph-replay");
      element.innerHTML = CONTROLS;
      this.find = (selector) => element.querySelector(selector);
      this.chart = new pneumorphTimeLine.TimeLine(
        this.find(".pr-chart"), this.find(".pr-cursor"), this.motions, (time) => this.seek(time));
      this.openStage();
      this.listen();
      this.setSpeed(options.speed || 1);
      this.size = new ResizeObserver(() => this.resize());
      this.size.observe(element);
      this.resize();
      this.show();
      this.loop = this.loop.bind(this);
      this.request = requestAnimationFrame(this.loop);
    }

    openStage() {
      for (const motion of this.motions) this.riseTo(motion.parts.regulated);
      try {
        this.stage = new pneumorphStage.Stage(
          this.find("canvas"), this.find(".pr-labels"), this.motions, this.fullPressure);
      } catch (error) {
        // The charts and positions work without it.
        this.stage = null;
        this.find(".pr-labels").textContent = `This browser shows no 3D (WebGL 2): ${error.message}`;
      }
      this.legend();
    }

    listen() {
      const actions = { back: () => this.step(-1), forward: () => this.step(1),
        play: () => (this.playing ? this.pause() : this.play()) };
      for (const button of this.element.querySelectorAll("[data-do]")) {
        button.addEventListener("click", actions[button.dataset.do]);
      }
      const settings = {
        speed: (e) => this.setSpeed(Number(e.value)), camera: (e) => this.setCamera(e.value),
        colour: (e) => this.setColour(e.value), robot: (e) => this.select(Number(e.value)),
        paths: (e) => this.toggle("showPaths", e.checked),
        contacts: (e) => this.toggle("showContacts", e.checked),
      };
      for (const input of this.element.querySelectorAll("[data-set]")) {
        input.addEventListener("change", () => settings[input.dataset.set](input));
      }
      this.motions.forEach((motion, i) => {
        const option = new Option(motion.robot.label.split("\n")[0], i);
        this.find('[data-set="robot"]').append(option);
      });
      this.find("[data-many]").hidden = this.motions.length < 2;
      this.find(".pr-slider").addEventListener("input", (event) =>
        this.seek(Number(event.target.value) * this.duration));
      this.element.addEventListener("keydown", (event) => {
        const keys = { " ": actions.play, ArrowLeft: actions.back, ArrowRight: actions.forward };
        if (!(event.key in keys) || ["SELECT", "BUTTON"].includes(event.target.tagName)) return;
        event.preventDefault();
        keys[event.key]();
      });
      this.element.tabIndex = 0;
    }

    resize() {
      const view = this.find(".pr-view"), chart = this.find(".pr-chart");
      if (!view.clientWidth || !view.clientHeight) return;
      if (this.stage) this.stage.resize(view.clientWidth, view.clientHeight);
      this.chart.resize(chart.clientWidth, chart.clientHeight);
      this.chart.show(this.time);
    }

    get duration() { return Math.max(...this.motions.map((m) => m.duration)); }

    get robots() {
      return this.motions.map((m) => ({ label: m.robot.label, kind: m.robot.kind,
        frames: m.time.length, legs: m.legs.length, nodes: m.legs.map((leg) => leg.basis.nodeCount),
        frameTimes: Array.from(m.time) }));
    }

    seek(time) {
      this.time = Math.min(Math.max(time, 0), this.duration);
      this.show();
    }

    play() {
      if (!this.live && this.time >= this.duration) this.time = 0;
      this.playing = true;
      this.marks();
    }

    pause() {
      this.playing = false;
      this.marks();
    }

    step(count) {
      this.pause();
      const motion = this.motions[this.selected], frame = motion.frameAt(this.time);
      const between = count < 0 && this.time > motion.time[frame] + 1e-6 ? 1 : 0;
      const wanted = Math.min(Math.max(frame + count + between, 0), motion.time.length - 1);
      this.seek(motion.time[wanted]);
    }

    setSpeed(value) { this.speed = value; this.find('[data-set="speed"]').value = `${value}`; }

    setCamera(name) {
      if (this.stage) this.stage.view(name);
      this.find('[data-set="camera"]').value = name;
    }

    setColour(name) {
      if (this.stage) this.stage.colourBy = name;
      this.find('[data-set="colour"]').value = name;
      this.legend();
      this.show();
    }

    select(robot) {
      this.selected = this.chart.selected = robot;
      if (this.stage) this.stage.selected = robot;
      this.find('[data-set="robot"]').value = `${robot}`;
      this.chart.redraw();
      this.show();
    }

    toggle(name, value) {
      if (this.stage) this.stage[name] = value;
      this.show();
    }

    nodePositions(robot = 0) { return this.motions[robot].positions; }
    trackedPoint(robot = 0) { return Array.from(this.motions[robot].tracked); }
    pressures(robot = 0) { return Array.from(this.motions[robot].regulated); }
    distance(robot = 0) { return this.motions[robot].distance(); }

    contactPoints(robot = 0) {
      const into = new Float32Array(this.motions[robot].positions.length);
      return into.slice(0, 3 * this.motions[robot].contacts(into));
    }

    frameRate(seconds) {
      const before = this.drawn, start = performance.now();
      this.play();
      return new Promise((resolve) => setTimeout(
        () => resolve((this.drawn - before) / (performance.now() - start) * 1000), seconds * 1000));
    }

    // Have the full colour at the highest of these pressures, where that is more than it was.
    riseTo(regulated) {
      let full = this.fullPressure;
      for (const frame of regulated) full = Math.max(full, ...frame);
      if (full === this.fullPressure) return;
      this.fullPressure = full;
      if (!this.stage) return; // it is told when it is made
      this.stage.fullPressure = full;
      this.legend();
    }

    // A frame of a live robot.
    append(frame) {
      const motion = this.motions[frame.robot];
      motion.append(frame);
      this.riseTo(motion.parts.regulated.slice(-1));
      this.stale = true; // many may come at once; the next picture shows them
    }

    finish() { this.live = false; this.marks(); }

    loop(now) {
      this.request = requestAnimationFrame(this.loop);
      // A page that was hidden does not jump ahead.
      const passed = Math.min((now - (this.before ?? now)) / 1000, 0.2);
      if (this.playing && this.stage) this.stage.keepUp(passed);
      this.before = now;
      if (this.stale) {
        this.stale = false;
        this.chart.redraw();
        this.show();
      }
      if (this.playing && this.time < this.duration) {
        this.time = Math.min(this.time + passed * this.speed, this.duration);
        // Words that change in every picture cannot be read, and cost as much as the picture.
        const words = now - (this.wordsAt ?? 0) > 100 || this.time >= this.duration;
        if (words) this.wordsAt = now;
        this.show(words);
      } else if (this.playing && !this.live) {
        this.pause();
      }
      if (this.stage && this.stage.dirty && this.stage.width) {
        this.stage.render();
        this.drawn++;
      }
    }

    show(words = true) {
      for (const motion of this.motions) motion.show(this.time);
      if (this.stage) this.stage.update();
      this.chart.show(this.time);
      if (words) this.marks();
    }

    marks() {
      const write = (element, text) => {
        if (element.textContent !== text) element.textContent = text;
      };
      write(this.find(".pr-clock"), `${this.time.toFixed(2)} s${this.live ? "  live" : ""}`);
      const button = this.find('[data-do="play"]');
      write(button, this.playing ? "❚❚" : "▶");
      button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
      const slider = this.find(".pr-slider");
      slider.value = this.duration > 0 ? this.time / this.duration : 0;
      slider.setAttribute("aria-valuetext", `${this.time.toFixed(2)} seconds`);
      if (this.stage) {
        this.stage.actors.forEach((actor, i) => {
          const { goal, robot } = actor.motion, unit = 10 ** goal.digits;
          const achieved = Math.round(unit * actor.motion.achieved()) / unit + 0; // no minus zero
          const over = !this.live && this.time > actor.motion.duration + 0.02;
          const ended = over ? `, ended at ${Number(actor.motion.duration.toPrecision(3))} s` : "";
          const far = `${achieved.toFixed(goal.digits)}${goal.symbol}${ended}`;
          write(actor.label, `${robot.label}\n${actor.motion.sound ? far : robot.status}`);
        });
      }
    }

    legend() {
      const legend = this.find(".pr-legend");
      if (this.stage && this.stage.colourBy === "pressure") {
        const colours = pneumorphStage.PRESSURE.join(", ");
        legend.innerHTML = `<i style="background: linear-gradient(90deg, ${colours})"></i>` +
          `0 to ${Math.round(this.fullPressure)} kPa`;
      } else {
        const most = Math.max(...this.motions.map((m) => Math.max(0, ...(m.robot.regulators || []).flat())));
        legend.innerHTML = pneumorphColours.regulators.slice(0, most).map((colour, i) =>
          `<b style="background: ${colour}"></b>regulator ${i + 1}`).join(" ");
      }
      legend.insertAdjacentText("beforeend", ` · lines 5 cm apart${this.slopeWords()}${this.told}`);
    }

    // How floors that are not level are sloped.
    slopeWords() {
      const slopes = this.motions.filter((m) => m.simulated).map((m) => m.robot.floor_slope_deg || 0);
      const least = Math.min(...slopes), most = Math.max(...slopes);
      if (!(Math.max(-least, most) >= 0.05)) return "";
      const signed = (slope) => `${slope < 0 ? "" : "+"}${slope.toFixed(1)}`;
      if (most - least >= 0.05) {
        return ` · floors of ${signed(least)} to ${signed(most)} degrees forward`;
      }
      const rising = most > 0 ? "rising" : "falling";
      return ` · floor ${rising} forward by ${Number(Math.abs(most).toPrecision(3))} degrees`;
    }

    dispose() {
      cancelAnimationFrame(this.request);
      this.size.disconnect();
      if (this.stage) this.stage.dispose();
      players.splice(players.indexOf(this), 1);
      this.element.replaceChildren();
    }
  }

  // Paper shows no WebGL: leave a picture in its place.
  window.addEventListener("beforeprint", () => {
    for (const player of players) {
      if (!player.stage || !player.stage.width) continue;
      player.stage.render();
      const picture = new Image();
      picture.src = player.find("canvas").toDataURL();
      picture.className = "pr-printed";
      player.find(".pr-view").append(picture);
    }
  });
  window.addEventListener("afterprint", () => {
    for (const picture of document.querySelectorAll(".pr-printed")) picture.remove();
  });

  return {
    players,
    mount(element, data, options) {
      const player = new Player(element, data, options);
      players.push(player);
      return player;
    },
  };
})();
window.pneumorphReplay = pneumorphReplay;
