#!/usr/bin/env python3
"""daylit-run's page in a headless Chromium, two fake cameras before it: what is seen, dragged, refused and saved.
Exit code 77: Chromium, its driver or a second address for the second camera is missing.
Usage: page_test.py BIN_FOLDER [FOLDER FOR SCREENSHOTS]"""
import base64, fcntl, json, pathlib, shutil, signal, socket, subprocess, sys, tempfile, time, urllib.error, urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import live_cameras
from live_cameras import Camera, live_config, section, started, wait_until_it_answers

BIN = live_cameras.BIN = pathlib.Path(sys.argv[1]).resolve()
SHOTS = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None
TOKEN = "a-token-of-the-test-1234"
SKY_WHITE, ROOM_WHITE = 60.0, 12.0  # radiance of the largest code value, exposed for a millisecond
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"


def http(url, method="GET", body=None, **headers):
    """(status, text)"""
    request = urllib.request.Request(url, method=method, headers=headers,
                                     data=None if body is None else json.dumps(body).encode())
    try:
        with urllib.request.urlopen(request, timeout=60) as reply:
            return reply.status, reply.read().decode(errors="replace")
    except urllib.error.HTTPError as refused:
        return refused.code, refused.read().decode(errors="replace")


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Browser:
    """The few parts of the WebDriver protocol that are needed."""

    def __init__(self):
        port = free_port()
        self.driver = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
        root = f"http://127.0.0.1:{port}"
        wait_for("chromedriver", lambda: self.answers(root + "/status"))
        options = {"args": ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
                            "--enable-unsafe-swiftshader", "--window-size=1280,1000"]}
        self.root = root
        made = self.call("POST", "/session", {"capabilities": {"alwaysMatch": {
            "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.root = f"{root}/session/{made['sessionId']}"

    @staticmethod
    def answers(url):
        try:
            return http(url)[0] == 200
        except OSError:
            return False

    def call(self, method, path, body=None):
        status, text = http(self.root + path, method, body, **{"Content-Type": "application/json"})
        value = json.loads(text)["value"]
        if status != 200:
            raise RuntimeError(f"{path}: {value}")
        return value

    def run(self, script, *args):
        return self.call("POST", "/execute/sync", {"script": script, "args": list(args)})

    def ask(self, script):
        """The value that a promise comes to."""
        return self.call("POST", "/execute/async", {
            "script": f"const done = arguments[0]; ({script})().then(done, (e) => done('failed: ' + e));", "args": []})

    def find(self, css):
        return self.call("POST", "/element", {"using": "css selector", "value": css})[ELEMENT]

    def click(self, css):
        self.run("document.querySelector(arguments[0]).scrollIntoView({block: 'center'})", css)
        self.call("POST", f"/element/{self.find(css)}/click", {})

    def type(self, css, text):
        self.call("POST", f"/element/{self.find(css)}/value", {"text": text})

    def drag(self, begin, end, steps=6):
        """Pixels of the window."""
        moves = [{"type": "pointerMove", "duration": 40, "x": round(begin[0] + (end[0] - begin[0]) * k / steps),
                  "y": round(begin[1] + (end[1] - begin[1]) * k / steps)} for k in range(steps + 1)]
        pause = {"type": "pause", "duration": 700}  # the object under the pointer is asked for
        self.call("POST", "/actions", {"actions": [{
            "type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"},
            "actions": [moves[0], {"type": "pointerDown", "button": 0}, pause, *moves[1:], pause,
                        {"type": "pointerUp", "button": 0}]}]})
        self.call("DELETE", "/actions")

    def shot(self, name):
        """The whole page."""
        if SHOTS:
            SHOTS.mkdir(parents=True, exist_ok=True)
            made = self.call("POST", "/goog/cdp/execute", {"cmd": "Page.captureScreenshot",
                                                           "params": {"captureBeyondViewport": True}})
            (SHOTS / f"{name}.png").write_bytes(base64.b64decode(made["data"]))

    def end(self):
        try:
            self.call("DELETE", "")
        finally:
            self.driver.terminate()
            self.driver.wait()


def wait_for(what, condition, seconds=120):
    end = time.time() + seconds
    while time.time() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.1)
    raise AssertionError(f"waited in vain: {what}")


def check(claim, holds, detail=""):
    print("ok    " if holds else "FAILED", claim, "" if holds else detail, flush=True)
    if not holds:
        check.failed += 1


check.failed = 0


def becomes(claim, measure, holds, seconds=60):
    """What is measured meets the claim before long: machines differ in how fast a picture follows."""
    end = time.time() + seconds
    while True:
        value = measure()
        if holds(value) or time.time() > end:
            return check(claim, holds(value), value)


PICTURE = """const i = document.getElementById('stream'), c = document.createElement('canvas');
c.width = 64; c.height = 62; const p = c.getContext('2d'); p.drawImage(i, 0, 0, 64, 62);
return Array.from(p.getImageData(0, 0, 64, 62).data).filter((_, k) => k % 4 === 1);"""
COLOURS = """const c = document.querySelector(arguments[0]), d = document.createElement('canvas');
d.width = 160; d.height = 120; const p = d.getContext('2d'); p.drawImage(c, 0, 0, 160, 120);
const s = new Set(), a = p.getImageData(0, 0, 160, 120).data;
for (let k = 0; k < a.length; k += 4) s.add((a[k] >> 3) << 10 | (a[k + 1] >> 3) << 5 | a[k + 2] >> 3);
return s.size;"""
UNNAMED = """return Array.from(document.querySelectorAll('button, input, select, [role=img], [role=application], img, canvas, svg'))
.filter((e) => !(e.textContent.trim() || e.labels?.length || e.getAttribute('aria-label') || e.alt || e.title ||
  e.getAttribute('aria-labelledby') || e.getAttribute('aria-hidden') || e.closest('#room'))).map((e) => e.outerHTML);"""
OBJECT = "async () => (await (await fetch('/scene')).json()).objects"
MARK = """const r = document.querySelector('#picture-marks circle').getBoundingClientRect();
return [r.x + r.width / 2, r.y + r.height / 2];"""


def look(b):
    """Everything of the page has something to show, and all of it comes from the server."""
    wait_for("a picture", lambda: b.run("return document.getElementById('stream').naturalWidth"))
    wait_for("an object", lambda: b.run("return document.querySelectorAll('#objects button').length"))
    wait_for("a sky", lambda: state(b) == "drawing")
    wait_for("stages", lambda: b.run("return document.querySelectorAll('#stage-names li').length") >= 3)
    wait_for("marks of the sky", lambda: b.run("return document.querySelectorAll('#sky-marks circle').length") > 8)
    becomes("the graph of the stages fills", lambda: b.run(COLOURS, "#stages"), lambda n: n >= 4)
    becomes("the room shows probes of many colours", lambda: b.run(COLOURS, "#room canvas"), lambda n: n > 60)
    check("windows are outlined in the sky", b.run("return document.querySelectorAll('#sky-marks polyline').length") > 0)
    outlines = b.run("return document.querySelector('#sky-marks path').getAttribute('d').split('M').length - 1")
    check("regions are outlined in the sky", outlines > 20, outlines)
    # The camera loses packets; on a machine that is busy as well more frames are missing than damaged.
    becomes("the cameras say the probable cause of losses",
            lambda: b.run("return document.getElementById('cameras').innerText"),
            lambda text: "packets are lost" in text or "whole frames are missing" in text)
    foreign = b.run("""return performance.getEntriesByType('resource').map((e) => e.name)
        .filter((n) => !n.startsWith(location.origin) && !n.startsWith('blob:') && !n.startsWith('data:'))""")
    check("nothing is loaded from elsewhere", foreign == [], foreign)
    unnamed = b.run(UNNAMED)
    check("everything that is used has a name for screen readers", unnamed == [], unnamed)


def state(b):
    return b.run("return document.getElementById('state').textContent")


def watch(b, moving, still):
    """The picture follows the camera, which is unplugged; another one comes back in its place, which stands."""
    def share_changed():
        before = b.run(PICTURE)
        time.sleep(1.2)
        return changed_share(before, b.run(PICTURE))

    becomes("the picture moves with the camera", share_changed, lambda share: share > 0.1)
    moving.unplug()
    wait_for("the page says that the camera is away", lambda: "interior camera away" in state(b))
    still.plug()
    wait_for("the picture is back", lambda: state(b) == "drawing")
    becomes("a camera that stands gives a picture that stands", share_changed, lambda share: share < 0.01)


def refuse(b, url, config):
    before, text = b.ask(OBJECT), config.read_text()
    b.click("#objects button")
    b.click("#picture-title")
    b.run("document.getElementById('picture').focus()")
    b.type("#picture", "\ue014")  # arrow right
    wait_for("a refusal", lambda: "token" in b.run("return document.getElementById('message').textContent").lower())
    b.click("#save")
    time.sleep(1)
    check("without the token nothing moves and nothing is saved", b.ask(OBJECT) == before and config.read_text() == text)
    bearer = {"Authorization": f"Bearer {TOKEN}"}
    body = {"object": 0, "scale": 2}
    for name, headers in (("another origin", {**bearer, "Origin": "http://evil.example"}),
                          ("a wrong token", {"Authorization": "Bearer wrong-token-of-the-test"}),
                          ("another host", {**bearer, "Host": "evil.example"})):
        status, said = http(url + "/scene/change", "POST", body, **headers)
        check(f"a change by {name} is refused", status in (401, 403), (status, said))
    for path in ("/../../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/files/index.html", "/scene/../config.toml"):
        check(f"{path} is not served", http(url + path)[0] in (400, 403, 404))
    for wrong in ({}, {"object": -1}, {"object": 7, "scale": 1}, {"object": 0, "scale": 1e9}, {"object": 0, "scale": 0},
                  {"object": 0, "position": [1e30, 0, 0]}, [1], None):
        status, said = http(url + "/scene/change", "POST", wrong, **bearer)
        check(f"the change {wrong} is refused in words", status in (400, 404) and "error" in said, said)
    check("and nothing has changed", b.ask(OBJECT) == before)


def changed_share(before, after):
    return sum(abs(x - y) > 12 for x, y in zip(before, after)) / len(before)


def moved_in(b, what, seconds):
    """By how many pixels a place moved: the page asks for the scene, and with it the camera, every three seconds."""
    before = b.run(what)
    time.sleep(seconds)
    return max(abs(x - y) for x, y in zip(before, b.run(what)))


def use_token(b):
    b.type("#token", TOKEN)
    b.click("#token-form button")
    check("the token leaves the field", b.run("return document.getElementById('token').value") == "")


def drag(b):
    b.run("window.scrollTo(0, 0); document.getElementById('picture').scrollIntoView({block: 'center'})")
    becomes("the mark stands where the camera now sees the object", lambda: moved_in(b, MARK, 7), lambda pixels: pixels < 3)
    still, before = b.run(PICTURE), b.ask(OBJECT)
    centre = b.run(MARK)
    b.drag(centre, (centre[0] - 70, centre[1] + 10))
    old = before[0]["position"]
    becomes("an object dragged in the picture moves on its floor", lambda: b.ask(OBJECT)[0]["position"],
            lambda now: max(abs(x - y) for x, y in zip(old[:2], now[:2])) > 0.05 and now[2] == old[2])
    becomes("and so does the picture", lambda: changed_share(still, b.run(PICTURE)), lambda share: share > 0.02)
    becomes("it comes where the pointer ended", lambda: b.run(MARK),
            lambda there: abs(there[0] - centre[0] + 70) < 15 and abs(there[1] - centre[1] - 10) < 15)
    b.shot("dragged")


def drag_in_room(b):
    b.run("document.getElementById('room').scrollIntoView({block: 'center'})")
    before = b.ask(OBJECT)[0]["position"]
    at = b.run("""const r = document.getElementById('room').getBoundingClientRect(), w = window.daylitRoom;
        const p = w.pixelOf(0); return [r.x + p[0], r.y + p[1]];""")
    b.drag(at, (at[0] + 30, at[1]))
    becomes("an object dragged in the room moves on its floor", lambda: b.ask(OBJECT)[0]["position"],
            lambda after: max(abs(x - y) for x, y in zip(before[:2], after[:2])) > 0.03 and after[2] == before[2])


def edit(b, config):
    b.run("document.getElementById('picture').focus()")
    turned = b.ask(OBJECT)[0]
    for key in ("]", "+"):
        b.type("#picture", key)
        time.sleep(0.7)
    becomes("keys turn and scale it", lambda: b.ask(OBJECT)[0],
            lambda now: abs(now["rotation"][2] - turned["rotation"][2] + 5) < 1e-6 and now["scale"] > turned["scale"])
    now = b.ask(OBJECT)[0]
    full = b.run(PICTURE)
    b.click("#direct")
    becomes("without direct light the picture is another", lambda: changed_share(full, b.run(PICTURE)),
            lambda share: share > 0.01)
    b.click("#direct")
    b.click("#add-form button")
    wait_for("a second object", lambda: len(b.ask(OBJECT)) == 2)
    b.shot("two")
    b.click("#save")
    wait_for("saved", lambda: "saved" in b.run("return document.getElementById('message').textContent"))
    text = config.read_text()
    check("the configuration has both objects", text.count("[[object]]") == 2, text)
    check("its comments and order stay", "# my own comment\n[[object]]" in text and
          text.index("# first line") == 0 and text.index("[light]") > text.rindex("[[object]]"), text)
    position = ", ".join(f"{x:g}" for x in now["position"])
    check("with the place it was dragged to", f"position = [{position}]" in text, (position, text))
    b.click("#remove")
    wait_for("one object", lambda: len(b.ask(OBJECT)) == 1)
    b.click("#save")
    wait_for("saved again", lambda: config.read_text().count("[[object]]") == 1)


def tablet(b):
    for name, width, height in (("tablet", 820, 1180), ("phone", 400, 850)):
        b.call("POST", "/window/rect", {"width": width, "height": height})
        time.sleep(1)
        wide = b.run("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
        check(f"nothing is wider than a {name}", wide <= 0, wide)
        b.run("window.scrollTo(0, 0)")
        b.shot(name)


def make_scene(folder, sky, room, port):
    """A room under an overcast sky, six places of the camera, and the configuration of the daemon."""
    run = lambda *words: subprocess.run([BIN / words[0], *words[1:], "--quiet"], check=True, cwd=folder)
    run("daylit-simulate", "--demo", "overcast", "-o", ".", "--size", "256,248", "--spp", "16", "--frames", "6")
    run("daylit-precompute", "room.obj", "-o", "room.volume", "--quality", "draft")
    config = folder / "CONFIG.toml"
    text = live_config(config.read_text(), section((folder / "scene.toml").read_text(), "marker"), (sky, "Mono16", 1000, 10),
                       (room, "RGB8", 1000, 10), SKY_WHITE / ROOM_WHITE)
    (folder / "token").write_text(TOKEN + "\n")
    config.write_text("# first line\n" + text.replace("[[object]]", "# my own comment\n[[object]]") +
                      f'\n[http]\nport = {port}\ntoken_file = "token"\n')
    return config


def what_is_missing():
    for program in ("chromium", "chromedriver"):
        if not shutil.which(program):
            return f"{program} is not installed (packages chromium and chromium-driver)"
    return "" if live_cameras.second_address() else live_cameras.NEEDS_ADDRESSES


def try_page(folder, sky_address, room_address):
    port = free_port()
    config = make_scene(folder, sky_address, room_address, port)
    views = sorted(folder.glob("interior*.exr"))
    sky = Camera([folder / "sky.exr"], sky_address, "--white", SKY_WHITE, "--mosaic", "rggb", "--lost-ratio", 0.002, "--noise")
    moving = Camera(views, room_address, "--white", ROOM_WHITE, "--response", "srgb", "--noise", "--seconds-each", 0.5)
    still = Camera(views[:1], room_address, "--white", ROOM_WHITE, "--response", "srgb", "--noise")
    sky.plug(), moving.plug()
    log = open(folder / "daemon.log", "w+")
    daemon = subprocess.Popen([BIN / "daylit-run", config], stderr=log)
    started.append(daemon)
    wait_until_it_answers(port, daemon)
    url, browser = f"http://127.0.0.1:{port}", Browser()
    try:
        browser.call("POST", "/url", {"url": url + "/"})
        look(browser)
        browser.shot("page")
        watch(browser, moving, still)
        refuse(browser, url, config)
        use_token(browser)
        drag(browser)
        drag_in_room(browser)
        edit(browser, config)
        tablet(browser)
        said = [e["message"] for e in browser.call("POST", "/se/log", {"type": "browser"}) if e["level"] == "SEVERE"]
        wrong = [m for m in said if "401" not in m and "403" not in m]
        check("no error in the browser's console", not wrong, wrong)
    finally:
        browser.end()
    daemon.send_signal(signal.SIGTERM)
    code = daemon.wait(timeout=20)
    log.seek(0)
    check("the daemon ends with exit code 0", code == 0, log.read())


def main():
    if missing := what_is_missing():
        print("the page is not tried: " + missing)
        return 77
    with open("/tmp/daylit-camera-test.lock", "w") as lock, tempfile.TemporaryDirectory() as folder:
        fcntl.flock(lock, fcntl.LOCK_EX)  # a port of GigE Vision per address: tests with cameras wait for each other
        try_page(pathlib.Path(folder), "127.0.0.1", live_cameras.second_address())
    print(f"{check.failed} failed")
    return 1 if check.failed else 0


sys.exit(main())
