// The live picture: objects are dragged in it, turned and scaled.

import { get, say, withToken } from "/api.js";
import { change, key, scene, scaleBy, select, selected, turnBy, whenSceneChanges } from "/scene.js";

const view = document.getElementById("picture"), image = document.getElementById("stream");
const marks = document.getElementById("picture-marks");
const STREAM = "/stream.mjpg";

/// Only a page that is seen asks for pictures.
function watch() {
  image.src = document.hidden ? "data:," : withToken(STREAM);
}
document.addEventListener("visibilitychange", watch);
image.addEventListener("error", () => { if (!document.hidden) setTimeout(watch, 1000); });

/// Pixel of the photograph, (0, 0) the centre of the top left one.
function pixelAt(event) {
  const box = image.getBoundingClientRect();
  return [(event.clientX - box.left) / box.width * scene.photo[0] - 0.5,
          (event.clientY - box.top) / box.height * scene.photo[1] - 0.5];
}

const fingers = new Map();
let drag = null;  // { grip }
let pinch = null; // { distance, angle, scale, rotation }

function fingerPair() {
  const [a, b] = [...fingers.values()];
  return { distance: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY),
           angle: Math.atan2(b.clientY - a.clientY, b.clientX - a.clientX) * 180 / Math.PI };
}

view.addEventListener("pointerdown", async (event) => {
  view.focus({ preventScroll: true });
  event.preventDefault();
  fingers.set(event.pointerId, event);
  view.setPointerCapture(event.pointerId);
  const object = selected();
  if (fingers.size === 2 && object) {
    drag = null;
    pinch = { ...fingerPair(), scale: object.scale, rotation: object.rotation };
    return;
  }
  try {
    const [x, y] = pixelAt(event);
    const picked = await get(`/scene/pick?x=${x}&y=${y}`);
    if (picked.object === null) return;
    select(picked.object);
    if (fingers.has(event.pointerId) && fingers.size === 1) drag = { grip: picked.grip };
  } catch (error) {
    say(error.message, true);
  }
});

view.addEventListener("pointermove", (event) => {
  if (!fingers.has(event.pointerId)) return;
  fingers.set(event.pointerId, event);
  if (pinch && fingers.size === 2) {
    const now = fingerPair();
    change({ scale: +(pinch.scale * now.distance / pinch.distance).toPrecision(4),
             rotation: [pinch.rotation[0], pinch.rotation[1], +(pinch.rotation[2] - (now.angle - pinch.angle)).toFixed(1)] });
  } else if (drag) {
    change({ pixel: pixelAt(event), grip: drag.grip });
  }
});

function release(event) {
  fingers.delete(event.pointerId);
  drag = null;
  if (fingers.size < 2) pinch = null;
}
view.addEventListener("pointerup", release);
view.addEventListener("pointercancel", release);
view.addEventListener("wheel", (event) => {
  if (!selected()) return;
  event.preventDefault();
  const up = (event.deltaY || event.deltaX) < 0;
  if (event.shiftKey) scaleBy(up ? 1.05 : 1 / 1.05);
  else turnBy(up ? 5 : -5);
}, { passive: false });
view.addEventListener("keydown", key);

/// Where a point of the room is in the photograph; the lens's distortion left out. Null behind the camera.
function project(point) {
  const c = scene.camera, d = point.map((x, i) => x - c.eye[i]);
  const along = (axis) => d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2];
  const depth = along(c.forward), f = scene.photo[1] / 2 / Math.tan(c.height_rad / 2);
  return depth > 0.01 ? { x: scene.photo[0] / 2 + f * along(c.right) / depth,
                          y: scene.photo[1] / 2 + f * along(c.down) / depth, perMetre: f / depth } : null;
}

whenSceneChanges(() => {
  const object = selected(), at = object && scene.camera && project(object.centre);
  marks.setAttribute("viewBox", `0 0 ${scene.photo[0]} ${scene.photo[1]}`);
  marks.replaceChildren();
  if (!at) return;
  const ring = document.createElementNS("http://www.w3.org/2000/svg", "circle");
  const fields = { cx: at.x, cy: at.y, r: object.radius * at.perMetre, fill: "none", stroke: "#ffb02e",
                   "stroke-width": scene.photo[0] / 250, "stroke-dasharray": scene.photo[0] / 60 };
  Object.entries(fields).forEach(([name, value]) => ring.setAttribute(name, value));
  marks.append(ring);
});

// Not before the page is there: the stream never ends loading.
if (document.readyState === "complete") watch();
else window.addEventListener("load", watch);
export { watch };
