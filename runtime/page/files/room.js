// The room in three dimensions: probes as spheres lit by the indirect light around them, windows, sun, objects, camera.

import { change, key, scene, select, whenSceneChanges } from "/scene.js";

/* global THREE */

// Irradiance of nine radiance coefficients, E(n) = sum A_l L_lm Y_lm(n) (Ramamoorthi & Hanrahan 2001); index l*l+l+m,
// packed as 27 numbers into seven vec4. Shown is E / pi, exposed and sRGB-encoded.
const PROBE_VERTEX = `
attribute vec3 place;
attribute vec4 l0, l1, l2, l3, l4, l5, l6;
uniform float size, exposure;
varying vec3 colour;
void main() {
  vec3 n = normalize(position);
  vec3 e = 3.141593 * 0.282095 * l0.xyz
    + 2.094395 * 0.488603 * (vec3(l0.w, l1.xy) * n.y + vec3(l1.zw, l2.x) * n.z + l2.yzw * n.x)
    + 0.785398 * (1.092548 * (l3.xyz * n.x * n.y + vec3(l3.w, l4.xy) * n.y * n.z + l5.yzw * n.x * n.z)
    + 0.315392 * vec3(l4.zw, l5.x) * (3.0 * n.z * n.z - 1.0) + 0.546274 * l6.xyz * (n.x * n.x - n.y * n.y));
  vec3 v = clamp(e * exposure / 3.141593, 0.0, 1.0);
  colour = mix(12.92 * v, 1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v));
  gl_Position = projectionMatrix * modelViewMatrix * vec4(place + size * position, 1.0);
}`;
const PROBE_FRAGMENT = "varying vec3 colour; void main() { gl_FragColor = vec4(colour, 1.0); }";

const vector = (a) => new THREE.Vector3(a[0], a[1], a[2]);
const line = (points, colour) =>
  new THREE.Line(new THREE.BufferGeometry().setFromPoints(points), new THREE.LineBasicMaterial({ color: colour }));

