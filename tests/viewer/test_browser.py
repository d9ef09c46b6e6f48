"""What users meet: the viewer's page in headless Chromium, before a small real scene.

Everything runs as it is delivered: `sumo3dviz-pt view` as a program of its own, its page in
a browser, keys and clicks as the browser makes them of a keyboard and a mouse.
"""

from __future__ import annotations

import base64
import io
import itertools
import json
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from builders import write_scenario
from needed import skip_if
from PIL import Image
from viewer.browser import Browser, Page, chromium
from viewer.program import Program

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.pipeline.live import render_still
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.cameras.free import build_flight
from sumo3dviz_pt.viewer.keyframes import HASTE, SPEED, TURN, ViewerEye

pytestmark = [
    pytest.mark.slow,
    skip_if(chromium() is None, "there is no Chromium on the PATH"),
]

SIZE = (160, 90)
FPS = 10
SLACK = 0.15
"""Between a key in the browser and the same key in the render thread [s]."""

WATCH = """
window.watch = {held: {}, frames: []};
for (const kind of ['keydown', 'keyup'])
  addEventListener(kind, event => {
    if (!event.repeat) (watch.held[event.code] ??= []).push(event.timeStamp);
  }, true);
{
  let last = null;
  const look = () => {
    const frame = window.viewer && viewer.frame;
    if (frame && frame !== last) watch.frames.push(last = frame);
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}
"""
"""Notes in the page how long keys were held, and about every picture what it shows."""

CONTROLS = "button, select, input, textarea, a[href], [tabindex='0']"


# What runs ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scenario(tmp_path_factory.mktemp("viewer"))


@pytest.fixture(scope="module")
def program(scene: Path) -> Iterator[Program]:
    with Program(scene, "--size", f"{SIZE[0]}x{SIZE[1]}") as running:
        yield running


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as running:
        yield running


@pytest.fixture
def visit(browser: Browser, program: Program) -> Iterator[Callable[[], Page]]:
    """Opens pages; at the end nothing may have gone wrong in them, or asked for others."""
    pages = []

    def visit() -> Page:
        pages.append(browser.open(program.address, before=WATCH))
        at(pages[-1], 4.0)
        return pages[-1]

    yield visit
    for page in pages:
        page.close()
    own = program.address.partition("//")[2]
    for page in pages:
        assert not page.errors
        asked = [url for url in page.requests if not url.startswith(("data:", "blob:"))]
        assert asked and all(url.partition("//")[2].startswith(own) for url in asked)


@pytest.fixture
def page(visit: Callable[[], Page]) -> Page:
    """A page that shows the camera `post` at 4 s."""
    return visit()


# What is seen ------------------------------------------------------------------------------


def at(page: Page, time: float) -> None:
    """Go to a time with the slider, as a user does, and have the keys in the picture again."""
    page.wait_for("!!window.viewer && !!viewer.frame", seconds=120.0)
    page.choose("#time", time)
    page.wait_for(f"Math.abs(viewer.frame.time - {time}) < 1e-3")
    page.focus("#picture")


def frame(page: Page) -> dict:
    """What the page says about the picture it shows."""
    return page.evaluate("viewer.frame")


def eye(page: Page) -> ViewerEye:
    """Where the picture on display was taken."""
    said = frame(page)["eye"]
    return ViewerEye(said["position"], said["heading"], said["pitch"], said["roll"], said["fov"])


def settled(page: Page) -> ViewerEye:
    """The eye after all that was asked for has been shown: in a while, or if nothing is new."""
    page.evaluate("window.before = viewer.frame.seq")
    page.wait_for("viewer.frame.seq > before + 2 && viewer.frame.spp > 1 || viewer.frame.spp > 500")
    return eye(page)


def pixels(page: Page) -> Floats:
    """The picture on display in 8-bit codes, (h, w, 3)."""
    url = page.evaluate("document.querySelector('#picture').toDataURL('image/png')")
    picture = Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2])))
    return np.asarray(picture.convert("RGB"), dtype=float)


def at_rest(page: Page, *, spp: int = 32) -> Floats:
    """The picture once it has that many samples."""
    page.wait_for(f"viewer.frame.spp >= {spp} && viewer.frame.size[0] === {SIZE[0]}")
    return pixels(page)


def rms(one: Floats, other: Floats) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2)))


