// Lists, figures and graphs beside the pictures.

import { get, picture, say, token, withToken } from "/api.js";
import { add, change, remove, save, scene, select, selected, show, whenSceneChanges } from "/scene.js";

const at = (id) => document.getElementById(id);

function element(tag, text, fields = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  Object.entries(fields).forEach(([name, value]) => made.setAttribute(name, value));
  return made;
}

// Objects

const placement = at("placement");
const FIELDS = [["x", "position", 0], ["y", "position", 1], ["z", "position", 2],
                ["rx", "rotation", 0], ["ry", "rotation", 1], ["rz", "rotation", 2]];

/// Made anew only when names have changed: what is focused stays.
function listObjects() {
  const list = at("objects"), names = scene.objects.map((object, k) => `${k + 1} ${object.name}`);
  if (names.join() !== [...list.children].map((item) => item.textContent).join())
    list.replaceChildren(...names.map((name, k) => {
      const item = document.createElement("li"), button = element("button", name, { type: "button" });
      button.addEventListener("click", () => select(k));
      item.append(button);
      return item;
    }));
  [...list.children].forEach((item, k) => item.firstChild.setAttribute("aria-pressed", k === scene.selected));
}

function showObjects() {
  listObjects();
  const object = selected();
  placement.hidden = !object;
  if (object && !placement.contains(document.activeElement)) fillPlacement(object);
  if (at("model").options.length !== scene.models.length)
    at("model").replaceChildren(...scene.models.map((name, k) => element("option", name, { value: k })));
  for (const part of ["direct", "indirect", "differential"]) at(part).checked = scene.shown[part];
}

function fillPlacement(object) {
  for (const [name, key, i] of FIELDS) placement.elements[name].value = +object[key][i].toFixed(4);
  placement.elements.scale.value = +object.scale.toPrecision(4);
}

placement.addEventListener("submit", (event) => event.preventDefault());
placement.addEventListener("change", () => {
  const vector = (key) => FIELDS.filter((f) => f[1] === key).map(([name]) => Number(placement.elements[name].value));
  change({ position: vector("position"), rotation: vector("rotation"), scale: Number(placement.elements.scale.value) });
});
at("remove").addEventListener("click", remove);
at("save").addEventListener("click", save);
at("add-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const near = selected() || scene.objects[0];
  const from = near ? near.position : [0, 0, 0];
  add(Number(at("model").value), [+(from[0] + 0.3).toFixed(3), from[1], from[2]]);
});
for (const part of ["direct", "indirect", "differential"])
  at(part).addEventListener("change", () => show({ [part]: at(part).checked }));
whenSceneChanges(showObjects);

// Token

at("token-form").addEventListener("submit", (event) => {
  event.preventDefault();
  token.set(at("token").value);
  at("token").value = "";
  say(token.get() ? "the token is used for changes in this tab" : "no token");
});

// Sky

const SVG = "http://www.w3.org/2000/svg";
function shape(tag, fields) {
  const made = document.createElementNS(SVG, tag);
  Object.entries(fields).forEach(([name, value]) => made.setAttribute(name, value));
  return made;
}

let regions = null; // of the camera and the volume: they stay

export async function showSky(light) {
  const url = await picture("/scene/sky.jpg");
  const before = at("sky-picture").src;
  at("sky-picture").src = url;
  if (before.startsWith("blob:")) URL.revokeObjectURL(before);
  const unit = light.size[0] / 256, dots = (list, colour, r) =>
    list.map(([x, y]) => shape("circle", { cx: x + 0.5, cy: y + 0.5, r: r * unit, fill: colour, stroke: "#000", "stroke-width": unit / 3 }));
  const marks = at("sky-marks");
  regions ??= await get("/scene/regions");
  marks.setAttribute("viewBox", `0 0 ${light.size[0]} ${light.size[1]}`);
  marks.replaceChildren(
    shape("path", { d: regions.path, transform: "translate(0.5 0.5)", fill: "none", stroke: "#7dff9b", "stroke-opacity": 0.55,
                    "stroke-width": unit / 4 }),
    ...light.windows.map((line) => shape("polyline", { points: line.map(([x, y]) => `${x + 0.5},${y + 0.5}`).join(" "),
                                                       fill: "none", stroke: "#59d0ff", "stroke-width": 1.2 * unit })),
    ...dots(light.sky_samples, "#ff5cf4", 1.3), ...dots(light.sun_samples, "#ffe14a", 1.8));
  at("sky-counts").textContent = `(${light.sky_samples.length} + ${light.sun_samples.length} samples, ${regions.count} of ${regions.of} regions light the room)`;
}

