// Requests to the daemon. Changes carry the token; it stays in this tab.

const given = new URLSearchParams(location.search).get("token") || new URLSearchParams(location.hash.slice(1)).get("token");
if (given) {
  sessionStorage.setItem("daylit-token", given);
  history.replaceState(null, "", location.pathname); // not into screenshots and bookmarks
}

export const token = {
  get: () => sessionStorage.getItem("daylit-token") || "",
  set: (text) => sessionStorage.setItem("daylit-token", text.trim()),
};

const headers = () => (token.get() ? { Authorization: `Bearer ${token.get()}` } : {});

async function answer(response) {
  const text = await response.text();
  let json = null;
  try { json = JSON.parse(text); } catch { /* a refusal is plain text */ }
  if (!response.ok) throw new Error((json && json.error) || text.trim() || `${response.status}`);
  return json;
}

export const get = async (path) => answer(await fetch(path, { headers: headers() }));

export const post = async (path, body = {}) =>
  answer(await fetch(path, { method: "POST", headers: { ...headers(), "Content-Type": "application/json" },
                             body: JSON.stringify(body) }));

/// Elements that load by themselves cannot send a header.
export const withToken = (path) => (token.get() ? `${path}?token=${encodeURIComponent(token.get())}` : path);

/// The picture at `path` as an object URL.
export async function picture(path) {
  const response = await fetch(path, { headers: headers() });
  if (!response.ok) throw new Error(`${response.status}`);
  return URL.createObjectURL(await response.blob());
}

const messages = document.getElementById("message");
export function say(text, bad = false) {
  messages.textContent = text;
  messages.classList.toggle("bad", bad);
}

/// Sends one change at a time; of those that come meanwhile only the last is kept.
export class LatestChange {
  constructor(send) { this.send = send; this.next = null; this.busy = false; }
  async put(change) {
    this.next = change;
    if (this.busy) return;
    this.busy = true;
    while (this.next) {
      const now = this.next;
      this.next = null;
      try { await this.send(now); } catch (error) { say(error.message, true); }
    }
    this.busy = false;
  }
}