def front(vehicle: str, time: float) -> Floats:
    """Where the builders' log has a vehicle's front, (3,) [m]."""
    number = int(vehicle.removeprefix("v"))
    return np.array([-40.0 + 18.0 * (number // 2) + 10.0 * time, -4.8 + 3.2 * (number % 2), 0.0])


def seen_at(looking: ViewerEye, point: Floats) -> tuple[float, float]:
    """Where a point appears in the picture: shares of width and height from the top left."""
    rotation = looking.view().world_from_camera.matrix[:3, :3]
    ahead, left, up = (np.asarray(point) - looking.position) @ rotation
    half = np.tan(np.radians(looking.fov) / 2.0) * ahead
    return 0.5 - 0.5 * left / half, 0.5 - 0.5 * up / half * SIZE[0] / SIZE[1]


# Keys and mouse ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "way", "speed"),
    [
        (["KeyW"], "ahead", SPEED),
        (["ArrowLeft"], "left", SPEED),
        (["KeyR"], "up", SPEED),
        (["ShiftLeft", "KeyS"], "back", SPEED * HASTE),
    ],
)
def test_keys_move_the_camera_by_a_known_offset(page, keys, way, speed) -> None:
    before = eye(page)
    for key in keys:
        page.key_down(key)
    page.wait_for(f"performance.now() - watch.held.{keys[-1]}[0] > 800")
    for key in reversed(keys):
        page.key_up(key)
    after = settled(page)
    down, up = page.evaluate(f"watch.held.{keys[-1]}")
    heading = np.radians(before.heading)
    ahead = np.array([np.sin(heading), np.cos(heading), 0.0])
    ways = {"ahead": ahead, "back": -ahead, "up": np.array([0.0, 0.0, 1.0])}
    ways["left"] = np.array([-ahead[1], ahead[0], 0.0])
    offset = after.position - before.position
    length = offset @ ways[way]
    assert length == pytest.approx(speed * (up - down) / 1000.0, abs=speed * SLACK)
    assert np.linalg.norm(offset - length * ways[way]) < 0.01
    assert (after.heading, after.pitch) == (before.heading, before.pitch)


def test_keys_and_drags_turn_the_camera(page) -> None:
    before = eye(page)
    page.hold("KeyL", seconds=0.5)
    after = settled(page)
    down, up = page.evaluate("watch.held.KeyL")
    turned = (after.heading - before.heading) % 360.0
    assert turned == pytest.approx(TURN * (up - down) / 1000.0, abs=TURN * SLACK)
    np.testing.assert_allclose(after.position, before.position, atol=0.01)

    # Straight ahead lies where the pointer took it, a quarter of the picture to the right.
    point = after.position + 100.0 * after.view().world_from_camera.matrix[:3, 0]
    width = page.evaluate("document.querySelector('#picture').clientWidth")
    page.drag(page.place("#picture"), (0.25 * width, 0.0))
    now = settled(page)
    assert seen_at(now, point) == pytest.approx((0.75, 0.5), abs=0.02)
    np.testing.assert_array_equal(now.position, after.position)


def test_keys_in_a_text_field_do_not_move_the_camera(page) -> None:
    before = eye(page)
    page.click("[data-panel=path]")
    page.focus("#keyframe-save input")
    page.hold("KeyW", seconds=0.3)
    page.press("Digit2")
    assert "w2" in page.evaluate("document.activeElement.value")
    after = settled(page)
    np.testing.assert_array_equal(after.position, before.position)
    assert frame(page)["riding"] is None


# A still camera ----------------------------------------------------------------------------


def test_a_still_camera_converges_to_what_a_still_shows(page, scene) -> None:
    order = Request(camera="post", quality="reference", spp=256, size=SIZE)
    at(page, 4.5)
    page.evaluate("watch.frames.length = 0")
    at(page, 4.0)
    taken = [at_rest(page, spp=spp) for spp in (1, 8, 32, 128)]
    # Which pictures are shown hangs on the browser: a newer one replaces one that waits.
    page.wait_for("watch.frames.some(each => each.error !== null && each.spp >= 128)")
    shown = page.evaluate("watch.frames.filter(each => each.error !== null)")
    page.close()  # or the viewer would go on, and share the processor
    reference = render_still(load_job(scene), order, 4.0).develop().astype(float)
    errors = [rms(picture, reference) for picture in taken]
    assert all(later < earlier for earlier, later in itertools.pairwise(errors)), errors
    assert errors[-1] < 0.25 * errors[0], errors
    said = {each["spp"]: each["error"] for each in shown if each["time"] == 4.0}
    few, many = min(said), max(said)
    assert few <= 8 and many >= 128, said
    assert said[many] < 1.6 * np.sqrt(few / many) * said[few], said


def test_the_slider_changes_the_traffic_and_nothing_else(page) -> None:
    page.click("#denoise")
    before = eye(page)
    shown = {}
    for traffic in (True, False):
        for time in (4.0, 6.0):
            at(page, time)
            shown[traffic, time] = at_rest(page)
            assert frame(page)["denoised"]
        page.click("#traffic")
        page.wait_for("viewer.frame.spp < 16")
    driven = rms(shown[True, 4.0], shown[True, 6.0])
    # Nobody on the road: all times look alike, and different from all with traffic.
    assert rms(shown[False, 4.0], shown[False, 6.0]) < driven / 3.0
    assert rms(shown[True, 4.0], shown[False, 4.0]) > driven / 3.0
    np.testing.assert_array_equal(eye(page).position, before.position)


def test_space_lets_the_traffic_run_and_a_frame_is_a_frame(page) -> None:
    page.press("Period")
    page.wait_for(f"Math.abs(viewer.frame.time - 4 - 1 / {FPS}) < 1e-6")
    page.press("Comma")
    page.press("Comma")
    page.wait_for(f"Math.abs(viewer.frame.time - 4 + 1 / {FPS}) < 1e-6")
    page.press("Space")
    page.wait_for("viewer.frame.playing && viewer.frame.time > 5")
    page.press("Space")
    page.wait_for("!viewer.frame.playing")
    assert frame(page)["time"] < 9.0


def test_a_clicked_vehicle_is_ridden(page) -> None:
    before = eye(page)
    middle = front("v2", 4.0) + np.array([-2.3, 0.0, 0.8])
    x, y = seen_at(before, middle)
    assert 0.0 < x < 1.0 and 0.0 < y < 1.0
    page.click("#picture", x=x, y=y)
    page.wait_for("/^(vehicle:)?v2$/.test(viewer.frame.riding)")
    riding = settled(page)
    assert np.linalg.norm((riding.position - middle)[:2]) < 15.0
    page.press("Period")
    page.wait_for(f"viewer.frame.time > 4 + 0.5 / {FPS}")
    moved = eye(page).position - riding.position
    np.testing.assert_allclose(moved, (10.0 / FPS, 0.0, 0.0), atol=0.03)
    page.press("Escape")
    page.wait_for("viewer.frame.riding === null")


def test_a_click_at_the_sky_rides_with_nobody(page) -> None:
    page.hold("KeyI", seconds=0.8)
    up = settled(page)
    assert up.pitch > 20.0
    page.click("#picture", y=0.2)
    after = settled(page)
    assert frame(page)["riding"] is None
    np.testing.assert_array_equal(after.position, up.position)


# Cameras that are saved --------------------------------------------------------------------


def test_a_view_is_saved_as_a_camera_by_its_name(page, scene) -> None:
    """It stands in the scene file, is offered at once, and shows what was seen."""
    page.hold("KeyD", seconds=0.5)
    page.hold("KeyK", seconds=0.3)
    page.click("[data-panel=place]")
    found = settled(page)
    page.choose("#view-save input", "corner")
    page.click("#view-save button")
    page.wait_for("document.querySelector('#notes').innerText.includes('Saved as camera corner')")
    offered = page.evaluate("[...document.querySelectorAll('#camera option')].map(o => o.value)")
    assert "corner" in offered
    camera = load_job(scene).cameras["corner"]
    np.testing.assert_allclose(camera.position, found.position, atol=0.01)
    assert camera.heading == pytest.approx(found.heading, abs=0.02)
    assert camera.pitch == pytest.approx(found.pitch, abs=0.02) and camera.pitch < -5.0
    assert camera.lens.fov == pytest.approx(found.fov, abs=0.1)
    assert page.evaluate("document.querySelector('#view-save input').value") == "corner2"
    page.hold("KeyA", seconds=0.5)
    page.choose("#camera", "corner")
    page.wait_for(f"Math.abs(viewer.frame.eye.position[0] - {camera.position[0]}) < 0.01")


# Key frames --------------------------------------------------------------------------------


def test_saved_key_frames_render_the_path_that_was_played(page, scene, tmp_path) -> None:
    page.click("[data-panel=path]")
    page.click("#keyframe-add")
    page.focus("#picture")
    page.hold("KeyD", seconds=0.5)
    page.hold("KeyJ", seconds=0.3)
    at(page, 5.5)
    page.click("#keyframe-add")
    page.wait_for("viewer.keyframes.length === 2")
    page.evaluate("watch.frames.length = 0")
    page.click("#keyframe-play")
    page.wait_for("watch.frames.some(frame => frame.playing)")
    page.wait_for("!viewer.frame.playing")
    played = [each for each in page.evaluate("watch.frames") if each["playing"]]
    assert len(played) > 3 and played[0]["time"] < 4.8 < 5.2 < played[-1]["time"]

    page.choose("#keyframe-save input", "visit")
    page.click("#keyframe-save button")
    page.wait_for("!!document.querySelector('#notes .note')")
    camera = build_flight(load_job(scene).cameras["visit"])
    for each in played:
        saved = ViewerEye.of(camera.view_at(each["time"]))
        np.testing.assert_allclose(each["eye"]["position"], saved.position, atol=0.01)
        assert each["eye"]["heading"] == pytest.approx(saved.heading, abs=0.02)

    page.close()
    film = tmp_path / "visit.mp4"
    order = ["render", str(scene), "--camera", "visit", "--from", "4", "--to", "5.6"]
    more = ["--fps", "2.5", "--quality", "draft", "--size", "64x36", "-o", str(film)]
    assert main([*order, *more]) == 0
    account = json.loads(film.with_suffix(".json").read_text(encoding="utf-8"))
    assert len(account["frames"]) == 4
    for each in account["frames"]:
        expected = camera.view_at(each["time"]).position
        np.testing.assert_allclose(each["camera"]["position"], expected, atol=1e-6)


# Several pages, and foreign ones -----------------------------------------------------------


def test_two_pages_stand_where_each_one_went(visit) -> None:
    one, other = visit(), visit()
    start = settled(other)
    one.hold("KeyD", seconds=0.4)
    at(other, 6.0)
    moved, stayed = settled(one), settled(other)
    assert np.linalg.norm(moved.position - start.position) > 2.0
    np.testing.assert_array_equal(stayed.position, start.position)
    assert frame(one)["time"] == pytest.approx(4.0, abs=1e-3)
    counts = [each.evaluate("viewer.pictures") for each in (one, other)]
    for each, count in zip((one, other), counts, strict=True):
        each.wait_for(f"viewer.pictures > {count} || viewer.frame.spp > 200")


def status(url: str, **headers: str) -> int:
    """The answer's code."""
    asked = urllib.request.Request(url, headers=headers)
    try:
        with urllib.request.urlopen(asked, timeout=20) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        error.close()
        return error.code


def test_a_wrong_token_a_foreign_page_and_a_foreign_name_are_refused(program) -> None:
    place = f"http://127.0.0.1:{program.port}"
    assert status(program.address) == 200
    assert status(f"{place}/") == 404
    assert status(f"{place}/guessed/") == 404
    assert status(f"{place}/guessed/ws") == 404
    assert status(f"{program.address}ws", Origin="http://elsewhere.example") == 403
    assert status(program.address, Host="elsewhere.example") == 403


def test_a_foreign_page_gets_no_line_to_the_viewer(browser, program) -> None:
    stranger = browser.open("about:blank")
    address = program.address.replace("http", "ws") + "ws"
    answer = stranger.evaluate(
        "new Promise(done => {"
        f" const line = new WebSocket({json.dumps(address)});"
        " line.onopen = () => done('open'); line.onerror = () => done('refused'); })"
    )
    stranger.close()
    assert answer == "refused"


def test_a_wrong_address_says_so_in_plain_words(browser, program) -> None:
    page = browser.open(f"http://127.0.0.1:{program.port}/guessed/")
    said = "document.body && document.body.innerText.includes('nothing at this address')"
    assert page.wait_for(said)
    page.close()


# The viewer goes away ----------------------------------------------------------------------


def test_after_a_restart_the_page_goes_on_where_it_was(browser, scene) -> None:
    size = ("--size", f"{SIZE[0]}x{SIZE[1]}")
    with Program(scene, *size, "--token", "again") as first:
        page = browser.open(first.address, before=WATCH)
        at(page, 6.0)
        page.hold("KeyD", seconds=0.3)
        was = settled(page)
        first.kill()
        page.wait_for("document.body.innerText.includes('does not answer')", seconds=60.0)
    with Program(scene, *size, "--token", "again", port=first.port) as second:
        page.wait_for("document.body.dataset.line === 'open'", seconds=60.0)
        page.wait_for("viewer.frame.seq < 20 && viewer.frame.time === 6", seconds=60.0)
        now = settled(page)
        np.testing.assert_allclose(now.position, was.position, atol=2e-3)
        assert now.heading == pytest.approx(was.heading, abs=2e-3)
        assert "does not answer" not in page.evaluate("document.body.innerText")
        assert second.stop() == 0
        assert "Traceback" not in second.said
        page.wait_for("document.body.innerText.includes('was stopped')", seconds=60.0)
    with Program(scene, *size, "--token", "other", port=first.port):
        page.wait_for("document.body.innerText.includes('address has changed')", seconds=60.0)
    page.close()


# Everyone ----------------------------------------------------------------------------------


def test_everything_that_can_be_used_has_a_name(page) -> None:
    unnamed, count = [], 0
    for panel in (None, "place", "light", "path", "stills"):
        if panel:
            page.click(f"[data-panel={panel}]")
        for node in page.send("Accessibility.getFullAXTree")["nodes"]:
            role = node.get("role", {}).get("value")
            focusable = {
                "name": "focusable",
                "value": {"type": "booleanOrUndefined", "value": True},
            }
            if node["ignored"] or focusable not in node.get("properties", []):
                continue
            if role in ("RootWebArea", "genericContainer"):
                continue
            count += 1
            if not node.get("name", {}).get("value", "").strip():
                unnamed.append((panel, role, node.get("backendDOMNodeId")))
    assert count > 40 and not unnamed


def test_tab_goes_through_the_page_and_leaves_the_picture(page) -> None:
    before = eye(page)
    page.focus("#picture")
    visited = []
    for _ in range(60):
        page.press("Tab")
        visited.append(
            page.evaluate(
                "(e => e.id || e.dataset.panel || e.dataset.code || e.tagName)"
                "(document.activeElement)"
            )
        )
        if visited[-1] == "picture":
            break
    assert visited[0] != "picture" and visited[-1] == "picture", visited
    for name in ("time", "play", "clock", "camera", "traffic", "place", "light", "help-open"):
        assert name in visited, visited
    page.press("Tab", shift=True)
    assert page.evaluate("document.activeElement.id") != "picture"
    np.testing.assert_array_equal(settled(page).position, before.position)


def test_focus_is_visible_wherever_it_is(page) -> None:
    page.focus("#picture")
    for _ in range(25):
        page.press("Tab")
        shown = page.evaluate(
            "(e => { const s = getComputedStyle(e); return e === document.body"
            " || s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 2; })"
            "(document.activeElement)"
        )
        assert shown, page.evaluate("document.activeElement.outerHTML.slice(0, 200)")


@pytest.mark.parametrize(
    ("width", "height", "zoom"), [(1000, 760, 1.0), (1280, 800, 2.0), (640, 900, 2.0)]
)
def test_no_control_is_lost_when_space_is_short(page, width, height, zoom) -> None:
    page.resize(width, height, zoom=zoom)
    lost = []
    for panel in ("place", "light", "path", "stills"):
        page.click(f"[data-panel={panel}]")
        assert page.evaluate(
            "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        ), f"the page is too wide with {panel}"
        lost += page.evaluate(
            f"[...document.querySelectorAll({json.dumps(CONTROLS)})].filter(e => {{"
            " if (!e.checkVisibility() || e.disabled || e.matches('.skip')) return false;"
            " e.scrollIntoView({block: 'center', behavior: 'instant'});"
            " const b = e.getBoundingClientRect();"
            " if (b.left < -1 || b.right > innerWidth + 1 || b.width < 8 || b.height < 8)"
            "   return true;"
            " const top = document.elementFromPoint(b.left + b.width / 2, b.top + b.height / 2);"
            " return !(top && (e.contains(top) || e.matches('canvas')));"
            "}).map(e => e.outerHTML.slice(0, 80))"
        )
    assert not lost


def test_text_stands_out_from_its_ground(page) -> None:
    page.click("[data-panel=path]")
    weak = page.evaluate(CONTRAST)
    assert not weak


CONTRAST = """
(() => {
  const parse = text => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => [r, g, b].map(v => v / 255)
    .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const ground = element => {
    for (let e = element; e; e = e.parentElement) {
      const colour = parse(getComputedStyle(e).backgroundColor);
      if (colour.length === 3 || colour[3] === 1) return colour;
      if (colour[3] > 0) return null;  // see-through: depends on the picture behind
    }
    return [0, 0, 0];
  };
  const weak = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || !element.checkVisibility()) continue;
    if (element.closest('[disabled], .unseen, option')) continue;
    const below = ground(element), ink = parse(getComputedStyle(element).color);
    if (!below) continue;
    const [dark, bright] = [light(below), light(ink)].sort((a, b) => a - b);
    const ratio = (bright + 0.05) / (dark + 0.05);
    if (ratio < 4.5) weak.push([walker.currentNode.data.trim(), ratio]);
  }
  return weak;
})()
"""
"""Texts whose contrast is below 4.5 (Web Content Accessibility Guidelines 2.2, 1.4.3)."""
