// What robots do: arrays decoded from base64, and positions at any time.
// Between recorded frames everything moves linearly; at a frame it is what was recorded.
"use strict";
var pneumorphMotion = globalThis.pneumorphMotion || (() => {
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

  const FORWARD = { label: "distance", symbol: " cm", digits: 1, direction: [1, 0, 0] };
  const LEAST_UPRIGHT = 0.3; // as pneumorph/base/heading.py has it
  const whole = (turn) => turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI));
  const degrees = (angle) => angle * 180 / Math.PI;

  class Motion {
    constructor(robot, bases) {
      this.robot = robot;
      // What of its way is told: cm forward, cm to the left and degrees turned to the left count.
      this.goal = robot.goal || FORWARD;
      this.turns = []; // to the left since the first frame, whole circles counted [degrees]
      this.headings = []; // where it faced last, from forward to the left [rad]
      this.simulated = robot.kind === "simulated";
      // Heights that it walks on; null on a plane.
      this.ground = robot.ground
        ? { ...robot.ground, heights: decoded(robot.ground.height_mm, Float32Array) } : null;
      // Of each leg: its modes, where its nodes begin among all, and its first coefficient.
      this.legs = [];
      let nodes = 0, modes = 0;
      for (const number of this.simulated ? robot.bases : []) {
        const basis = basisOf(bases[number]);
        this.legs.push({ basis, start: 3 * nodes, mode: modes });
        nodes += basis.nodeCount;
        modes += basis.modeCount;
      }
      this.modeCount = modes;
      this.time = [];
      this.parts = { hub: [], tracked: [], commanded: [], regulated: [], coefficients: [], raw: [] };
      // World positions of the skins' nodes as shown, leg after leg [mm], without the lane.
      this.positions = new Float32Array(3 * nodes);
      this.hub = new Float64Array(7);
      this.tracked = new Float64Array(3);
      this.commanded = new Float64Array(robot.regulator_count);
      this.regulated = new Float64Array(robot.regulator_count);
      this._shape = new Float64Array(3 * Math.max(0, ...this.legs.map((l) => l.basis.nodeCount)));
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
      if (this.simulated) {
        add(this.parts.coefficients, more.coefficients_mm, this.modeCount);
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

    // x = p_hub + R_hub (p_leg + R_leg (mean + sum of coefficient times mode))
    _showLegs(frame, next, share) {
      const a = this.parts.coefficients[frame], b = this.parts.coefficients[next];
      const shape = this._shape, hub = rotationOf(this.hub), to = this.positions;
      this.legs.forEach(({ basis, start, mode }, leg) => {
        const { nodeCount, modeCount, mean, modes } = basis, width = nodeCount * 3;
        shape.set(mean);
        for (let m = 0; m < modeCount; m++) {
          const place = mode + m, c = a[place] + share * (b[place] - a[place]);
          const first = m * width;
          for (let i = 0; i < width; i++) shape[i] += c * modes[first + i];
        }
        // Row by row: what the hub makes of the leg's rotation and position.
        const pose = this.robot.poses[leg];
        const r = [0, 3, 6].flatMap((i) => [0, 1, 2, 3].map((column) =>
          hub[i] * pose[column] + hub[i + 1] * pose[4 + column] + hub[i + 2] * pose[8 + column]));
        for (let i = 0; i < width; i += 3) {
          const x = shape[i], y = shape[i + 1], z = shape[i + 2];
          to[start + i] = this.hub[0] + r[3] + r[0] * x + r[1] * y + r[2] * z;
          to[start + i + 1] = this.hub[1] + r[7] + r[4] * x + r[5] * y + r[6] * z;
          to[start + i + 2] = this.hub[2] + r[11] + r[8] * x + r[9] * y + r[10] * z;
        }
      });
    }

    // Whether it came to the end of its walk: one that diverged has travelled no distance.
    get sound() { return (this.robot.status || "completed") === "completed"; }

    // Forward travel of the tracked point since the first frame [cm], now or in a frame.
    distance(frame) {
      if (!this.time.length) return 0;
      const now = frame === undefined ? this.tracked : this.parts.tracked[frame];
      return (now[0] - this.parts.tracked[0][0]) / 10;
    }

    // What of its goal it has achieved since the first frame, now or in a frame.
    achieved(frame) {
      if (!this.time.length) return 0;
      const [forward, left, turn] = this.goal.direction;
      if (turn) return turn * this.turned(frame);
      const now = frame === undefined ? this.tracked : this.parts.tracked[frame];
      const start = this.parts.tracked[0];
      return (forward * (now[0] - start[0]) + left * (now[1] - start[1])) / 10;
    }

    // Turn to the left since the first frame [degrees], now or in a frame. A robot that is tipped
    // over faces where it did, so that turning over is no turn; before it stood, along the axis.
    turned(frame) {
      const { hub } = this.parts;
      const facing = (row, before) => {
        const r = rotationOf(row);
        return r[8] > LEAST_UPRIGHT ? Math.atan2(r[3], r[0]) : before;
      };
      for (let i = this.turns.length; i < hub.length; i++) {
        const before = i ? this.headings[i - 1] : 0, now = facing(hub[i], before);
        this.headings.push(now);
        this.turns.push(i ? this.turns[i - 1] + degrees(whole(now - before)) : 0);
      }
      if (frame !== undefined) return this.turns[frame];
      const before = this.headings[this.frame];
      return this.turns[this.frame] + degrees(whole(facing(this.hub, before) - before));
    }

    // Height of the floor below a place [mm]; null where it is not known.
    floorBelow(x, y) {
      const ground = this.ground;
      if (!ground) return this.robot.floor_mm;
      const at = [x, y].map((value, axis) => (value - ground.corner_mm[axis]) / ground.spacing_mm);
      const last = [ground.columns - 2, ground.rows - 2];
      const [i, j] = at.map((u, axis) => Math.min(Math.max(Math.floor(u), 0), last[axis]));
      const [s, t] = [at[0] - i, at[1] - j].map((u) => Math.min(Math.max(u, 0), 1));
      const h = (a, b) => ground.heights[(i + a) * ground.rows + j + b];
      return (1 - s) * ((1 - t) * h(0, 0) + t * h(0, 1)) + s * ((1 - t) * h(1, 0) + t * h(1, 1));
    }

    // Skin nodes that touch the floor, xyz one after the other [mm]; returns their number.
    contacts(into) {
      const floor = this.robot.floor_mm;
      if (!this.simulated || (floor === null && !this.ground) || !this.time.length) return 0;
      const p = this.positions;
      let count = 0;
      for (let i = 0; i < p.length; i += 3) {
        if (p[i + 2] <= (this.ground ? this.floorBelow(p[i], p[i + 1]) : floor) + TOUCHING_MM) {
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

  return { Motion, decoded };
})();