// Time per stage

const COLOURS = ["#4da3ff", "#ffb02e", "#63d471", "#ff6f91", "#b388ff", "#4dd0c8", "#e0c068", "#9aa7b4",
                 "#d96c3b", "#8bc34a", "#5c6bc0", "#f48fb1", "#a1887f", "#ffffff"];
const KEPT = 160;
const history = []; // { stage: ms }
const stageNames = [];

function drawStages() {
  const canvas = at("stages"), pen = canvas.getContext("2d"), { width, height } = canvas;
  const top = Math.max(20, ...history.map((h) => stageNames.reduce((sum, name) => sum + (h[name] || 0), 0))) * 1.15;
  pen.clearRect(0, 0, width, height);
  history.forEach((sample, i) => {
    let y = height;
    stageNames.forEach((name, k) => {
      const h = (sample[name] || 0) / top * height;
      pen.fillStyle = COLOURS[k % COLOURS.length];
      pen.fillRect(width - (history.length - i) * width / KEPT, y - h, width / KEPT + 0.5, h);
      y -= h;
    });
  });
  pen.fillStyle = "#cdd5dd";
  pen.strokeStyle = "#ffffff55";
  pen.font = "14px sans-serif";
  for (const ms of [1000 / 60, 1000 / 30, 1000 / 15].filter((m) => m < top)) {
    const y = height - ms / top * height;
    pen.beginPath(); pen.moveTo(0, y); pen.lineTo(width, y); pen.stroke();
    pen.fillText(`${ms.toFixed(0)} ms`, 4, y - 3);
  }
}

function addStages(stages) {
  const { total, ...parts } = stages;
  for (const name of Object.keys(parts)) if (!stageNames.includes(name)) stageNames.push(name);
  history.push(parts);
  if (history.length > KEPT) history.shift();
  at("stage-names").replaceChildren(...stageNames.map((name, k) => {
    const item = document.createElement("li"), colour = document.createElement("span");
    colour.style.background = COLOURS[k % COLOURS.length];
    item.append(colour, `${name} ${(parts[name] || 0).toFixed(1)} ms`);
    return item;
  }));
  drawStages();
}

// State and cameras

const whole = (x) => (x === null || x === undefined ? "–" : String(x));
const seconds = (x) => (x === null || x === undefined ? "–" : `${x.toFixed(1)} s`);
const CAMERA_ROWS = [["connected", (c) => (c.connected ? "yes" : `no: ${c.trouble || "away"}`)], ["whole", (c) => whole(c.whole)],
                     ["used", (c) => whole(c.used)], ["superseded", (c) => whole(c.superseded)], ["damaged", (c) => whole(c.damaged)],
                     ["missing", (c) => whole(c.missing)], ["refused", (c) => whole(c.refused)], ["black", (c) => whole(c.black)],
                     ["age of the last", (c) => seconds(c.frame_age_s)], ["probable cause", (c) => c.likely_cause || "–"]];

function showCameras(status) {
  const body = at("cameras").tBodies[0];
  body.replaceChildren(...CAMERA_ROWS.map(([name, text]) => {
    const row = document.createElement("tr");
    row.append(element("th", name, { scope: "row" }), ...[status.sky, status.interior].map((c) => element("td", c ? text(c) : "–")));
    return row;
  }));
}

export function showStatus(status) {
  at("state").textContent = status.state;
  at("state").classList.toggle("bad", !["drawing", "idle"].includes(status.state));
  const figures = [["pictures/s", (status.pictures_per_s ?? 0).toFixed(1)],
                   ["latency", status.latency_ms ? `${status.latency_ms.median.toFixed(0)} ms` : "–"],
                   ["sky", status.sky_age_s == null ? "–" : `${status.sky_age_s.toFixed(1)} s old`],
                   ["marker", status.tracking || "–"]];
  at("figures").replaceChildren(...figures.map(([name, value]) => {
    const pair = document.createElement("div");
    pair.append(element("dt", name), element("dd", value));
    return pair;
  }));
  addStages(status.stage_ms || {});
  showCameras(status);
  at("warnings").replaceChildren(...(status.warnings || []).map((line) => element("li", line)));
}

export function showLost(error) {
  at("state").textContent = "no connection";
  at("state").classList.add("bad");
  say(error.message, true);
}
