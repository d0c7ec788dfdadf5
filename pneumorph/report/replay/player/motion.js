// What robots do: arrays decoded from base64, and positions at any time.
// Between recorded frames everything moves linearly; at a frame it is what was recorded.
"use strict";
const pneumorphMotion = (() => {
  const TOUCHING_MM = 0.2;

  function decoded(text, kind) {
    return new kind(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  }

  // Views of an array, one for each frame.
  function rows(text, width) {
    const all = decoded(text, Float32Array);
    const count = width > 0 ? all.length / width : 0;
    return Array.from({ length: count }, (_, i) => all.subarray(i * width, (i + 1) * width));
  }

  // Modes that legs of one mesh share, decoded once for all players of a page.
  const decodedBases = new WeakMap();
  function basisOf(basis) {
    if (!decodedBases.has(basis)) {
      decodedBases.set(basis, {
        nodeCount: basis.node_count,
        modeCount: basis.mode_count,
        triangles: decoded(basis.triangles, Uint32Array),
        mean: basis.mean_mm ? decoded(basis.mean_mm, Float32Array) : null,
        modes: basis.modes ? decoded(basis.modes, Float32Array) : null,
      });
    }
    return decodedBases.get(basis);
  }

  class Motion {
    constructor(robot, bases) {
      this.robot = robot;
      this.simulated = robot.kind === "simulated";
      this.basis = this.simulated ? basisOf(bases[robot.basis]) : null;
      this.legCount = this.simulated ? robot.turns_rad.length : 0;
      this.time = [];
      this.parts = { hub: [], tracked: [], commanded: [], regulated: [], coefficients: [], raw: [] };
      const size = this.legCount * (this.basis ? this.basis.nodeCount : 0) * 3;
      // World positions of the skin's nodes as shown, (leg, node, 3) [mm], without the lane.
      this.positions = new Float32Array(size);
      this.hub = new Float64Array(7);
      this.tracked = new Float64Array(3);
      this.commanded = new Float64Array(robot.regulator_count);
      this.regulated = new Float64Array(robot.regulator_count);
      if (this.basis) this._shape = new Float64Array(this.basis.nodeCount * 3);
      if (robot.frames > 0) this.append(robot);
    }

    // Add frames; a live page gets them one by one, with positions instead of coefficients.
    append(more) {
      const add = (to, text, width) => { if (text) to.push(...rows(text, width)); };
      this.time.push(...decoded(more.time_s, Float32Array));
      add(this.parts.hub, more.hub, 7);
      add(this.parts.tracked, more.tracked_mm, 3);
      add(this.parts.commanded, more.commanded_kPa, this.robot.regulator_count);
      add(this.parts.regulated, more.regulated_kPa, this.robot.regulator_count);
      if (this.basis) {
        add(this.parts.coefficients, more.coefficients_mm, this.legCount * this.basis.modeCount);
        add(this.parts.raw, more.positions_mm, this.positions.length);
      }
    }

    get duration() { return this.time.length ? this.time[this.time.length - 1] : 0; }

    // Last frame at or before a time.
    frameAt(time) {
      let low = 0, high = this.time.length - 1;
      while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (this.time[middle] <= time + 1e-6) low = middle; else high = middle - 1;
      }
      return low;
    }

    // Move to a time: fills positions, hub, tracked, commanded and regulated.
    show(time) {
      if (!this.time.length) return;
      const frame = this.frameAt(time), next = Math.min(frame + 1, this.time.length - 1);
      const span = this.time[next] - this.time[frame];
      const late = time - this.time[frame];
      const share = span > 0 && late > 1e-6 ? Math.min(late / span, 1) : 0;
      const blend = (to, from) => {
        const a = from[frame], b = from[next];
        for (let i = 0; i < to.length; i++) to[i] = a[i] + share * (b[i] - a[i]);
      };
      this.frame = frame;
      blend(this.tracked, this.parts.tracked);
      blend(this.regulated, this.parts.regulated);
      // A command holds until the frame it led to.
      this.commanded.set(this.parts.commanded[share > 0 ? next : frame]);
      if (!this.simulated) return;
      this._showHub(frame, next, share);
      if (this.parts.raw.length) blend(this.positions, this.parts.raw);
      else this._showLegs(frame, next, share);
    }

    _showHub(frame, next, share) {
      const a = this.parts.hub[frame], b = this.parts.hub[next];
      let dot = 0;
      for (let i = 3; i < 7; i++) dot += a[i] * b[i];
      const sign = dot < 0 ? -1 : 1; // q and -q are one rotation
      let square = 0;
      for (let i = 0; i < 7; i++) {
        this.hub[i] = a[i] + share * ((i < 3 ? 1 : sign) * b[i] - a[i]);
        if (i >= 3) square += this.hub[i] ** 2;
      }
      for (let i = 3; i < 7; i++) this.hub[i] /= Math.sqrt(square);
    }

    // x = position + R_hub R_turn (mean + sum of coefficient times mode)
    _showLegs(frame, next, share) {
      const { nodeCount, modeCount, mean, modes } = this.basis;
      const a = this.parts.coefficients[frame], b = this.parts.coefficients[next];
      const shape = this._shape, width = nodeCount * 3;
      const hub = rotationOf(this.hub);
      for (let leg = 0; leg < this.legCount; leg++) {
        shape.set(mean);
        for (let m = 0; m < modeCount; m++) {
          const place = leg * modeCount + m, c = a[place] + share * (b[place] - a[place]);
          const start = m * width;
          for (let i = 0; i < width; i++) shape[i] += c * modes[start + i];
        }
        const cos = Math.cos(this.robot.turns_rad[leg]), sin = Math.sin(this.robot.turns_rad[leg]);
        const r = [0, 3, 6].flatMap((i) => [
          hub[i] * cos + hub[i + 1] * sin, hub[i + 1] * cos - hub[i] * sin, hub[i + 2]]);
        const base = leg * width;
        for (let i = 0; i < width; i += 3) {
          const x = shape[i], y = shape[i + 1], z = shape[i + 2];
          this.positions[base + i] = this.hub[0] + r[0] * x + r[1] * y + r[2] * z;
          this.positions[base + i + 1] = this.hub[1] + r[3] * x + r[4] * y + r[5] * z;
          this.positions[base + i + 2] = this.hub[2] + r[6] * x + r[7] * y + r[8] * z;
        }
      }
    }

    // Whether it came to the end of its walk: one that diverged has travelled no distance.
    get sound() { return (this.robot.status || "completed") === "completed"; }

    // Forward travel of the tracked point since the first frame [cm], now or in a frame.
    distance(frame) {
      if (!this.time.length) return 0;
      const now = frame === undefined ? this.tracked[0] : this.parts.tracked[frame][0];
      return (now - this.parts.tracked[0][0]) / 10;
    }

    // Skin nodes that touch a plane floor, xyz one after the other [mm]; returns their number.
    contacts(into) {
      const floor = this.robot.floor_mm;
      if (!this.simulated || floor === null || !this.time.length) return 0;
      const limit = floor + TOUCHING_MM, p = this.positions;
      let count = 0;
      for (let i = 0; i < p.length; i += 3) {
        if (p[i + 2] <= limit) {
          into[3 * count] = p[i];
          into[3 * count + 1] = p[i + 1];
          into[3 * count + 2] = p[i + 2];
          count++;
        }
      }
      return count;
    }
  }

  // Rotation matrix, row by row, of the quaternion x, y, z, w in places 3 to 6.
  function rotationOf(hub) {
    const [x, y, z, w] = hub.subarray(3);
    return [
      1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
      2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
      2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ];
  }

  return { Motion };
})();
