"""What scripts/measure-live and scripts/demo-live have in common: two fake GigE cameras over loopback, a configuration
of them, and the daemon's HTTP."""
import atexit, json, re, subprocess, sys, time, urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BIN = ROOT / "build/release/bin"

started = []  # processes; none outlives the script
atexit.register(lambda: [p.kill() for p in started if p.poll() is None])


def run(*command, **options):
    return subprocess.run([str(c) for c in command], check=True, **options)


NEEDS_ADDRESSES = "two cameras need two addresses. As root: ip addr add 127.0.0.2/8 dev lo"


def second_address():
    """Of the loopback device, besides 127.0.0.1; None: it has none."""
    known = subprocess.run(["ip", "-4", "-o", "addr"], capture_output=True, text=True).stdout
    others = [a for a in re.findall(r"inet (127\.[0-9.]+)", known) if a != "127.0.0.1"]
    return others[0] if others else None


def two_addresses():
    """Of this machine, for a camera each; as root 127.0.0.2 is added to the loopback device."""
    subprocess.run(["ip", "addr", "add", "127.0.0.2/8", "dev", "lo"], stderr=subprocess.DEVNULL)
    return "127.0.0.1", second_address() or sys.exit(NEEDS_ADDRESSES)


class Camera:
    """daylit-bench camera, which can be unplugged."""

    def __init__(self, pictures, address, *options, says=None):
        self.command = [str(BIN / "daylit-bench"), "camera", *map(str, pictures), "--address", address, "--serial",
                        Path(pictures[0]).stem, *map(str, options), *(["--json"] if says else [])]
        self.says, self.process = says, None  # says: file for a line per frame

    def plug(self):
        """Again while another fake camera, of a test for example, has the address."""
        while True:
            out = open(self.says, "w") if self.says else subprocess.DEVNULL
            self.process = subprocess.Popen(self.command, stdout=out, stderr=subprocess.PIPE, text=True)
            started.append(self.process)
            said = self.process.stderr.readline()
            if "until Ctrl-C" in said:
                self.since = time.time()
                return
            if "no camera can be served" not in said:
                sys.exit(said)
            self.process.wait()
            time.sleep(0.3)

    def unplug(self):
        if self.process:
            self.process.kill()
            self.process.wait()
        self.process = None


def section(text, name):
    return re.search(rf"^\[{name}\].*?(?=^\[|\Z)", text, re.S | re.M).group(0)


def live_config(text, marker, sky, room, scale):
    """The simulator's configuration with cameras in the place of pictures, [marker] in that of [pose], and no [output].
    `sky`, `room`: address, pixel format, exposure in microseconds, and frames a second."""
    camera = 'camera = "{}"\npixel_format = "{}"\nexposure_us = {}\nframe_rate = {}\npacket_size = 8192\n'
    text = text.replace(section(text, "pose"), marker.rstrip() + "\n\n")
    text = re.sub(r"^\[output\].*?(?=^\[|\Z)", "", text, flags=re.S | re.M)
    text = text.replace('image = "sky.exr"\n', camera.format(*sky) + 'mosaic = "rggb"\n')
    text = text.replace('image = "interior.exr"\n', camera.format(*room))
    return text.replace('response = "linear"\nscale = 1', f'response = "srgb"\nscale = {scale}')


def get(port, path, timeout=5):
    return urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=timeout).read()


def status(port):
    return json.loads(get(port, "/status"))


def wait_until_it_answers(port, process, seconds=60):
    end = time.time() + seconds
    while process.poll() is None and time.time() < end:
        try:
            return get(port, "/status")
        except OSError:
            time.sleep(0.1)
    sys.exit("daylit-run does not answer")
