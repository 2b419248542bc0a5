"""`curvify view`: the command line, and its page in a browser."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from chromium import browser_or_skip, screenshot, touched_browser
from curvify.cli.main import run
from curvify.formats import write_mesh
from surfaces import on_sphere, truncated_icosahedron

WIDE, HIGH = 480, 480
#: What the frames of the picture start with; `keys` are pressed after that.
FRAMES = {
    "plain": "control=0",
    "zebra": "style=zebra&control=0",
    "normals": "style=normals&control=0",
    "wire": "wire=1&control=0",
    "control": "",
    "flat": "flat=1&control=0",
    "turned": "control=0&view=40,30",
    "pressed": "",
    "second": "model=2&control=0",
    "closer": "control=0&zoom=1.5",
    "values": "style=values&control=0",
    "parallel": "control=0&parallel=1",
    "dragged": "control=0&gesture=drag",
    "shifted": "control=0&parallel=1&gesture=shift",
    "zoomed": "control=0&gesture=zoom",
    "reset": "control=0&gesture=reset",
}
#: What pointers do on the canvas: places are apart from its middle. ``drag`` turns as in the frame "turned", and moves
#: pointers that are up; ``shift`` moves the mesh by ``SHIFT``: with the key, the right button, and two fingers;
#: ``zoom`` pinches to 3 and turns the wheel to 1.5. A page may have 16 contexts of WebGL: as many as there are frames.
SHIFT = (36, -24)
GESTURES = """<script type="module">
const [dx, dy] = SHIFT;
const canvas = document.getElementById("view"), middle = { x: innerWidth / 2, y: innerHeight / 2 };
const send = (kind, id, x, y, more = {}) => canvas.dispatchEvent(new PointerEvent(kind, {
  pointerId: id, clientX: middle.x + x, clientY: middle.y + y, buttons: 1, bubbles: true, cancelable: true, ...more }));
const drag = (id, from, to, more) => {
  send("pointerdown", id, ...from, more);
  for (const share of [0.3, 0.6, 1])
    send("pointermove", id, from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]), more);
  send("pointerup", id, ...to, { ...more, buttons: 0 });
};
const together = (starts, ends) => {
  starts.forEach((place, id) => send("pointerdown", id + 10, ...place, { pointerType: "touch" }));
  for (const share of [0.2, 0.5, 1])
    starts.forEach(([x, y], id) => send("pointermove", id + 10, x + share * (ends[id][0] - x),
      y + share * (ends[id][1] - y), { pointerType: "touch" }));
  ends.forEach((place, id) => send("pointerup", id + 10, ...place, { pointerType: "touch", buttons: 0 }));
};
const gestures = {
  drag: () => {
    drag(1, [0, 0], [-25, 12.5]);
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      send("pointerdown", 1, 0, 0);
      send(end, 1, 0, 0, { buttons: 0 });
      send("pointermove", 1, 50, 50);
    }
  },
  shift: () => {
    drag(1, [0, 0], [0.5 * dx, 0], { shiftKey: true });
    drag(1, [9, 9], [9 + 0.5 * dx, 9], { buttons: 2 });
    together([[-40, 10], [50, -20]], [[-40, 10 + dy], [50, -20 + dy]]);
  },
  zoom: () => {
    together([[-30, -15], [30, 15]], [[-90, -45], [90, 45]]);
    canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: Math.log(2) / 0.0015, cancelable: true }));
  },
  reset: () => {
    gestures.drag();
    gestures.shift();
    gestures.zoom();
    canvas.dispatchEvent(new MouseEvent("dblclick"));
  },
};
const wait = setInterval(() => {
  if (!document.getElementById("facts").textContent) return;
  clearInterval(wait);
  gestures[new URLSearchParams(location.hash.slice(1)).get("gesture")]();
}, 20);
</script></body>"""
#: Two arrows to the right, one up, and no control mesh: as in the frame "turned".
KEYS = ["ArrowRight", "ArrowRight", "ArrowUp", "c"]
PRESS = """<script type="module">
const wait = setInterval(() => {
  if (!document.getElementById("facts").textContent) return;
  clearInterval(wait);
  for (const key of KEYS) dispatchEvent(new KeyboardEvent("keydown", { key }));
}, 20);
</script></body>"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a page, ``page.html``, and others in which things happen."""
    browser_or_skip()
    folder = tmp_path_factory.mktemp("pages")
    coarse = on_sphere(truncated_icosahedron())
    write_mesh(coarse, folder / "coarse.obj")
    write_mesh(coarse.with_(positions=coarse.positions * [1.0, 1.0, 0.7]), folder / "low.obj")
    names = [str(folder / name) for name in ("coarse.obj", "ball.ply", "low.obj", "page.html")]
    assert run(["refine", names[0], names[1], "--level", "4"]) == 0
    options = ["--control", names[0], "--values", "z", "--view", "30,25"]
    assert run(["view", names[1], names[2], names[3], *options]) == 0
    page = Path(names[3]).read_text().replace('"style": "values"', '"style": "shaded"')
    (folder / "page.html").write_text(page)
    (folder / "pressed.html").write_text(page.replace("</body>", PRESS.replace("KEYS", str(KEYS))))
    (folder / "gestures.html").write_text(page.replace("</body>", GESTURES.replace("SHIFT", str(list(SHIFT)))))
    return folder


