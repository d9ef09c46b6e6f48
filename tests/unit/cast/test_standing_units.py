"""Units of a vehicle that stands move and turn no more than a single body does."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from any_traffic import LANES, STEPS, network, traffic
from drives import TYPES, log_of

from sumo3dviz_pt.cast.articulation import joined, unit_frames
from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.motion.resting import resting
from sumo3dviz_pt.motion.splitting import split

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
