"""Small pictures that must go on to look as they do; shared by the test and `refresh.py`."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import reduce
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, Protocol

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from builders import write_scenario
from significance import sidak_t

from sumo3dviz_pt.image.tonemap import develop
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.pipeline.live import Ground, Live, joined
from sumo3dviz_pt.pipeline.production import Request, example, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.viewer.client import Mean

DATA = Path(__file__).parent / "data"

SIZE = (192, 108)
"""Width and height of every picture [px]."""

BLOCK, WINDOW = 2, 2
"""Pixels along a side of a stored block, and blocks along a side of a compared window."""

SAMPLES = 16
"""Per pixel of one run."""

SEEDS = range(1000, 1012)
"""Of the runs that a stored picture is the mean of; a test takes one run of another seed."""

SLACK = 0.01
"""Differences below this are let go [share of white]: other processors round otherwise."""


class Stored(NamedTuple):
    """A stored picture by its blocks of 2 x 2 pixels, developed, in [0, 1].

    Attributes:
        mean: Of each block over all runs, (54, 96, 3).
        variance: Of each block from run to run, (54, 96, 3).
        runs: How many there were.
    """

    mean: np.ndarray
    variance: np.ndarray
    runs: int


class Take(Protocol):
    """Renders one run of a seed, developed, (108, 192, 3) in [0, 1]."""

    def __call__(self, seed: int, *, without: str | None = None) -> np.ndarray:
        """Leave one road user out, if asked to."""


@dataclass(frozen=True)
class Picture:
    """What a stored picture shows.

    Attributes:
        scene: An example's name.
        camera: One of its cameras, or `own`.
        time: SUMO's time [s].
        changes: Overrides of the scene file.
        small: A road user who covers some 20 pixels: without him it is another picture.
    """

    scene: str
    camera: str
    time: float
    changes: Mapping[str, Any] = field(default_factory=dict)
    small: str | None = None

    @contextmanager
    def taken(self) -> Iterator[Take]:
        """Open the scene. Its own seed stays, because colours and trees come from it."""
        job = load_job(example(self.scene), self.changes)
        request = Request(camera=self.camera, quality="draft", size=SIZE, spp=SAMPLES)
        production = prepare(job, request, np.array([self.time]))
        raw = {"denoise": "none", "pass_spp": SAMPLES}
        quality = production.quality.model_copy(update=raw)
        output = production.job.output
        with opened(replace(production, quality=quality)) as session:
            whole = production.shot.frame_at(self.time)

            def take(seed: int, *, without: str | None = None) -> np.ndarray:
                session.retune(quality, seed=seed)
                radiance = session.render(_without(whole, without)).radiance
                look = {"tone": output.tone, "glare": output.glare}
                return develop(radiance, exposure=production.exposure, **look) / 255.0

            yield take


@dataclass(frozen=True)
class ViewerPicture:
    """What the viewer shows of a small street when nobody moves: parts of one sample each.

    Attributes:
        small: As in `Picture`.
    """

    small: str | None = None

    @contextmanager
    def taken(self) -> Iterator[Take]:
        """Open a street that is written for this."""
        with TemporaryDirectory() as folder:
            scene = write_scenario(folder, vehicles=8, persons=4, signals=True)
            size = {"output.size": f"[{SIZE[0]}, {SIZE[1]}]", "template": "city_day"}
            job = load_job(scene, size)
            live = Live(job, Ground.of(job), size=(SIZE[0] // 2, SIZE[1] // 2), variant="llvm")
            time, view = live.ground.begin + 3.0, live.home

            def take(seed: int, *, without: str | None = None) -> np.ndarray:
                live._renderer.show(_without(live.shot.frame_of(time, view), without))
                numbers = range(seed * SAMPLES, (seed + 1) * SAMPLES)
                samples = [
                    joined([live.glimpse(time, view, number=n, part=(k, 2)) for k in range(4)])
                    for n in numbers
                ]
                mean = reduce(Mean.with_sample, samples[1:], Mean.of(samples[0]))
                return live.develop(mean.value, view) / 255.0

            try:
                yield take
            finally:
                live.close()


def _without(frame: FrameState, user: str | None) -> FrameState:
    """A frame in which one road user is missing."""
    if user is None:
        return frame
    kinds = {"movers": frame.movers, "far": frame.far, "deforming": frame.deforming}
    left = {name: tuple(m for m in some if m.id != user) for name, some in kinds.items()}
    assert user in frame.users, sorted(frame.users)
    return replace(frame, **left)


def eulerian(
    position: Sequence[float], look_at: Sequence[float], *, fov: float
) -> Mapping[str, Any]:
    """Overrides that set a camera `own` up, beside the example's."""
    camera = {"mode": "eulerian", "position": list(position), "look_at": list(look_at)}
    return {"cameras.own": {**camera, "lens": {"fov": fov}}}


