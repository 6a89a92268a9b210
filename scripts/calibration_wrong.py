"""What daylit-calibrate says where something is wrong. Part "wrong" of scripts/measure-calibration."""
import numpy as np

from calibration_inputs import FISHEYE, chart_codes, chart_light, run, tool, write_hdr

CAMERA = """image_width: 1000
image_height: 750
camera_matrix: {rows: 3, cols: 3, data: [810, 0, 503, 0, 812, 371, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.24, 0.09, -0.0006, 0.0004, 0]}
"""


class Sitting:
    """Photographs, each kind once, and what daylit-calibrate says of them."""

    def __init__(self, o, folder):
        self.o, self.folder, self.said, self.all = o, folder, 0, 0
        (folder / "camera.yaml").write_text(CAMERA)
        (folder / "fisheye.yaml").write_text(FISHEYE)

    def take(self, name, lens, board, *options, views=9):
        """The files; `board`: COLSxROWS and what else print takes."""
        out, print_ = self.folder / name, self.folder / f"{name}.png"
        run(self.o.bin / "daylit-calibrate", "print", "--board", board[0], "--square", 0.03, *board[1:], "-o", print_, "--dpi", 254)
        run(self.o.bin / "daylit-simulate", "photographs", print_, "--width", 0.03 * (int(board[0].split("x")[0]) + 3), "--lens",
            self.folder / f"{lens}.yaml", "-o", out, "--views", views, "--seed", 77, "--quiet", *options)
        return sorted(out.glob("*.jpg"))

    def ask(self, what, wanted, *arguments, verdict="repeat"):
        """Whether the verdict is this one, and a reason (or what is said of a picture) contains `wanted`."""
        j, _, _ = tool(self.o, *arguments, "-o", self.folder / "out", "--force")
        texts = j["why"] + [f"{d['file']}: {d['why']}" for d in j["dropped"]]
        fine = j["verdict"] == verdict and any(wanted in text for text in (texts if verdict == "pass" else j["why"]))
        self.all, self.said = self.all + 1, self.said + fine
        print(f"{arguments[0]}, {what}: {j['verdict']}, {len(j['used'])} used\n    " + "\n    ".join(j["why"] + texts[len(j["why"]):][:2]) +
              ("" if fine else f"\n    <-- does not say: {verdict}, {wanted}"), flush=True)


def wrong(o, folder):
    """Sittings and brackets in which something is wrong: what the verdict says."""
    s = Sitting(o, folder)
    for lens in ("camera", "fisheye"):
        for kind, markers in (("checkerboard", []), ("ChArUco", ["--dictionary", "5X5_100", "--marker", 0.021])):
            wrong_lens(s, lens, kind, markers)
    wrong_brackets(s)
    wrong_charts(s)
    print(f"{s.said} of {s.all} verdicts say what is wrong")


def wrong_lens(s, lens, kind, markers):
    name, board = f"{lens}-{kind}", ["8x7", *markers]
    stated = lambda size: [lens, "--board", size, "--square", 0.03, *markers]
    ask = lambda what, wanted, files, size="8x7", **more: s.ask(f"{kind}, {what}", wanted, *stated(size), *files, **more)
    good = s.take(f"{name}-good", lens, board, views=14)
    ask("nothing wrong", "agree within", good, verdict="pass")
    ask("wrong size", "size", good, size="10x6")
    ask("two boards mixed", "two boards", good[:7] + s.take(f"{name}-other", lens, ["6x5", *markers], views=5))
    ask("one picture nine times", "alike", good[:1] * 9)
    ask("blurred", "blurred", s.take(f"{name}-blurred", lens, board, "--blur", 12))
    for exposure in (2, 3, 8, 60):
        ask(f"over-exposed {exposure} times", "over-exposed", s.take(f"{name}-{exposure}", lens, board, "--exposure", exposure))
    bright = [file.rename(s.folder / "bright.jpg") for file in s.take(f"{name}-bright", lens, board, "--exposure", 4, views=1)]
    ask("one picture of 15 over-exposed", "over-exposed, though in use: bright.jpg", good + bright, verdict="pass")


def wrong_brackets(s):
    y, x = np.mgrid[0:240, 0:320]
    write_hdr(s.folder / "scene.hdr", 10 ** (0.95 * np.sin(0.021 * x) + 0.95 * np.cos(0.017 * y)))
    times = [0.01, 0.03, 0.1, 0.2, 0.6, 2]

    def bracket(name, exposures, *options):
        files = [s.folder / f"{name}-{k}.png" for k in range(len(exposures))]
        for k, (file, e) in enumerate(zip(files, exposures)):
            run(s.o.bin / "daylit-simulate", "develop", s.folder / "scene.hdr", "-o", file, "--exposure", e, "--noise", 0.01, "--seed", k,
                "--logarithmic", 30, "--quiet", *options)
        return files
    good = bracket("good", times)
    curve = s.folder / "curve.txt"
    tool(s.o, "response", *good, "--exposures", ",".join(map(str, times)), "-o", curve)
    for command in (["response"], ["merge", "--response", curve]):
        def ask(what, wanted, files, stated, **more):
            s.ask(what, wanted, *command, *files, "--exposures", ",".join(map(str, stated)), **more)
        ask("nothing wrong", "agree", good, times, verdict="pass")
        ask("one exposure only", "one exposure only", bracket("same", [0.2] * 5), [0.2] * 5)
        ask("one picture at five stated times", "alike", good[3:4] * 5, times[:5])
        ask("over-exposed", "shorter", bracket("bright", [5e3 * t for t in times]), times)
        ask("all white", "alike", bracket("white", [1e6 * t for t in times]), times)
        ask("under-exposed", "longer", bracket("dark", [3e-5 * t for t in times]), times)
        ask("a wrong time", "good-3.png was exposed", good, [*times[:3], 0.07, *times[4:]])
        ask("a picture of another size", "pixels", good + small(s), [*times, 5], verdict="pass")


def small(s):
    write_hdr(s.folder / "small.hdr", np.ones((60, 80)))
    run(s.o.bin / "daylit-simulate", "develop", s.folder / "small.hdr", "-o", s.folder / "small.png", "--quiet")
    return [s.folder / "small.png"]


def wrong_charts(s):
    random = np.random.default_rng(3)
    def chart(name, light, turn=0):
        rgb = np.rot90(np.clip(light * random.normal(1, 0.01, light.shape), 0, 1), turn // 90)
        (s.folder / name).write_bytes(b"P6\n%d %d\n65535\n" % rgb.shape[1::-1] + np.round(65535 * rgb).astype(">u2").tobytes())
        return s.folder / name
    good = chart_light(chart_codes())
    s.ask("nothing wrong", "left out", "colour", chart("good.ppm", good), verdict="pass")
    s.ask("chart upside down", "upside down", "colour", chart("down.ppm", good, 180))
    s.ask("over-exposed twice", "over-exposed", "colour", chart("bright.ppm", 2 * good))
    s.ask("over-exposed 20 times", "over-exposed", "colour", chart("white.ppm", 20 * good))
    s.ask("mirrored", "", "colour", chart("mirrored.ppm", good[:, ::-1]))
    s.ask("no chart", "no chart", "colour", chart("none.ppm", np.full((300, 400, 3), .3)))
