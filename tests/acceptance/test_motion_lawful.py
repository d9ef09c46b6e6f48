"""The laws of drawn motion: every smoother but the paper's, over the shared scenarios and cases.

Of the large ones every n-th road user is looked at.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.motion import smooth_log, smoother_names
from sumo3dviz_pt.motion.laws import breaches
from sumo3dviz_pt.motion.setting import body_length
from sumo3dviz_pt.motion.smoothers.registry import SMOOTHERS
from sumo3dviz_pt.sumo import find_scenario, read_scenario

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
EVERY = {  # every n-th road user
    "bologna_acosta": 4,
    "doerpfeldstr": 2,
    "badhersfeld": 2,
    "barcelona": 4,
    "monaco_west_hills": 2,
    "cases/spin": 1,
    "cases/sublane_jitter": 1,
    "cases/blue": 1,
    "cases/traci2": 1,
    "cases/waterway": 1,
    "cases/at_grade": 1,
}
BUNDLED = ("crossing", "ronda")
absent = pytest.mark.skipif(not DATA.is_dir(), reason="the shared scenarios are not here")
NAMES = [
    "crossing",
    pytest.param("ronda", marks=pytest.mark.slow),
    *(pytest.param(name, marks=[absent, pytest.mark.slow]) for name in EVERY),
]
KEEPING = tuple(name for name in smoother_names() if not SMOOTHERS[name].raw)


@cache
def scenario(name):
    place = ROOT / "examples" / name if name in BUNDLED else DATA / name
    return read_scenario(find_scenario(place))


@pytest.mark.parametrize("smoother", KEEPING)
@pytest.mark.parametrize("name", NAMES)
def test_nobody_is_drawn_otherwise_than_it_drives(name, smoother):
    read = scenario(name)
    log = replace(read.traffic, traces=read.traffic.traces[:: EVERY.get(name, 8)])
    types = read.vehicle_types
    shown = smooth_log(log, smoother=smoother, network=read.network, types=types)
    blur = SMOOTHERS[smoother].blur
    found = [
        breach
        for trace, drawn in zip(log.traces, shown, strict=True)
        for breach in breaches(
            trace, drawn, step=log.step, length=body_length(trace, types), blur=blur
        )
    ]
    assert found == []


@pytest.mark.parametrize("name", ["crossing", pytest.param("ronda", marks=pytest.mark.slow)])
def test_a_span_shows_no_breach_that_the_whole_log_does_not(name):
    """Why a body stands askew may lie before a film begins."""
    read = scenario(name)
    log, types = read.traffic, read.vehicle_types
    shown = smooth_log(log, smoother="lane", network=read.network, types=types)
    found = []
    for trace, drawn in zip(log.traces, shown, strict=True):
        said = {"step": log.step, "length": body_length(trace, types)}
        for begin in np.linspace(trace.times[0], trace.times[-1], 6)[1:-1]:
            found += breaches(trace, drawn, **said, span=(float(begin), float(begin) + 4.0))
    assert found == []