@pytest.fixture(scope="module")
def frames(pages: Path) -> dict[str, np.ndarray]:
    """Pictures ``(h,w,3)`` of one page in several states, by the names of ``FRAMES``: one run of the browser."""
    folder = pages
    shown_page = {name: "gestures" if "gesture=" in state else "page" for name, state in FRAMES.items()}
    shown_page["pressed"] = "pressed"
    sources = [f"{shown_page[name]}.html#{state}" for name, state in FRAMES.items()]
    shown = "".join(f'<iframe src="{source}"></iframe>' for source in sources)
    look = f"body{{margin:0;font-size:0}}iframe{{border:0;width:{WIDE}px;height:{HIGH}px}}"
    (folder / "all.html").write_text(f"<!DOCTYPE html><style>{look}</style><body>{shown}</body>")
    rows = -(-len(FRAMES) // 4)
    screenshot(folder / "all.html", folder / "all.png", (4 * WIDE, rows * HIGH))
    image = np.asarray(Image.open(folder / "all.png").convert("RGB")).astype(int)
    places = {name: divmod(k, 4) for k, name in enumerate(FRAMES)}
    return {
        name: image[row * HIGH : (row + 1) * HIGH, column * WIDE : (column + 1) * WIDE]
        for name, (row, column) in places.items()
    }


def middle(frame: np.ndarray) -> np.ndarray:
    """The part of a frame without buttons and words."""
    return frame[110:400, 20:460]


def covered(frame: np.ndarray) -> float:
    """Share of the middle that is not background."""
    return float((middle(frame) < 250).any(axis=2).mean())


def test_a_ball_is_round_and_lit_from_the_upper_left(frames):
    shown = middle(frames["plain"])
    assert 0.5 < covered(frames["plain"]) < 0.95
    bright = shown.sum(axis=2)
    assert bright[60, 170] > bright[240, 270] + 60


def test_zebra_is_black_and_white(frames):
    shown = middle(frames["zebra"]).max(axis=2)
    inside = (middle(frames["plain"]) < 250).any(axis=2)
    dark, light = (shown[inside] < 80).mean(), (shown[inside] > 150).mean()
    assert dark > 0.25 and light > 0.25 and dark + light > 0.85


def test_normals_are_colors(frames):
    assert (np.ptp(middle(frames["normals"]), axis=2) > 60).mean() > 0.3
    assert (np.ptp(middle(frames["plain"]), axis=2) > 90).mean() < 0.1


def test_wire_and_facets(frames):
    lines = middle(frames["plain"]).sum(axis=2) - middle(frames["wire"]).sum(axis=2)
    assert 0.03 < (lines > 100).mean() < 0.7
    assert (middle(frames["plain"]) != middle(frames["flat"])).any(axis=2).mean() > 0.05


def test_the_coarse_mesh_goes_on_and_off(frames):
    def red(frame: np.ndarray) -> float:
        shown = middle(frame)
        return float(((shown[..., 0] > 140) & (shown[..., 1:] < 90).all(axis=2)).mean())

    assert red(frames["control"]) > 0.01
    assert red(frames["plain"]) == 0


def test_values_have_their_colors_and_a_scale(frames):
    shown = middle(frames["values"])
    assert shown[:40, 180:260].mean() > shown[-40:, 180:260].mean() + 20  # z is dark below and light above
    first, last = np.array([32, 18, 77]), np.array([253, 243, 168])
    for color in (first, last):
        ends = [(np.abs(frames[name][360:] - color).max(axis=2) < 16).sum() for name in ("values", "plain")]
        assert ends[0] > 10 and ends[1] == 0


def test_keys_do_what_the_address_does(frames):
    assert (middle(frames["turned"]) != middle(frames["plain"])).any()
    assert np.array_equal(middle(frames["pressed"]), middle(frames["turned"]))


def test_other_meshes_and_other_cameras(frames):
    assert (middle(frames["second"]) != middle(frames["plain"])).any(axis=2).mean() > 0.1
    assert covered(frames["closer"]) > 1.05 * covered(frames["plain"])
    assert (middle(frames["parallel"]) != middle(frames["plain"])).any()


def near(frame: np.ndarray, expected: np.ndarray) -> bool:
    """Whether nothing but some pixels at outlines differs."""
    return bool((np.abs(middle(frame) - middle(expected)).max(axis=2) > 12).mean() < 0.002)


def test_a_drag_turns_until_the_pointer_is_up(frames):
    assert near(frames["dragged"], frames["turned"]) and not near(frames["dragged"], frames["plain"])


def test_the_mesh_follows_a_drag_with_shift_or_the_right_button_and_two_fingers(frames):
    x, y = SHIFT
    assert near(frames["shifted"], np.roll(frames["parallel"], (y, x), axis=(0, 1)))
    assert not near(frames["shifted"], frames["parallel"])


def test_fingers_and_the_wheel_zoom(frames):
    assert near(frames["zoomed"], frames["closer"])


def test_a_double_click_goes_back(frames):
    assert near(frames["reset"], frames["plain"])


#: Counts fingers, apart from what scripts do.
COUNT = """seen = 0; document.getElementById("view").addEventListener("pointerdown",
  (event) => { seen += event.isTrusted && event.pointerType === "touch"; });"""


def straight(start: tuple[float, float], end: tuple[float, float], steps: int = 6) -> list[tuple[float, float]]:
    """Places of a finger that moves evenly, from the middle of the page."""
    shares = [k / steps for k in range(steps + 1)]
    x, y = WIDE / 2, HIGH / 2
    return [(x + start[0] + s * (end[0] - start[0]), y + start[1] + s * (end[1] - start[1])) for s in shares]


def test_real_fingers_turn_shift_and_zoom(pages, frames, tmp_path):
    x, y = SHIFT
    states = {
        "control=0": [[straight((0, 0), (-25, 12.5))]],
        "control=0&parallel=1": [[straight((-40, 10), (-40 + x, 10 + y)), straight((50, -20), (50 + x, -20 + y))]],
        "control=0&": [[straight((-60, -30), (-90, -45)), straight((60, 30), (90, 45))]],
        "control=0&view=90,0": [[straight((5, 5), (5, 5), 1)]] * 2,
    }
    shown = []
    with touched_browser(tmp_path / "profile") as browser:
        for state, gestures in states.items():
            page = browser.open(f"{(pages / 'page.html').as_uri()}#{state}", (WIDE, HIGH))
            page.value(COUNT)
            for fingers in gestures:
                page.touch(*fingers)
            shown.append(np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB")).astype(int))
            assert page.value("[visualViewport.scale, scrollX, scrollY]") == [1, 0, 0]  # the page itself stays
            assert page.value("seen") == sum(map(len, gestures))
    turned, shifted, zoomed, reset = shown
    assert near(turned, frames["turned"]) and not near(turned, frames["plain"])
    assert near(shifted, np.roll(frames["parallel"], (y, x), axis=(0, 1)))
    assert near(zoomed, frames["closer"]) and not near(zoomed, frames["plain"])
    assert near(reset, frames["plain"])  # two taps


def test_to_a_file_and_through_a_pipe(process, folder):
    result = process("view", "cube.obj", "page.html", "-v")
    assert (result.code, result.out) == (0, b"")
    page = Path("page.html").read_bytes()
    assert f"page.html: {len(page):,} bytes" in result.err
    piped = process("view", "-", "-", "--input-format", "obj", stdin=Path("cube.obj"))
    assert (piped.code, piped.err) == (0, "")
    assert piped.out == page.replace(b"cube.obj", b"stdin")


def test_every_option_changes_the_page(call, folder):
    def written(*options: str) -> bytes:
        assert call("view", "cube.obj", "page.html", *options).code == 0
        return Path("page.html").read_bytes()

    pages = [
        written(*options)
        for options in (
            (),
            ("--style", "zebra"),
            ("--shading", "smooth"),
            ("--values", "z"),
            ("--values", "z", "--limits", "0,5"),
            ("--values", "bend"),
            ("--wire",),
            ("--control", "dart.obj"),
            ("--stripes", "3"),
            ("--color", "gold"),
            ("--view", "top"),
            ("--up", "y"),
            ("--background", "#123"),
        )
    ]
    assert len(set(pages)) == len(pages)
    assert written() == pages[0]


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("cube.obj page.png", "page.png: pages are HTML files; give a name that ends in .html"),
        ("cube.obj nowhere/a.html", "its folder does not exist"),
        ("cube.obj taken.html --no-clobber", "taken.html: it exists already"),
        ("none.obj a.html", "none.obj: cannot read"),
        ("points.obj a.html", "points.obj: the mesh has no faces"),
        ("cube.obj a.html --control none.obj", "none.obj: cannot read"),
        ("cube.obj a.html --limits 0,1", "--limits are those of --values"),
        ("cube.obj a.html --values z --limits 1,0", "is not a range"),
        ("cube.obj a.html --values z --style zebra", "both color the surface"),
        ("cube.obj a.html --background plaid", "unknown color 'plaid'"),
    ],
)
def test_what_is_refused(call, folder, line, text):
    Path("taken.html").write_text("mine")
    Path("points.obj").write_text("v 0 0 0\nv 1 0 0\n")
    result = call("view", *line.split())
    assert result.code == 2
    assert result.err.startswith("curvify: error: ") and result.err.count("\n") == 1
    assert text in result.err
    assert Path("taken.html").read_text() == "mine"
    assert not Path("a.html").exists()
