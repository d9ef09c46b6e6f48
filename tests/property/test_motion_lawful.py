"""Bodies head as logged, turn only as they drive, stand still, and hang on no window."""

from dataclasses import replace

import numpy as np
import pytest
from any_traffic import LANES, STEPS, network, traffic
from drives import LENGTH, TYPES, log_of, trace_of
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.motion.laws import HEADING, LEAPING, MOVING, SWINGING, TURNING, breaches
from sumo3dviz_pt.motion.smoothers.registry import SMOOTHERS

KEEPING = ("hermite", "lane", "linear", "paper_symmetric")
"""All smoothers but `paper`, whose rule is the paper's own."""

LAWS = settings(
    max_examples=tries(12), deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)  # fmt: skip
LENGTHS = {"car": LENGTH, "bus": 12.0}


def broken(trace, smoother, *, net=None, names=LANES, step=None):
    """The laws that the motion of one trace breaks."""
    log = log_of(trace, names=names, step=step)
    (found,) = smooth_log(log, smoother=smoother, network=net or network(), types=TYPES)
    length, blur = LENGTHS[trace.type_id], SMOOTHERS[smoother].blur
    return list(breaches(trace, found, step=log.step, length=length, blur=blur))


def red_light():
    """A car stops hard in front of a red light within one step, stands, and sets off."""
    speeds = np.r_[[14.32] * 5, 12.12, 7.62, 3.57, np.zeros(26), 1.87, 3.74, 5.61, [7.48] * 9]
    along = 20.0 + np.cumsum(speeds)
    return trace_of(
        np.arange(len(along)) + 0.0, np.column_stack([along, 0 * along]), 0.0, speeds,
        lanes=0, offsets=along,
    )  # fmt: skip


def wiggling():
    """A bus of the sublane model: it stands, and its logged place goes to and fro."""
    times = np.arange(0.0, 80.0, 0.5)
    along = np.interp(times, [0.0, 8.0, 70.0, 80.0], [10.0, 90.0, 90.0, 140.0])
    stands = (times > 8.0) & (times < 70.0)
    aside = np.where(stands, np.array([0.15, -0.15, 0.0])[np.arange(len(times)) % 3], 0.0)
    speeds = np.r_[10.0, np.diff(along) / 0.5]
    return trace_of(
        times, np.column_stack([along, aside]), np.radians(-5.0 * aside), speeds,
        lanes=0, offsets=along, type_id="bus",
    )  # fmt: skip


def late_changer():
    """A car changes lanes in one step, just before it stops for half a minute."""
    speeds = np.r_[[7.0] * 6, 3.0, 1.5, np.zeros(30), 2.0, 4.0, [6.0] * 6]
    along = 20.0 + np.cumsum(speeds)
    lanes = (np.arange(len(along)) >= 7).astype(int)
    return trace_of(
        np.arange(len(along)) + 0.0, np.column_stack([along, 3.2 * lanes]), 0.0, speeds,
        lanes=lanes, offsets=along,
    )  # fmt: skip


def slider(step=0.04):
    """A car of the sublane model: it slides to the next lane while it hardly drives."""
    times = np.arange(0.0, 12.0, step)
    speeds = np.maximum(6.0 - 1.2 * times, 0.4)
    along = 20.0 + np.cumsum(speeds * step)
    aside = np.clip(times - 4.0, 0.0, 3.2)
    return trace_of(
        times, np.column_stack([along, aside]), 0.0, speeds,
        lanes=(aside > 1.6).astype(int), offsets=along,
    )  # fmt: skip


@pytest.mark.parametrize("smoother", KEEPING)
@pytest.mark.parametrize("made", [red_light, wiggling, late_changer, slider])
def test_known_faults_are_mended(made, smoother):
    assert broken(made(), smoother) == []


@pytest.mark.slow
@pytest.mark.parametrize("smoother", KEEPING)
@LAWS
@given(
    st.integers(0, 10**6), st.sampled_from(STEPS), st.booleans(), st.booleans(),
    st.floats(-3.1, 3.1), st.sampled_from(sorted(LENGTHS)),
)  # fmt: skip
def test_every_log_is_drawn_as_it_drives(smoother, seed, step, euler, sublane, turn, kind):
    trace = traffic(seed, step=step, euler=euler, turn=turn, sublane=sublane)
    trace = replace(trace, type_id=kind)
    assert broken(trace, smoother, net=network(turn), step=step) == []


def test_the_laws_see_a_spin_a_slide_and_a_swing():
    trace = late_changer()
    log = log_of(trace, names=LANES)
    (found,) = smooth_log(log, smoother="linear", types=TYPES)

    class Spun:
        """The same motion, but its body turns once while it stands."""

        def __init__(self, piece):
            self.begin, self.end, self.piece = piece.begin, piece.end, piece

        def sample(self, times):
            motion, share = self.piece.sample(times), np.clip((times - 20.0) / 4.0, 0.0, 1.0)
            places = motion.positions + 0.5 * share[:, None]
            return replace(motion, yaws=motion.yaws + 3.0 * share, positions=places)

    wrong = replace(found, pieces=tuple(Spun(piece) for piece in found.pieces))
    laws = {each.law: each for each in breaches(trace, wrong, step=1.0, length=LENGTH)}
    assert set(laws) == {HEADING, TURNING, MOVING, SWINGING}

    class Leapt(Spun):
        """The same motion, but from a time on a lane's width aside."""

        def sample(self, times):
            motion = self.piece.sample(times)
            away = np.where(times[:, None] > 20.0, [0.0, 3.2, 0.0], 0.0)
            return replace(motion, positions=motion.positions + away)

    leapt = replace(found, pieces=tuple(Leapt(piece) for piece in found.pieces))
    seen = {each.law: each for each in breaches(trace, leapt, step=1.0, length=LENGTH)}
    assert 2.5 < seen[LEAPING].value < 3.2 and seen[LEAPING].time == pytest.approx(20.0, abs=0.1)
    assert laws[MOVING].value == pytest.approx(0.5 - 1e-3, abs=1e-6)
    assert laws[SWINGING].value == pytest.approx(3.0 - np.radians(0.1), abs=1e-6)
    assert all(each.time >= 20.0 for each in laws.values())
    outside = breaches(trace, wrong, step=1.0, length=LENGTH, span=(0.0, 15.0))
    assert list(outside) == []