export class Room {
  constructor(view, room) {
    this.view = view;
    this.low = vector(room.low);
    this.high = vector(room.high);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.05, 500);
    this.camera.up.set(0, 0, 1);
    this.target = this.low.clone().add(this.high).multiplyScalar(0.5);
    this.orbit = { azimuth: -0.9, elevation: 0.45, distance: this.high.distanceTo(this.low) * 1.3 };
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    view.append(this.renderer.domElement);
    this.addRoom(room);
    this.addProbes(room.probes);
    this.things = new THREE.Group();
    this.sun = new THREE.Group();
    this.scene.add(this.things, this.sun);
    this.listen();
    whenSceneChanges(() => this.showObjects());
    this.showObjects();
    new ResizeObserver(() => this.draw()).observe(view);
  }

  addRoom(room) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(room.corners), 3));
    const colours = new Float32Array(room.corners.length);
    for (let t = 0; t < room.colours.length / 3; ++t)
      for (let k = 0; k < 9; ++k) colours[9 * t + k] = Math.sqrt(room.colours[3 * t + k % 3]);
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
    const walls = new THREE.MeshBasicMaterial({ vertexColors: THREE.VertexColors, side: THREE.DoubleSide, transparent: true,
                                                opacity: 0.16, depthWrite: false });
    this.scene.add(new THREE.Mesh(geometry, walls));
    this.scene.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 20), new THREE.LineBasicMaterial({ color: 0x8d9aa8 })));
    for (const corners of room.windows) {
      const points = corners.map(vector);
      this.scene.add(line([...points, points[0]], 0x59d0ff));
      const pane = new THREE.BufferGeometry();
      const fan = points.slice(2).flatMap((p, k) => [points[0], points[k + 1], p]);
      pane.setFromPoints(fan);
      this.scene.add(new THREE.Mesh(pane, new THREE.MeshBasicMaterial({ color: 0x59d0ff, side: THREE.DoubleSide, transparent: true,
                                                                         opacity: 0.25, depthWrite: false })));
    }
    this.windowCentre = room.windows.length ? room.windows[0].map(vector).reduce((a, b) => a.add(b), new THREE.Vector3())
      .multiplyScalar(1 / room.windows[0].length) : this.target.clone();
  }

  addProbes(places) {
    const sphere = new THREE.SphereBufferGeometry(1, 14, 10);
    const geometry = new THREE.InstancedBufferGeometry();
    geometry.index = sphere.index;
    geometry.setAttribute("position", sphere.getAttribute("position"));
    geometry.setAttribute("place", new THREE.InstancedBufferAttribute(new Float32Array(places), 3));
    this.probeCount = places.length / 3;
    geometry.maxInstancedCount = this.probeCount;
    for (let k = 0; k < 7; ++k)
      geometry.setAttribute(`l${k}`, new THREE.InstancedBufferAttribute(new Float32Array(4 * this.probeCount), 4));
    const spread = Math.cbrt((this.high.x - this.low.x) * (this.high.y - this.low.y) * (this.high.z - this.low.z) /
                             Math.max(1, this.probeCount));
    this.probes = new THREE.Mesh(geometry, new THREE.ShaderMaterial({
      vertexShader: PROBE_VERTEX, fragmentShader: PROBE_FRAGMENT,
      uniforms: { size: { value: Math.min(0.12, 0.2 * spread) }, exposure: { value: 1 } } }));
    this.probes.frustumCulled = false;
    this.scene.add(this.probes);
    document.getElementById("show-probes").addEventListener("change", (event) => {
      this.probes.visible = event.target.checked;
      this.draw();
    });
  }

  /// Light at the probes, and where the sun is.
  light(now) {
    const means = [];
    for (let p = 0; p < this.probeCount; ++p) {
      for (let i = 0; i < 27; ++i) this.probes.geometry.getAttribute(`l${i >> 2}`).array[4 * p + (i & 3)] = now.probes[27 * p + i];
      means.push(Math.max(now.probes[27 * p], now.probes[27 * p + 1], now.probes[27 * p + 2]) * 0.282095);
    }
    for (let k = 0; k < 7; ++k) this.probes.geometry.getAttribute(`l${k}`).needsUpdate = true;
    means.sort((a, b) => a - b);
    this.probes.material.uniforms.exposure.value = 0.7 / Math.max(1e-9, means[Math.floor(0.95 * (means.length - 1))] || 1);
    this.sun.remove(...this.sun.children);
    if (now.sun) {
      const far = this.high.distanceTo(this.low) * 0.6;
      const disc = new THREE.Mesh(new THREE.SphereBufferGeometry(far / 25, 16, 12), new THREE.MeshBasicMaterial({ color: 0xffe14a }));
      disc.position.copy(this.windowCentre).addScaledVector(vector(now.sun), far);
      this.sun.add(disc, line([disc.position, this.windowCentre], 0xffe14a));
    }
    this.draw();
  }

  showObjects() {
    this.things.remove(...this.things.children);
    scene.objects.forEach((object, k) => {
      const chosen = k === scene.selected, colour = chosen ? 0xffb02e : 0xd8dee4;
      const ball = new THREE.Mesh(new THREE.SphereBufferGeometry(object.radius, 24, 16),
                                  new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: chosen ? 0.55 : 0.4 }));
      ball.position.copy(vector(object.centre));
      ball.userData.object = k;
      const nose = new THREE.Vector3(Math.cos(object.rotation[2] * Math.PI / 180), Math.sin(object.rotation[2] * Math.PI / 180), 0);
      this.things.add(ball, line([ball.position, ball.position.clone().addScaledVector(nose, 1.4 * object.radius)], colour));
    });
    const c = scene.camera;
    if (c) {
      const eye = vector(c.eye), h = 0.25 * Math.tan(c.height_rad / 2), w = h * scene.photo[0] / scene.photo[1];
      const corner = (x, y) => eye.clone().addScaledVector(vector(c.forward), 0.25).addScaledVector(vector(c.right), x * w)
        .addScaledVector(vector(c.down), y * h);
      const [a, b, d, e] = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
      this.things.add(line([eye, a, b, eye, d, e, eye, a, e, d, b], 0x7dff9b));
    }
    this.draw();
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.view;
    if (!width || !height) return;
    const { azimuth, elevation, distance } = this.orbit;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.camera.position.set(Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation))
      .multiplyScalar(distance).add(this.target);
    this.camera.lookAt(this.target);
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.renderer.render(this.scene, this.camera);
  }

  ray(event) {
    const box = this.view.getBoundingClientRect(), caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1,
                                           1 - 2 * (event.clientY - box.top) / box.height), this.camera);
    return caster;
  }

  /// Pixel of the view that shows an object's middle.
  pixelOf(k) {
    const p = vector(scene.objects[k].centre).project(this.camera);
    return [(p.x + 1) / 2 * this.view.clientWidth, (1 - p.y) / 2 * this.view.clientHeight];
  }

  turn(dx, dy) {
    this.orbit.azimuth -= dx;
    this.orbit.elevation = Math.min(1.5, Math.max(-1.5, this.orbit.elevation + dy));
    this.draw();
  }
  zoom(factor) {
    this.orbit.distance = Math.min(200, Math.max(0.3, this.orbit.distance * factor));
    this.draw();
  }

  listen() {
    const fingers = new Map();
    let held = null; // { floor, grip }
    const apart = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY); };
    const onFloor = (event, floor) => this.ray(event).ray.intersectPlane(floor, new THREE.Vector3());
    this.view.addEventListener("pointerdown", (event) => {
      this.view.focus({ preventScroll: true });
      this.view.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, event);
      held = null;
      const hit = this.ray(event).intersectObjects(this.things.children).find((h) => h.object.userData.object !== undefined);
      if (!hit || fingers.size > 1) return;
      select(hit.object.userData.object);
      const object = scene.objects[hit.object.userData.object];
      const floor = new THREE.Plane(new THREE.Vector3(0, 0, 1), -object.position[2]), at = onFloor(event, floor);
      if (at) held = { floor, grip: [object.position[0] - at.x, object.position[1] - at.y], z: object.position[2] };
    });
    this.view.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const width = fingers.size === 2 ? apart() : 0;
      fingers.set(event.pointerId, event);
      if (fingers.size === 2) this.zoom(width / Math.max(1, apart()));
      else if (held) {
        const at = onFloor(event, held.floor);
        if (at) change({ position: [+(at.x + held.grip[0]).toFixed(4), +(at.y + held.grip[1]).toFixed(4), held.z] });
      } else this.turn((event.clientX - before.clientX) * 0.008, (event.clientY - before.clientY) * 0.008);
    });
    const release = (event) => { fingers.delete(event.pointerId); held = null; };
    this.view.addEventListener("pointerup", release);
    this.view.addEventListener("pointercancel", release);
    this.view.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(event.deltaY < 0 ? 0.9 : 1 / 0.9); },
                               { passive: false });
    this.view.addEventListener("keydown", (event) => {
      const keys = { ArrowLeft: () => this.turn(-0.1, 0), ArrowRight: () => this.turn(0.1, 0), ArrowUp: () => this.turn(0, 0.1),
                     ArrowDown: () => this.turn(0, -0.1), "+": () => this.zoom(0.9), "-": () => this.zoom(1 / 0.9) };
      if (!keys[event.key]) return key(event);
      event.preventDefault();
      keys[event.key]();
    });
  }
}