PICTURES: Mapping[str, Picture | ViewerPicture] = {
    "crossing_corner": Picture("crossing", "corner", 456.0, small="person:walk_E_in_far_S_in.3"),
    "crossing_front": Picture(
        "crossing", "own", 456.0, eulerian((327.0, 300.0, 2.5), (345.0, 325.0, 7.0), fov=75.0)
    ),
    "crossing_people": Picture(
        "crossing", "own", 456.0, eulerian((285.2, 304.2, 1.6), (281.3, 308.3, 1.0), fov=50.0)
    ),
    "crossing_dusk": Picture("crossing", "corner", 440.0, {"template": "city_dusk"}),
    "crossing_night": Picture("crossing", "corner", 440.0, {"template": "city_night"}),
    "crossing_snow": Picture("crossing", "corner", 456.0, {"weather.preset": "snow"}),
    "crossing_downpour": Picture(
        "crossing", "corner", 440.0, {"template": "city_night", "weather.preset": "downpour"}
    ),
    "crossing_abstract": Picture("crossing", "corner", 456.0, {"template": "abstract"}),
    "ronda_driver": Picture("ronda", "driver", 460.0),
    "ronda_fog": Picture("ronda", "driver", 460.0, {"weather.preset": "fog"}),
    "viewer": ViewerPicture(small="person:p2"),
}
"""All stored pictures by name; those of one world follow each other, so that it is built once."""


def stored_of(runs: Sequence[np.ndarray]) -> Stored:
    """What is stored of several runs of a picture."""
    each = np.array([blocks_of(run) for run in runs])
    return Stored(each.mean(axis=0), each.var(axis=0, ddof=1), len(each))


def blocks_of(picture: np.ndarray) -> np.ndarray:
    """Means of 2 x 2 pixels."""
    height, width = (side // BLOCK for side in picture.shape[:2])
    return picture.reshape(height, BLOCK, width, BLOCK, 3).mean(axis=(1, 3))


def _windows(blocks: np.ndarray) -> np.ndarray:
    """Means of 4 x 4 pixels around every corner of blocks: they overlap by half."""
    both = np.lib.stride_tricks.sliding_window_view(blocks, (WINDOW, WINDOW), axis=(0, 1))
    return both.mean(axis=(-2, -1))


def differs(take: Take, old: Stored, *, without: str | None = None) -> np.ndarray:
    """Which windows of a scene differ from its stored picture beyond chance, (53, 95).

    One sample of very bright light can lift a window of one run, so what exceeds the limit
    has to do so in a run of another seed, too.

    Args:
        take: Renders the scene.
        old: The stored picture.
        without: A road user to leave out.
    """
    found = excess(take(0, without=without), old) > 0.0
    if found.any():
        found &= excess(take(1, without=without), old) > 0.0
    return found.any(axis=2)


def excess(picture: np.ndarray, old: Stored) -> np.ndarray:
    """By how much each window of a run differs beyond noise and slack, (53, 95, 3).

    An object of 5 x 4 pixels fills three quarters of some window, wherever it stands. The
    limit holds for all windows and colours together, so that a single window above 0 makes
    another picture. Pixels are independent: the mean of a window's four blocks varies a
    quarter as much as they do.
    """
    variance = _windows(old.variance) / WINDOW**2 * (1.0 + 1.0 / old.runs)
    apart = np.abs(_windows(blocks_of(picture)) - _windows(old.mean))
    limit = sidak_t(apart.size, freedom=WINDOW**2 * (old.runs - 1))
    return apart - limit * np.sqrt(variance) - SLACK


def write(name: str, picture: Stored) -> Path:
    """Store a picture in half precision."""
    DATA.mkdir(exist_ok=True)
    path = DATA / f"{name}.npz"
    deviation = np.sqrt(picture.variance).astype(np.float16)
    np.savez_compressed(
        path, mean=picture.mean.astype(np.float16), deviation=deviation, runs=picture.runs
    )
    return path


def stored(name: str) -> Stored:
    """A picture as it was stored."""
    with np.load(DATA / f"{name}.npz") as found:
        mean, deviation = (found[key].astype(np.float64) for key in ("mean", "deviation"))
        return Stored(mean, deviation**2, int(found["runs"]))
