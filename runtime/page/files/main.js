// Starts the page, and asks for what changes by itself while the page is seen.

import { get, say } from "/api.js";
import { refresh } from "/scene.js";
import { showLost, showSky, showStatus } from "/panels.js";
import { Room } from "/room.js";
import { watch } from "/picture.js";

let room = null, lost = false;

/// Again and again, so long after the last one ended; not while the page is hidden.
function every(milliseconds, work) {
  const turn = async () => {
    if (!document.hidden) await work().catch(() => {});
    setTimeout(turn, milliseconds);
  };
  turn();
}

async function status() {
  try {
    showStatus(await get("/status"));
    if (lost) { lost = false; say(""); watch(); await refresh(); }
  } catch (error) {
    lost = true;
    showLost(error);
  }
}

async function light() {
  if (!room) {
    await refresh();
    room = new Room(document.getElementById("room"), await get("/scene/room"));
    window.daylitRoom = room; // for tests and the console
  }
  const now = await get("/scene/light");
  if (!now) return; // no sky yet
  room.light(now);
  await showSky(now);
}

every(500, status);
every(1000, light);
every(3000, refresh);
