"""How fast the viewer is, measured in a real browser, and whether its memory stays flat.

Run from the repository's root, on a quiet machine:

    python tests/bench/viewer.py --minutes 10 -o docs/_bench/viewer.md

`sumo3dviz-pt view` runs as users start it, on the bundled motorway seen from above; headless
Chromium shows its page on the same machine and takes its share of the processor. Counted are
pictures that the page has shown. A key's latency is the time from the browser's own time
stamp of the key to the first animation frame at which a picture is on display that was
rendered with that key.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

if Path(sys.path[0]).resolve() == Path(__file__).resolve().parent:
    sys.path.pop(0)  # in this folder, `viewer` is this file
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from viewer.browser import Browser, Page
from viewer.program import Program

from sumo3dviz_pt.pipeline.production import example, read
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.report.machine import machine
from sumo3dviz_pt.shot.cameras.aiming import aim_of

MOTORWAY = example("ronda")


@dataclass(frozen=True)
class Watched:
    """What is shown.

    Attributes:
        scene: The scene file.
        camera: Its name.
        time: SUMO's [s].
    """

    scene: Path = MOTORWAY
    camera: str = "overview"
    time: float = 490.0


STRIDE = 1.0
"""Of strafing to and fro [s]; the road stays in the picture."""

SPIES = """
window.spies = {keys: [], latencies: [], shown: []};
{
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (text) {
    const order = JSON.parse(text);
    if (order.do === 'keys') spies.order = order.id;
    return send.call(this, text);
  };
  addEventListener('keydown', event => {
    if (event.repeat) return;
    const before = spies.order, start = event.timeStamp;
    setTimeout(() => { if (spies.order !== before) spies.keys.push([spies.order, start]); });
  }, true);
  let last = -1;
  const look = now => {
    const frame = window.viewer && viewer.frame;
    if (frame && frame.seq !== last) {
      last = frame.seq;
      spies.shown.push([now, frame.spp, frame.size[0], frame.size[1], frame.ms]);
      while (spies.keys.length && frame.id >= spies.keys[0][0])
        spies.latencies.push(performance.now() - spies.keys.shift()[1]);
    }
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}
"""
"""Watches the page from outside: orders as they go out, pictures as they are on display."""


def in_picture(used: Watched, size: tuple[int, int]) -> int:
    """Road users whose front lies inside the picture."""
    job = load_job(used.scene)
    camera = job.cameras[used.camera]
    _, _, trajectories = read(job, begin=used.time, end=used.time)
    points = [
        piece.sample(np.array([used.time])).positions[0]
        for trajectory in trajectories
        for piece in trajectory.pieces
        if piece.begin <= used.time <= piece.end
    ]
    place = np.asarray(camera.position, dtype=float)
    ahead, left, up = ((np.array(points) - place) @ aim_of(camera).placed(place).matrix[:3, :3]).T
    half = np.tan(np.radians(camera.lens.fov) / 2.0)
    across, along = np.abs(left) < half * ahead, np.abs(up) < half * size[1] / size[0] * ahead
    return int(np.sum((ahead > 0.0) & across & along))


def home(page: Page, used: Watched) -> None:
    """Stand at the scene's camera at the chosen time, traffic at rest, and see well."""
    page.focus("#picture")
    page.press(f"Digit{list(load_job(used.scene).cameras).index(used.camera) + 1}")
    page.choose("#time", used.time)
    page.focus("#picture")
    page.wait_for(f"Math.abs(viewer.frame.time - {used.time}) < 0.51 && viewer.frame.spp > 4")


def pictures(page: Page, since: float) -> np.ndarray:
    """When pictures came on display, their samples, size and cost: (n, 5) [ms, spp, px, px, ms]."""
    shown = np.array(page.evaluate("spies.shown"), dtype=float).reshape(-1, 5)
    return shown[shown[:, 0] >= since]


def moving(page: Page, used: Watched, *, seconds: float) -> dict[str, float]:
    """Strafe to and fro without a pause."""
    home(page, used)
    page.hold("KeyD", seconds=STRIDE / 2.0)
    since, end = page.evaluate("performance.now()"), time.monotonic() + seconds
    for key in itertools.cycle(("KeyA", "KeyD")):
        page.hold(key, seconds=STRIDE)
        if time.monotonic() > end:
            break
    return rates(pictures(page, since))


def rates(shown: np.ndarray) -> dict[str, float]:
    """Frequency and regularity of pictures; width of most of them."""
    gaps = np.diff(shown[:, 0])
    return {
        "fps": 1000.0 / float(gaps.mean()),
        "gap_p90": float(np.quantile(gaps, 0.9)),
        "width": float(np.median(shown[:, 2])),
        "spp_last": float(shown[-1, 1]),
        "pass_ms": float(np.median(shown[:, 4])),
    }


def still(page: Page, used: Watched, *, seconds: float) -> dict[str, float]:
    """Touch the camera once, then leave it alone."""
    home(page, used)
    page.hold("KeyD", seconds=0.2)
    since = page.evaluate("performance.now()")
    time.sleep(seconds)
    return rates(pictures(page, since))


def playing(page: Page, used: Watched, *, seconds: float) -> dict[str, float]:
    """Let the traffic run."""
    home(page, used)
    page.press("Space")
    page.wait_for("viewer.frame.playing")
    since = page.evaluate("performance.now()")
    time.sleep(seconds)
    page.press("Space")
    return rates(pictures(page, since))


def latencies(page: Page, used: Watched, *, count: int) -> np.ndarray:
    """From a key to its picture, (n,) [ms]; half of them begin from a picture at rest."""
    home(page, used)
    page.evaluate("spies.keys.length = spies.latencies.length = 0")
    pauses = np.random.default_rng(6).uniform(0.25, 1.6, count)
    for number, pause in enumerate(pauses):
        time.sleep(float(pause))
        page.hold(("KeyA", "KeyD")[number % 2], seconds=0.15)
    time.sleep(1.0)
    measured = np.array(page.evaluate("spies.latencies"), dtype=float)
    assert len(measured) >= 0.9 * count, f"{len(measured)} of {count} keys had a picture"
    return measured


def memory(page: Page, program: Program, used: Watched, *, seconds: float) -> np.ndarray:
    """Resident memory once a second in a mixed use, (n, 2) [s, MiB]."""
    readings = []
    start = time.monotonic()
    acts = activities(page, used)
    while (now := time.monotonic() - start) < seconds:
        readings.append((now, program.memory))
        next(acts)
        page.evaluate("spies.shown.length = 0")
        time.sleep(max(0.0, 1.0 - (time.monotonic() - start - now)))
    return np.array(readings)


def activities(page: Page, used: Watched) -> Iterator[None]:
    """Strafe, rest and play in turns, a second each step."""
    while True:
        for key in ("KeyD", "KeyA") * 5:
            page.hold(key, seconds=0.8)
            yield
        yield from itertools.repeat(None, 10)
        page.press("Space")
        yield from itertools.repeat(None, 9)
        page.press("Space")
        home(page, used)
        yield


def slope(readings: np.ndarray) -> float:
    """Growth over the second half [MiB/min]."""
    half = readings[len(readings) // 2 :]
    return float(np.polyfit(half[:, 0] / 60.0, half[:, 1], 1)[0])


def table(rows: list[tuple[str, str]]) -> list[str]:
    """A Markdown table of names and values."""
    return ["| | |", "|---|--:|", *(f"| {name} | {value} |" for name, value in rows)]


def described(what: str, seen: dict[str, float]) -> list[tuple[str, str]]:
    """Rows about one kind of use."""
    return [
        (f"pictures a second, {what}", f"{seen['fps']:.1f}"),
        (f"gap between pictures, {what}, 90 % below", f"{seen['gap_p90']:.0f} ms"),
        (f"width while {what}", f"{seen['width']:.0f} px"),
    ]


def measure(options: argparse.Namespace, used: Watched) -> list[tuple[str, str]]:
    """All figures."""
    width, height = options.size
    before = os.getloadavg()[1]
    more = [] if options.begin is None else ["--from", str(options.begin), "--to", str(options.end)]
    began = time.monotonic()
    with Program(used.scene, "--size", f"{width}x{height}", *more) as program, Browser() as web:
        page = web.open(program.address, before=SPIES)
        page.wait_for("!!window.viewer && !!viewer.frame", seconds=600.0)
        waited = time.monotonic() - began
        rows: list[tuple[str, str]] = [
            ("scene, camera, time", f"`{named(used.scene)}`, `{used.camera}`, {used.time:g} s"),
            ("road users in the picture", str(in_picture(used, options.size))),
            ("size", f"{width}x{height}"),
            ("from the command to the first picture", f"{waited:.0f} s"),
        ]
        rows += described("moving", moving(page, used, seconds=options.seconds))
        at_rest = still(page, used, seconds=options.seconds)
        rows += described("still", at_rest)
        rows.append((f"samples a pixel after {options.seconds:g} s", f"{at_rest['spp_last']:.0f}"))
        rows += described("playing", playing(page, used, seconds=options.seconds))
        waits = latencies(page, used, count=options.keys)
        for name, value in (("median", np.median(waits)), ("90 % below", np.quantile(waits, 0.9))):
            rows.append((f"key to picture, {len(waits)} keys, {name}", f"{value:.0f} ms"))
        if options.minutes:
            rows += kept(memory(page, program, used, seconds=60.0 * options.minutes))
        errors = page.errors
    assert not errors, errors
    system: dict[str, Any] = machine()
    rows.append(("machine", f"{system['cpu']}, {system['threads']} threads"))
    rows.append(("load before the start, mean of 5 minutes", f"{before:.1f} processes"))
    return rows


def kept(readings: np.ndarray) -> list[tuple[str, str]]:
    """Rows about the server's memory."""
    minutes = readings[-1, 0] / 60.0
    first, last = (
        readings[readings[:, 0] < 60.0, 1],
        readings[readings[:, 0] > 60 * minutes - 60, 1],
    )
    return [
        ("memory of the server, median of the first minute", f"{np.median(first):.0f} MB"),
        (f"median of the last of {minutes:.0f} minutes", f"{np.median(last):.0f} MB"),
        ("growth over the second half", f"{slope(readings):+.2f} MB/min"),
    ]


def size_of(text: str) -> tuple[int, int]:
    """Width and height of `WxH`."""
    width, height = text.split("x")
    return int(width), int(height)


def named(scene: Path) -> str:
    """Name of a scene: its file's, or its folder's if that says nothing."""
    return scene.stem if scene.stem != "scene" else scene.parent.name


def main() -> None:
    """Measure, print, write."""
    options = options_of(sys.argv[1:])
    lines = table(measure(options, Watched()))
    print("\n".join(lines))
    if options.output:
        options.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


def options_of(words: list[str]) -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=size_of, default=(480, 270), help="WxH [480x270]")
    parser.add_argument("--from", dest="begin", type=float, help="first time [s]")
    parser.add_argument("--to", dest="end", type=float, help="last time [s]")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each kind of use [20]")
    parser.add_argument("--keys", type=int, default=60, help="keys to wait for [60]")
    parser.add_argument("--minutes", type=float, default=0.0, help="to watch memory [0]")
    parser.add_argument("-o", "--output", type=Path, help="write the table here")
    return parser.parse_args(words)


if __name__ == "__main__":
    main()
