// The objects as the daemon has them, which one is selected, and every way to change them.

import { get, post, say, LatestChange } from "/api.js";

export const scene = { objects: [], models: [], selected: -1, photo: [1, 1], camera: null, shown: {} };
const listeners = [];
export const whenSceneChanges = (listener) => listeners.push(listener);
const tell = () => listeners.forEach((listener) => listener(scene));

export async function refresh() {
  Object.assign(scene, await get("/scene"));
  if (scene.selected >= scene.objects.length) scene.selected = scene.objects.length - 1;
  tell();
}

export function select(k) {
  scene.selected = k;
  tell();
}

export const selected = () => scene.objects[scene.selected] || null;

const changes = new LatestChange(async (change) => {
  await post("/scene/change", change);
  await refresh();
});
export const change = (fields) => scene.selected >= 0 && changes.put({ object: scene.selected, ...fields });

const wrap = (degrees) => ((degrees + 180) % 360 + 360) % 360 - 180;
const round = (x, step) => Math.round(x / step) * step;

export function moveBy(dx, dy, dz) {
  const o = selected();
  if (o) change({ position: [o.position[0] + dx, o.position[1] + dy, o.position[2] + dz].map((x) => +round(x, 1e-4).toFixed(4)) });
}
export function turnBy(degrees) {
  const o = selected();
  if (o) change({ rotation: [o.rotation[0], o.rotation[1], +wrap(o.rotation[2] + degrees).toFixed(2)] });
}
export function scaleBy(factor) {
  const o = selected();
  if (o) change({ scale: +Math.min(1000, Math.max(0.001, o.scale * factor)).toPrecision(4) });
}

/// A request that says what became of it.
async function act(done, work) {
  try {
    await work();
    await refresh();
    say(done);
  } catch (error) {
    say(error.message, true);
  }
}

export const add = (model, position) => act(`${scene.models[model]} added`, async () => {
  say(`${scene.models[model]} is loaded …`);
  await post("/scene/add", { model, position });
  scene.selected = scene.objects.length;
});
export const remove = () => selected() && act("taken out", () => post("/scene/remove", { object: scene.selected }));
export const save = () => act("saved to the configuration", () => post("/scene/save"));
export const show = (parts) => act("", () => post("/scene/show", parts));

/// Keys of both views; true where the key was one of them. Steps along the room's axes.
export function key(event) {
  const step = event.shiftKey ? 0.1 : 0.01;
  const keys = {
    ArrowLeft: () => moveBy(-step, 0, 0), ArrowRight: () => moveBy(step, 0, 0),
    ArrowUp: () => moveBy(0, step, 0), ArrowDown: () => moveBy(0, -step, 0),
    PageUp: () => moveBy(0, 0, step), PageDown: () => moveBy(0, 0, -step),
    "[": () => turnBy(5), "]": () => turnBy(-5), "+": () => scaleBy(1.05), "-": () => scaleBy(1 / 1.05),
    n: () => scene.objects.length && select((scene.selected + 1) % scene.objects.length), Delete: remove,
    1: () => show({ direct: !scene.shown.direct }), 2: () => show({ indirect: !scene.shown.indirect }),
    3: () => show({ differential: !scene.shown.differential }),
  };
  if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  keys[event.key]();
}
