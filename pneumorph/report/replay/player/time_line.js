// The charts under the picture: pressures of one robot and what all achieve, over time. Drag to seek.
var pneumorphTimeLine = globalThis.pneumorphTimeLine || (() => {
  const LEFT = 52, RIGHT = 12, TOP = 14, GAP = 18, BOTTOM = 22;

  class TimeLine {
    constructor(canvas, cursor, motions, seek) {
      Object.assign(this, { canvas, cursor, motions, selected: 0 });
      const drag = (event) => {
        const box = canvas.getBoundingClientRect();
        seek(this.timeAt(event.clientX - box.left));
      };
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        drag(event);
      });
      canvas.addEventListener("pointermove", (event) => {
        if (event.buttons & 1) drag(event);
      });
    }

    get duration() { return Math.max(...this.motions.map((m) => m.duration), 1e-6); }

    timeAt(x) {
      const share = (x - LEFT) / (this.width - LEFT - RIGHT);
      return Math.min(Math.max(share, 0), 1) * this.duration;
    }

    xAt(time) { return LEFT + time / this.duration * (this.width - LEFT - RIGHT); }

    resize(width, height) {
      this.ratio = Math.min(window.devicePixelRatio || 1, 2);
      [this.width, this.height] = [width, height];
      this.canvas.width = Math.round(width * this.ratio);
      this.canvas.height = Math.round(height * this.ratio);
      this.redraw();
    }

    // Draw the curves; the line at the time now is an element over them, moved by `show`.
    redraw() {
      if (!this.width) return;
      const pen = this.canvas.getContext("2d");
      pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      pen.clearRect(0, 0, this.width, this.height);
      pen.font = "11px system-ui, sans-serif";
      const room = this.height - TOP - GAP - BOTTOM, split = TOP + Math.round(room * 0.55);
      this.pressures(pen, TOP, split);
      this.ways(pen, split + GAP, this.height - BOTTOM);
      pen.fillStyle = "#5d666e";
      pen.textAlign = "center";
      for (const time of ticks(0, this.duration, 10)) {
        pen.fillText(`${time}`, this.xAt(time), this.height - 8);
      }
      pen.textAlign = "right";
      pen.fillText("s", LEFT - 8, this.height - 8);
    }

    pressures(pen, top, bottom) {
      const motion = this.motions[this.selected], { commanded, regulated } = motion.parts;
      let most = 1;
      for (const frame of [...commanded, ...regulated]) most = Math.max(most, ...frame);
      const y = this.axis(pen, top, bottom, 0, most, "pressure (kPa)");
      const used = motion.robot.regulators?.flat(); // a measured robot does not tell
      for (let r = 0; r < motion.robot.regulator_count; r++) {
        if (used && !used.includes(r + 1)) continue;
        const colours = pneumorphColours.regulators;
        pen.strokeStyle = colours[r % colours.length];
        this.curve(pen, motion.time, (i) => y(regulated[i][r]), 1.8, []);
        this.curve(pen, motion.time, (i) => y(commanded[i][r]), 0.8, [3, 3], true);
      }
    }

    // What of their goal robots achieve; where they have several, how far forward all go.
    get way() {
      const { label, symbol } = this.motions[0].goal;
      const one = this.motions.every((motion) => motion.goal.label === label);
      return one ? { name: `${label} (${symbol.trim()})`, of: (motion, i) => motion.achieved(i) }
        : { name: "forward distance (cm)", of: (motion, i) => motion.distance(i) };
    }

    ways(pen, top, bottom) {
      const way = this.way;
      let low = 0, high = 1;
      for (const motion of this.motions) {
        if (motion.sound) motion.time.forEach((_, i) => {
          const d = way.of(motion, i);
          low = Math.min(low, d);
          high = Math.max(high, d);
        });
      }
      const y = this.axis(pen, top, bottom, low, high, way.name);
      this.motions.forEach((motion, index) => {
        if (!motion.sound) return;
        pen.strokeStyle = pneumorphStage.pathColour(index, this.motions.length);
        this.curve(pen, motion.time, (i) => y(way.of(motion, i)), 1.8, []);
      });
    }

    axis(pen, top, bottom, low, high, name) {
      const y = (value) => bottom - (value - low) / (high - low) * (bottom - top);
      pen.fillStyle = "#5d666e";
      pen.strokeStyle = "#e7e9eb";
      pen.lineWidth = 1;
      pen.setLineDash([]);
      pen.textAlign = "right";
      for (const value of ticks(low, high, 3)) {
        pen.beginPath();
        pen.moveTo(LEFT, y(value));
        pen.lineTo(this.width - RIGHT, y(value));
        pen.stroke();
        pen.fillText(`${value}`, LEFT - 8, y(value) + 4);
      }
      pen.textAlign = "left";
      pen.fillText(name, LEFT, top - 4);
      return y;
    }

    curve(pen, time, yOf, width, dash, steps = false) {
      pen.lineWidth = width;
      pen.setLineDash(dash);
      pen.beginPath();
      for (let i = 0; i < time.length; i++) {
        // A frame's command is the one that led to it.
        if (steps && i > 0) pen.lineTo(this.xAt(time[i - 1]), yOf(i));
        pen.lineTo(this.xAt(time[i]), yOf(i));
      }
      pen.stroke();
    }

    show(time) {
      if (this.width) this.cursor.style.transform = `translateX(${this.xAt(time)}px)`;
    }
  }

  // Round values between two limits, about so many.
  function ticks(low, high, count) {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((s) => s * power).find((s) => s >= raw);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), found = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high * (1 + 1e-9); i++) {
      found.push(Number((i * step).toFixed(digits)));
    }
    return found;
  }

  return { TimeLine };
})();
