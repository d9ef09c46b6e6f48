"""Units of a vehicle stand, head and turn as a single body does: a jam bends no lorry."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from any_traffic import LANES, STEPS, network, traffic
from drives import TYPES, WAYS, Way, between, drive, log_of, shown

from sumo3dviz_pt.cast.axles import joined, unit_frames
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.motion.manoeuvres import resting, sharpest
from sumo3dviz_pt.motion.samples import split
from sumo3dviz_pt.motion.setting import is_railed

LINKS = {
    "articulated bus": joined([0.0, 7.0], [6.67, 5.0], [(1.73, 6.8), (0.0, 3.3)], hinged=False),
    "lorry": joined([0.0, 2.33], [3.67, 8.33], [(0.87, 3.07), (0.67, 6.0)], hinged=False),
    "tram": joined([0.0, 4.0, 8.0], [4.0, 4.0, 4.0], [(1.0, 3.0)] * 3, hinged=True),
}


def rests(samples):
    """First and last time of each rest, from its second step on."""
    still = resting(samples)
    still[1:] &= still[:-1].copy()
    edges = np.flatnonzero(np.diff(np.r_[False, still, False]))
    return [(samples.times[a], samples.times[b]) for a, b in edges.reshape(-1, 2)]


@cache
def standing():
    """Motion of vehicles, and times of their rests."""
    found = []
    for seed, step in enumerate(STEPS):
        trace = replace(traffic(seed, step=step, sublane=seed % 2 > 0), type_id="bus")
        log = log_of(trace, names=LANES, step=step)
        (drawn,) = smooth_log(log, smoother="lane", network=network(), types=TYPES)
        own = [(r.begin, r.end) for r in drawn.remarks if r.kind in ("parking", "reversing")]
        for samples, piece in zip(split(trace, step=step), drawn.pieces, strict=True):
            spans = rests(samples) if len(samples.times) > 1 else []
            free = [s for s in spans if not any(a <= s[1] and s[0] <= b for a, b in own)]
            found += [(piece, *span) for span in free]
    return found


@pytest.mark.parametrize("name", LINKS)
def test_trailers_of_who_stands_stand(name):
    assert len(standing()) > 10
    for piece, begin, end in standing():
        frames = unit_frames(piece, np.linspace(begin, end, 9), LINKS[name])
        assert np.abs(frames[:, :, :3, 3] - frames[0, :, :3, 3]).max() <= 1e-3
        assert np.abs(frames[:, :, :3, 0] - frames[0, :, :3, 0]).max() <= np.radians(0.1)


TURNS = (0.0, 0.4, 2.0)
EACH = pytest.mark.parametrize("smoother", ["lane", "hermite", "linear"])
ROAD = ("articulated bus", "lorry")
WORST = (29, 140, 287)
"""A jump aside in a tenth of a second bends the path beside it, too."""


def jammed(smoother, kind="bus"):
    """Motion of vehicles on straight roads, times of their driving, and the roads' directions."""
    for seed in (*range(14), *WORST):
        step, turn = STEPS[seed % len(STEPS)], TURNS[seed % len(TURNS)]
        trace = traffic(seed, step=step, sublane=seed % 2 > 0, turn=turn)
        log = log_of(replace(trace, type_id=kind), names=LANES, step=step)
        (drawn,) = smooth_log(log, smoother=smoother, network=network(turn), types=TYPES)
        own = [(r.begin, r.end) for r in drawn.remarks if r.kind in ("parking", "reversing")]
        for piece in (piece for piece in drawn.pieces if piece.end > piece.begin):
            times = np.arange(piece.begin, piece.end, 0.2)
            free = [not any(a - 0.3 <= t <= b + 0.3 for a, b in own) for t in times.tolist()]
            yield piece, times[np.array(free, dtype=bool)], turn


@EACH
def test_units_head_as_logged_wherever_the_log_is_straight(smoother):
    looked = 0
    for piece, times, turn in jammed(smoother):
        way = np.hypot(*np.diff(piece.sample(times).positions[:, :2], axis=0).T)
        for name in ROAD:
            frames = unit_frames(piece, times, LINKS[name])
            yaws = np.arctan2(frames[:, :, 1, 0], frames[:, :, 0, 0])
            assert between(yaws, turn).max(initial=0.0) <= np.radians(20.0), name
            # And they turn only as their front drives; where manoeuvres lie between, nobody asks.
            near = np.diff(times) < 0.21
            for unit, base in enumerate(np.diff(LINKS[name].pivots).ravel().tolist()):
                turned = between(yaws[1:, unit], yaws[:-1, unit])
                assert (turned <= sharpest(base) * way + np.radians(2.0))[near].all(), name
            looked += len(times)
    assert looked > 5000


@EACH
@pytest.mark.parametrize("name", ["corner", "roundabout", "dead end"])
@pytest.mark.parametrize("pace", [0.5, 7.0])
def test_in_bends_units_follow_the_path_as_driven(smoother, name, pace):
    make, lanes = WAYS[name]
    road = make()
    times = np.arange(0.0, 120.0 / pace)
    trace = drive(Way.of(road, lanes), times, lambda t: 40.0 + pace * t, length=12.0)
    (piece,) = shown(replace(trace, type_id="bus"), smoother, road, lanes).pieces
    driven = replace(piece, legs=tuple(replace(leg, units=None) for leg in piece.legs))
    asked, behind = np.linspace(piece.begin, piece.end, 400), np.arange(0.0, 14.0)
    away = piece.trail(asked, behind) - driven.trail(asked, behind)
    assert np.linalg.norm(away, axis=2).max() < 0.05


def test_wheels_stay_on_rails():
    legs = [leg for piece, _, _ in jammed("lane", "train") for leg in piece.legs]
    assert legs and all(leg.units is None for leg in legs)


@pytest.mark.parametrize(
    ("vclass", "shape", "railed"),
    [
        ("bus", "", False),
        ("trailer", "truck/semitrailer", False),
        ("rail_urban", "", True),
        ("custom1", "rail/light", True),
    ],
)
def test_what_runs_on_rails(vclass, shape, railed):
    kind = VehicleType("t", vclass, 30.0, 2.5, 3.5, gui_shape=shape)
    assert is_railed(kind) == railed
