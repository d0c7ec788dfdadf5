// The 3D picture: floor with a 5 cm grid, robots with their shadows, paths and contact points.
var pneumorphStage = globalThis.pneumorphStage || (() => {
  const GRID_MM = 50, SLACK = 0.45;
  const LIGHT = new THREE.Vector3(-0.35, -0.45, 0.82).normalize();
  // cividis: even in lightness, and the same to the colour-blind.
  const PRESSURE = ["#00224e", "#31446b", "#666970", "#958f78", "#cab969", "#fee838"];

  function pathColour(index, count) {
    const { ink, paths } = pneumorphColours;
    return count === 1 ? ink : paths[index % paths.length];
  }

  function pressureColour(share) {
    const place = Math.min(Math.max(share, 0), 1) * (PRESSURE.length - 1);
    const low = Math.min(Math.floor(place), PRESSURE.length - 2);
    return new THREE.Color(PRESSURE[low]).lerp(new THREE.Color(PRESSURE[low + 1]), place - low);
  }

  // As far as the floors of all robots rise forward, or fall [degrees].
  function shownSlope(motions) {
    const slopes = motions.filter((m) => m.simulated).map((m) => m.robot.floor_slope_deg || 0);
    return slopes.length ? Math.max(Math.min(...slopes), Math.min(0, Math.max(...slopes))) : 0;
  }

  // Matt facets, lit as in the films: more than half of the light comes from everywhere.
  function matt(colour) {
    return new THREE.ShaderMaterial({
      uniforms: { colour: { value: new THREE.Color(colour) }, light: { value: LIGHT } },
      vertexShader: `varying vec3 place;
        void main() {
          vec4 world = modelMatrix * vec4(position, 1.0);
          place = world.xyz;
          gl_Position = projectionMatrix * viewMatrix * world;
        }`,
      fragmentShader: `uniform vec3 colour; uniform vec3 light; varying vec3 place;
        void main() {
          vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
          gl_FragColor = vec4(colour * (0.55 + 0.45 * max(dot(normal, light), 0.0)), 1.0);
        }`,
    });
  }

  // Whether the graphics are a program's, without a card: smooth edges would cost too much there.
  function drawnByProcessor() {
    const context = document.createElement("canvas").getContext("webgl2");
    if (!context) return false;
    const names = context.getExtension("WEBGL_debug_renderer_info");
    const name = context.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER);
    const lose = context.getExtension("WEBGL_lose_context");
    if (lose) lose.loseContext();
    return /swiftshader|llvmpipe|softpipe|software/i.test(name);
  }

  class Stage {
    constructor(canvas, labels, motions, fullPressure) {
      this.motions = motions;
      this.fullPressure = fullPressure;
      this.colourBy = "regulator";
      this.showPaths = this.showContacts = true;
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !drawnByProcessor() });
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      this.pace = 1 / 60;
      this.scene = new THREE.Scene();
      this.scene.background = new THREE.Color("#f4f5f6");
      this.camera = new THREE.PerspectiveCamera(32, 1, 10, 20000);
      // The vertical in the floor's axes, in which robots are drawn.
      this.slope = THREE.MathUtils.degToRad(shownSlope(motions));
      this.camera.up.copy(this.tilted(0, 0, 1));
      this.controls = new THREE.OrbitControls(this.camera, canvas);
      this.controls.maxPolarAngle = Math.PI / 2 - 0.01;
      this.controls.addEventListener("change", () => { this.dirty = true; });
      this.measure();
      this.ground();
      this.actors = motions.map((m, i) =>
        m.simulated ? this.simulated(m, i, labels) : this.measured(m, i, labels));
      this.view("orbit");
    }

    // A direction of the level world in the floor's axes.
    tilted(...direction) {
      return new THREE.Vector3(...direction).applyAxisAngle(new THREE.Vector3(0, 1, 0), this.slope);
    }

    // What must be in view [mm].
    measure() {
      const box = new THREE.Box3(), floors = [];
      let top = 0;
      for (const motion of this.motions) {
        const lane = motion.robot.lane_mm, { reach, height } = this.sizeOf(motion);
        // A live robot's way is not known: leave it 20 cm.
        const [start] = motion.parts.tracked;
        const way = motion.time.length > 1 ? motion.parts.tracked : [start, [start[0] + 200, start[1]]];
        for (const [x, y] of way) {
          box.expandByPoint(new THREE.Vector3(x - reach, y + lane - reach, 0));
          box.expandByPoint(new THREE.Vector3(x + reach, y + lane + reach, 0));
        }
        top = Math.max(top, height);
        if (!motion.simulated) continue;
        let floor = motion.robot.floor_mm;
        if (motion.ground) {
          floor = motion.ground.heights.reduce((low, z) => Math.min(low, z));
        } else if (floor === null) {
          motion.show(0);
          floor = motion.positions.reduce((low, z, i) => (i % 3 === 2 && z < low ? z : low), 0);
        }
        floors.push(floor);
      }
      this.floor = floors.length ? Math.min(...floors) : 0;
      box.min.z = this.floor;
      box.max.z = Math.max(this.floor + 70, top);
      this.box = box;
    }

    // How far a robot reaches from its tracked point, and the height that it comes to [mm].
    sizeOf(motion) {
      let reach = 165, height = 0;
      if (!motion.simulated || !motion.time.length) return { reach, height };
      motion.show(0);
      const p = motion.positions, [x, y] = motion.tracked, rises = motion.parts.hub.map((hub) => hub[2]);
      for (let i = 0; i < p.length; i += 3) {
        reach = Math.max(reach, Math.hypot(p[i] - x, p[i + 1] - y));
        height = Math.max(height, p[i + 2]);
      }
      if (motion.robot.payload) {
        const { place_mm, radius_mm } = motion.robot.payload, [a, b, c, ...turn] = motion.hub;
        const place = new THREE.Vector3(...place_mm).applyQuaternion(new THREE.Quaternion(...turn));
        reach = Math.max(reach, Math.hypot(place.x + a - x, place.y + b - y) + radius_mm);
        height = Math.max(height, place.z + c + radius_mm);
      }
      return { reach, height: height + Math.max(...rises) - rises[0] };
    }

    ground() {
      const step = GRID_MM, points = [];
      const low = [0, 1].map((i) => Math.floor(this.box.min.getComponent(i) / step - 4) * step);
      const high = [0, 1].map((i) => Math.ceil(this.box.max.getComponent(i) / step + 4) * step);
      const z = this.floor - 0.8;
      for (let x = low[0]; x <= high[0]; x += step) points.push(x, low[1], z, x, high[1], z);
      for (let y = low[1]; y <= high[1]; y += step) points.push(low[0], y, z, high[0], y, z);
      const grid = new THREE.BufferGeometry();
      grid.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
      this.scene.add(new THREE.LineSegments(grid, new THREE.LineBasicMaterial({ color: "#dadde0" })));
      const start = new THREE.BufferGeometry();
      start.setAttribute("position", new THREE.Float32BufferAttribute(
        [0, low[1], z + 0.1, 0, high[1], z + 0.1], 3));
      this.scene.add(new THREE.LineSegments(start, new THREE.LineBasicMaterial({ color: "#8a8f94" })));
    }

    // The heights that a robot walks on, with the grid's lines on them.
    uneven(ground, group) {
      const { columns, rows, corner_mm, spacing_mm, heights } = ground, per = GRID_MM / spacing_mm;
      const place = (i, j, lift) => [corner_mm[0] + i * spacing_mm, corner_mm[1] + j * spacing_mm,
        heights[i * rows + j] + lift];
      const points = [], triangles = [], lines = [];
      for (let i = 0; i < columns; i++) {
        for (let j = 0; j < rows; j++) {
          points.push(...place(i, j, 0));
          const at = i * rows + j;
          if (i + 1 < columns && j + 1 < rows)
            triangles.push(at, at + rows, at + rows + 1, at, at + rows + 1, at + 1);
          if (j + 1 < rows && i % per === 0) lines.push(...place(i, j, 0.3), ...place(i, j + 1, 0.3));
          if (i + 1 < columns && j % per === 0) lines.push(...place(i, j, 0.3), ...place(i + 1, j, 0.3));
        }
      }
      const surface = new THREE.BufferGeometry(), grid = new THREE.BufferGeometry();
      surface.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
      surface.setIndex(triangles);
      grid.setAttribute("position", new THREE.Float32BufferAttribute(lines, 3));
      group.add(new THREE.Mesh(surface, matt("#f4f5f6")),
        new THREE.LineSegments(grid, new THREE.LineBasicMaterial({ color: "#c4c8cc" })));
    }

    simulated(motion, index, labels) {
      const robot = motion.robot, group = new THREE.Group();
      group.position.y = robot.lane_mm;
      this.scene.add(group);
      if (motion.ground) this.uneven(motion.ground, group);
      // Slides every point along the light down to just above the grid.
      const flat = new THREE.Matrix4().set(
        1, 0, -LIGHT.x / LIGHT.z, this.floor * LIGHT.x / LIGHT.z,
        0, 1, -LIGHT.y / LIGHT.z, this.floor * LIGHT.y / LIGHT.z,
        0, 0, 0, this.floor - 0.6, 0, 0, 0, 1);
      const shade = new THREE.MeshBasicMaterial({ color: "#cfd3d7", side: THREE.DoubleSide });
      const shadows = [];
      const legs = motion.legs.map(({ basis, start }) => {
        const geometry = new THREE.BufferGeometry();
        const place = motion.positions.subarray(start, start + 3 * basis.nodeCount);
        geometry.setAttribute("position",
          new THREE.BufferAttribute(place, 3).setUsage(THREE.DynamicDrawUsage));
        geometry.setIndex(new THREE.BufferAttribute(basis.triangles, 1));
        const mesh = new THREE.Mesh(geometry, matt("#ffffff"));
        const shadow = new THREE.Mesh(geometry, shade);
        shadow.matrixAutoUpdate = false;
        shadow.matrix.copy(flat);
        mesh.frustumCulled = shadow.frustumCulled = false;
        group.add(mesh, shadow);
        shadows.push(shadow);
        return mesh;
      });
      const solid = new THREE.BufferGeometry();
      solid.setAttribute("position", new THREE.BufferAttribute(
        pneumorphMotion.decoded(robot.hub_nodes_mm, Float32Array), 3));
      solid.setIndex(new THREE.BufferAttribute(
        pneumorphMotion.decoded(robot.hub_triangles, Uint32Array), 1));
      const hub = new THREE.Mesh(solid, matt(pneumorphColours.disk));
      const hubShadow = new THREE.Mesh(solid, shade);
      hub.matrixAutoUpdate = hubShadow.matrixAutoUpdate = false;
      hub.frustumCulled = hubShadow.frustumCulled = false;
      shadows.push(hubShadow);
      group.add(hub, hubShadow);
      if (robot.payload) shadows.push(this.payload(robot.payload, group, hub, hubShadow));
      const dots = new THREE.BufferGeometry();
      dots.setAttribute("position", new THREE.BufferAttribute(
        new Float32Array(motion.positions.length), 3).setUsage(THREE.DynamicDrawUsage));
      const contacts = new THREE.Points(dots, new THREE.PointsMaterial(
        { color: "#22272b", size: 3, sizeAttenuation: false, depthTest: false }));
      contacts.frustumCulled = false;
      group.add(contacts);
      const actor = { motion, group, legs, shadows, hub, hubShadow, flat, contacts, index };
      actor.label = this.label(labels, robot.label, index);
      return actor;
    }

    // A mark of what a hub carries, which goes with it, over all that would hide it; its shadow.
    payload(payload, group, hub, hubShadow) {
      const solid = new THREE.BufferGeometry();
      solid.setAttribute("position", new THREE.BufferAttribute(
        pneumorphMotion.decoded(payload.corners_mm, Float32Array), 3));
      const mark = new THREE.Mesh(solid, matt(pneumorphColours.ink));
      const shadow = new THREE.Mesh(solid, hubShadow.material);
      mark.material.depthTest = false;
      mark.renderOrder = 1;
      mark.matrixAutoUpdate = shadow.matrixAutoUpdate = false;
      mark.frustumCulled = shadow.frustumCulled = false;
      [mark.matrix, shadow.matrix] = [hub.matrix, hubShadow.matrix];
      group.add(mark, shadow);
      return shadow;
    }

    // A marker has a place and no direction: a triad along the world's axes.
    measured(motion, index, labels) {
      const group = new THREE.Group(), triad = new THREE.Group();
      group.position.y = motion.robot.lane_mm;
      pneumorphColours.triad.forEach((colour, axis) => {
        const direction = new THREE.Vector3().setComponent(axis, 1);
        triad.add(new THREE.ArrowHelper(direction, new THREE.Vector3(), 60, colour, 14, 8));
      });
      group.add(triad);
      this.scene.add(group);
      const actor = { motion, group, triad, index };
      actor.label = this.label(labels, motion.robot.label, index);
      return actor;
    }

    // Underlined in the colour of its path and curve.
    label(labels, text, index) {
      const element = document.createElement("div");
      element.textContent = text;
      element.style.borderBottom = `3px solid ${pathColour(index, this.motions.length)}`;
      labels.append(element);
      return element;
    }

    // Draw the path anew; once, and after every frame of a live robot.
    path(actor) {
      const { motion, index, group } = actor, points = motion.parts.tracked;
      if (actor.line && actor.lineLength === points.length) return;
      if (actor.line) {
        group.remove(actor.line);
        actor.line.geometry.dispose();
        actor.line = null;
      }
      actor.lineLength = points.length;
      if (points.length < 2) return;
      const geometry = new THREE.LineGeometry();
      geometry.setPositions(points.flatMap((p) => [p[0], p[1],
        (motion.ground ? motion.floorBelow(p[0], p[1]) + 0.4 : this.floor + 0.2)]));
      const material = actor.lineMaterial = actor.lineMaterial || new THREE.LineMaterial(
        { color: pathColour(index, this.motions.length), linewidth: 2.5 });
      actor.line = new THREE.Line2(geometry, material);
      actor.line.frustumCulled = false;
      group.add(actor.line);
    }

    // Take over what the motions show now.
    update() {
      for (const actor of this.actors) {
        const { motion } = actor;
        if (!motion.time.length) continue;
        this.path(actor);
        if (actor.line) {
          actor.line.visible = this.showPaths && motion.frame > 0;
          actor.line.geometry.instanceCount = motion.frame;
        }
        if (motion.simulated) this.updateSimulated(actor);
        else actor.triad.position.set(motion.tracked[0], motion.tracked[1], this.floor + 1);
      }
      this.follow();
      this.dirty = true;
    }

    // Of a leg by the regulators of its cavities: the mean of theirs.
    colourOf(motion, regulators) {
      const shares = regulators.map((each) =>
        Math.min(Math.max(motion.regulated[each - 1] / this.fullPressure, 0), 1));
      if (this.colourBy === "pressure") {
        return pressureColour(shares.reduce((sum, share) => sum + share, 0) / shares.length);
      }
      const mean = new THREE.Color(0, 0, 0), colours = pneumorphColours.regulators;
      regulators.forEach((each, i) => {
        const full = new THREE.Color(colours[(each - 1) % colours.length]);
        const tinted = new THREE.Color("#ffffff").lerp(full, SLACK + (1 - SLACK) * shares[i]);
        mean.add(tinted.multiplyScalar(1 / regulators.length));
      });
      return mean;
    }

    updateSimulated(actor) {
      const { motion, legs, hub, hubShadow, flat, contacts } = actor;
      legs.forEach((mesh, leg) => {
        mesh.geometry.attributes.position.needsUpdate = true;
        mesh.material.uniforms.colour.value.copy(this.colourOf(motion, motion.robot.regulators[leg]));
      });
      const [x, y, z, i, j, k, w] = motion.hub;
      hub.matrix.compose(new THREE.Vector3(x, y, z), new THREE.Quaternion(i, j, k, w),
        new THREE.Vector3(1, 1, 1));
      hubShadow.matrix.multiplyMatrices(flat, hub.matrix);
      const count = this.showContacts ? motion.contacts(contacts.geometry.attributes.position.array) : 0;
      contacts.geometry.setDrawRange(0, count);
      contacts.geometry.attributes.position.needsUpdate = true;
    }

    // Look from somewhere: "orbit", "follow", "top" or "side".
    view(name) {
      const centre = this.box.getCenter(new THREE.Vector3());
      const size = this.box.getSize(new THREE.Vector3());
      const half = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2));
      const aspect = this.camera.aspect || 1.6;
      const directions = { orbit: [-0.25, -0.8, 0.72], follow: [-0.5, -0.8, 0.6],
        top: [0, -0.001, 1], side: [0, -1, 0.12] };
      const direction = this.tilted(...directions[name]).normalize();
      let width = size.x, height = name === "side" ? size.z : size.y;
      this.followed = null;
      if (name === "follow") {
        this.followed = this.actors[this.selected || 0].motion;
        width = height = 340;
        this.lastFollowed = this.place(this.followed);
        centre.copy(this.lastFollowed);
      }
      const slant = name === "orbit" || name === "follow" ? 0.75 : 1;
      const away = 1.2 * Math.max(width / (2 * half * aspect), height * slant / (2 * half)) +
        (name === "side" ? size.y / 2 : 0);
      this.controls.target.copy(centre);
      this.camera.position.copy(centre).addScaledVector(direction, away);
      this.controls.update();
      // What is near is seen larger: back until all of it is in view.
      for (let i = 0; i < 40 && !this.followed && !this.inView(); i++) {
        this.camera.position.sub(centre).multiplyScalar(1.04).add(centre);
        this.controls.update();
      }
      this.viewName = name;
      this.dirty = true;
    }

    // Whether all that must be in view is, and clear of the legend below.
    inView() {
      this.camera.updateMatrixWorld();
      const { min, max } = this.box;
      return [0, 1, 2, 3, 4, 5, 6, 7].every((corner) => {
        const place = new THREE.Vector3(...["x", "y", "z"].map((axis, bit) =>
          (corner >> bit & 1 ? max : min)[axis])).project(this.camera);
        return Math.abs(place.x) < 0.98 && place.y < 0.98 && place.y > -0.9;
      });
    }

    place(motion) {
      const [x, y] = motion.tracked;
      return new THREE.Vector3(x, y + motion.robot.lane_mm, this.floor + 15);
    }

    follow() {
      if (!this.followed) return;
      const now = this.place(this.followed);
      const step = now.clone().sub(this.lastFollowed);
      this.camera.position.add(step);
      this.controls.target.add(step);
      this.controls.update();
      this.lastFollowed = now;
    }

    // Leave out shadows, then pixels, where the machine cannot draw 30 pictures in a second.
    keepUp(passed) {
      this.pace += 0.05 * (passed - this.pace);
      const ratio = this.renderer.getPixelRatio();
      if (this.pace < 1 / 32) return;
      this.pace = 1 / 60;
      const shadows = this.actors.flatMap((actor) => actor.shadows || []);
      if (shadows.some((each) => each.visible)) for (const each of shadows) each.visible = false;
      else if (ratio > 0.5) this.renderer.setPixelRatio(Math.max(0.5, 0.8 * ratio));
    }

    resize(width, height) {
      const first = !this.width;
      [this.width, this.height] = [width, height];
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      if (first) this.view(this.viewName);
      this.dirty = true;
    }

    render() {
      for (const actor of this.actors) {
        if (actor.lineMaterial) actor.lineMaterial.resolution.set(this.width, this.height);
      }
      this.renderer.render(this.scene, this.camera);
      this.placeLabels(); // where the camera is now
      this.dirty = false;
    }

    // Each above its robot; those that would cover each other below each other, the first on top.
    placeLabels() {
      const placed = [];
      for (const { motion, label } of [...this.actors].reverse()) {
        if (!motion.time.length) continue;
        const point = this.place(motion);
        point.z += 75;
        point.project(this.camera);
        label.style.display = point.z < 1 ? "" : "none";
        if (!(point.z < 1)) continue;
        const box = { x: (point.x + 1) / 2 * this.width, y: (1 - point.y) / 2 * this.height,
          width: label.offsetWidth, height: label.offsetHeight };
        const covers = (other) => Math.abs(box.x - other.x) < (box.width + other.width) / 2 &&
          box.y > other.y - other.height && other.y > box.y - box.height;
        for (let other; (other = placed.find(covers));) box.y = other.y - other.height - 1;
        placed.push(box);
        label.style.transform = `translate(-50%, -100%) translate(${box.x}px, ${box.y}px)`;
      }
    }

    dispose() {
      this.controls.dispose();
      this.scene.traverse((each) => {
        if (each.geometry) each.geometry.dispose();
        if (each.material) each.material.dispose();
      });
      this.renderer.dispose();
      this.renderer.forceContextLoss();
    }
  }

  return { Stage, pathColour, PRESSURE };
})();
