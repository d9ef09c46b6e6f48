"""Laws of the smoothers on drives along known roads, and on nonsense.

What is drawn: a road with bends, crests or none, a pace (with stops), a step, and which of
SUMO's two meanings the logged speed has. Samples are not rounded, so that the laws are sharp.
"""

from dataclasses import replace

import numpy as np
import pytest
from drives import (
    LENGTH,
    STEEPEST,
    WAYS,
    Way,
    between,
    drive,
    log_of,
    network_of,
    shown,
    trace_of,
)
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.motion import MARGIN, smooth_log

SMOOTHERS = ("linear", "hermite", "lane")
EACH = pytest.mark.parametrize("smoother", SMOOTHERS)
HEADINGS = pytest.mark.parametrize("heading", ["chord", "tractrix"])
LAWS = settings(max_examples=tries(8), deadline=None, suppress_health_check=[HealthCheck.too_slow])
FIELDS = ("times", "positions", "yaws", "speeds", "slopes", "lanes", "signals", "offsets")
ROADS = {name: (make(), lanes) for name, (make, lanes) in WAYS.items()}


class Drawn:
    """A drive; told by what was drawn."""

    def __init__(self, told, network, names, trace):
        self.told, self.network, self.names, self.trace = told, network, names, trace
        self.road = told.partition(":")[0]

    def __repr__(self):
        return self.told

    def shown(self, smoother, heading="chord", **other):
        return shown(
            other.pop("trace", self.trace), smoother, other.pop("network", self.network),
            self.names, heading=heading, **other,
        )  # fmt: skip


@st.composite
def drives(draw, *, last=30.0, steps=(0.2, 0.5, 1.0, 2.0), slowest=0.0, roads=tuple(ROADS)):
    """A drive along a road that `lane` knows."""
    name = draw(st.sampled_from(roads))
    network, lanes = ROADS[name]
    way = Way.of(network, lanes)
    paces = np.array(draw(st.lists(st.floats(slowest, 12.0), min_size=3, max_size=7)))
    paces = np.maximum(paces, slowest) * (paces > 0.5) + slowest * (paces <= 0.5)
    knots = np.linspace(-1.0, last + 1.0, 6001)
    pace = np.interp(knots, np.linspace(0.0, last, len(paces)), paces)
    along = np.r_[0.0, np.cumsum((pace[1:] + pace[:-1]) / 2 * np.diff(knots))]
    start = draw(st.floats(10.0, 40.0))

    def s(t):
        return start + np.interp(t, knots, along)

    step = draw(st.sampled_from(steps))
    times = np.round(np.arange(0.0, last + 0.01, step), 6)
    times = times[s(times) < way.along[-1] - 1.0]
    assume(len(times) * step > last / 3)
    euler = draw(st.booleans())
    trace = drive(way, times, s, euler=euler, exact=True)
    told = f"{name}: {paces} from {start}, step {step}, {'euler' if euler else 'rates'}"
    return Drawn(told, network, way.names, trace)


def asked(trace, count=301):
    return np.linspace(trace.times[0], trace.times[-1], count)


def turned_network(network, turn, shift):
    shapes = {lane.id: lane.shape @ turn.T + shift for lane in network.lanes.values()}
    links = [(c.from_lane, c.to_lane, c.via) for c in network.connections if c.via]
    return network_of(shapes, links)


@EACH
@HEADINGS
@LAWS
@given(drives(), st.floats(-np.pi, np.pi), st.tuples(*[st.floats(-1e5, 1e5)] * 2))
def test_turning_and_moving_the_world_turns_and_moves_the_result(
    smoother, heading, drawn, angle, shift
):
    trace = drawn.trace
    # Half a turn from sample to sample has no sense.
    assume(between(trace.yaws[1:], trace.yaws[:-1]).max() < 3.0)
    cos, sin = np.cos(angle), np.sin(angle)
    turn, shift = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]]), np.array([*shift, 7.0])
    other = replace(
        trace,
        positions=trace.positions @ turn.T + shift,
        yaws=np.arctan2(np.sin(trace.yaws + angle), np.cos(trace.yaws + angle)),
    )
    here = drawn.shown(smoother, heading).sample(asked(trace))
    moved = turned_network(drawn.network, turn, shift)
    there = drawn.shown(smoother, heading, trace=other, network=moved).sample(asked(trace))
    assert np.abs(here.positions @ turn.T + shift - there.positions).max() < 1e-5
    # On the spot, a dragged axle makes much of the last digit.
    most = 1e-2 if drawn.road == "dead end" else 1e-4
    assert between(here.yaws + angle, there.yaws).max() < most
    assert np.abs(here.pitches - there.pitches).max() < 1e-5
    assert np.abs(here.travelled - there.travelled).max() < 1e-4


@EACH
@HEADINGS
@LAWS
@given(drives(), st.integers(-100, 90000))
def test_a_later_log_gives_the_same_later(smoother, heading, drawn, shift):
    trace = drawn.trace
    later = replace(trace, times=trace.times + shift)
    here = drawn.shown(smoother, heading).sample(asked(trace))
    there = drawn.shown(smoother, heading, trace=later).sample(asked(trace) + shift)
    assert there.alive.all()
    assert np.abs(here.positions - there.positions).max() < 1e-5
    assert between(here.yaws, there.yaws).max() < (1e-2 if drawn.road == "dead end" else 1e-4)


@EACH
@HEADINGS
@LAWS
@given(
    st.floats(-np.pi, np.pi), st.floats(0.0, 40.0), st.sampled_from([0.1, 1.0, 2.0]), st.booleans()
)
def test_straight_lines_at_even_speed_are_kept(smoother, heading, facing, speed, step, lanes):
    times = np.arange(0, 20.01, step)
    ahead = np.array([np.cos(facing), np.sin(facing), 0.0])
    along = 10.0 + speed * times
    network = network_of({"a_0": [0 * ahead, 1000.0 * ahead]})
    trace = trace_of(
        times, along[:, None] * ahead, facing, speed,
        lanes=0 if lanes else -1, offsets=along, exact=True,
    )  # fmt: skip
    motion = shown(trace, smoother, network, ("a_0",), heading=heading).sample(asked(trace))
    expected = (10.0 + speed * asked(trace))[:, None] * ahead
    assert np.abs(motion.positions - expected).max() < 1e-6
    assert np.abs(motion.speeds - speed).max() < 1e-6
    assert between(motion.yaws, facing).max() < 1e-6
    assert np.abs(motion.travelled - speed * asked(trace)).max() < 1e-5


@EACH
@LAWS
@given(st.floats(10.0, 60.0), st.floats(5.0, 12.0), st.sampled_from([-1.0, 1.0]))
def test_circles_at_even_speed_are_kept(smoother, radius, speed, sense):
    assume(speed < 0.8 * radius)
    times = np.arange(0.0, 20.5)
    angles = np.linspace(0.0, 20.0 * speed / radius + 1.0, 2000)
    shape = radius * np.column_stack([np.sin(angles), sense * (1 - np.cos(angles))])
    network = network_of({"a_0": shape})
    way = Way.of(network, ("a_0",))
    trace = drive(way, times, lambda t: speed * t, exact=True)
    when = asked(trace)
    motion = shown(trace, smoother, network, way.names).sample(when)
    away = np.linalg.norm(motion.positions - way.at(speed * when), axis=1).max()
    sagitta = radius * (1 - np.cos(speed / radius / 2))
    # `lane`: rounding moves a bend by h^2 / (12 r), h = 2 m.
    limit = {"linear": sagitta, "hermite": 0.5 * sagitta, "lane": 4 / (12 * radius)}[smoother]
    assert away <= limit * 1.05 + 0.005
    if smoother == "lane":
        chord = np.arcsin(np.minimum(LENGTH / (2 * radius), 1.0))
        settled = when > 5.0
        tangent = sense * speed * when / radius
        off = np.degrees(between(motion.yaws, tangent - sense * chord)[settled])
        assert off.max() <= 0.5


@EACH
@HEADINGS
@LAWS
@given(drives())
def test_nobody_drives_backwards(smoother, heading, drawn):
    trace = drawn.trace
    motion = drawn.shown(smoother, heading).sample(asked(trace, 1201))
    assert np.diff(motion.travelled).min() >= -1e-3
    steps = np.linalg.norm(np.diff(motion.positions, axis=0), axis=1)
    # The way is measured along chords of 0.1 s, and a turnaround has a radius of 1.6 m.
    most = 0.2 if drawn.road == "dead end" else 0.02
    assert np.abs(np.diff(motion.travelled) - steps).max() <= most
    paced = (motion.speeds[1:] + motion.speeds[:-1]) / 2 * np.diff(asked(trace, 1201))
    if smoother != "linear":  # whose speed jumps at samples
        assert np.abs(paced - steps).max() <= most


@EACH
@HEADINGS
@LAWS
@given(drives())
def test_birth_and_death_are_exact(smoother, heading, drawn):
    trace = drawn.trace
    trajectory = drawn.shown(smoother, heading)
    for index in (0, -1):
        pose = trajectory.at(trace.times[index])
        assert np.abs(pose.position - trace.positions[index]).max() <= 0.05
    motion = trajectory.sample(trace.times)
    assert motion.alive.all()
    # Corners are rounded, but moved by no more than this.
    off = np.linalg.norm(motion.positions - trace.positions, axis=1)
    assert off.max() <= {"linear": 1e-9, "hermite": 1e-6, "lane": 0.3}[smoother]
    assert trajectory.at(trace.times[0] - 1e-6) is None
    assert trajectory.at(trace.times[-1] + 1e-6) is None


@EACH
@LAWS
@given(drives(last=60.0, steps=(0.5, 1.0, 2.0)), st.floats(0.2, 0.8))
def test_the_asked_window_changes_nothing(smoother, drawn, share):
    trace = drawn.trace
    step = float(np.median(np.diff(trace.times)))
    begin = share * (trace.times[-1] - 4.0)
    kept = (trace.times >= begin - MARGIN) & (trace.times <= begin + 4.0 + MARGIN)
    part = replace(trace, **{name: getattr(trace, name)[kept] for name in FIELDS})
    when = np.linspace(max(begin, 0.0), min(begin + 4.0, trace.times[-1]), 101)
    whole = drawn.shown(smoother, step=step).sample(when)
    cut = drawn.shown(smoother, trace=part, step=step).sample(when)
    assert (whole.alive == cut.alive).all()
    # Speeds that change by less than 0.2 m/s a step do not tell what they mean, and then
    # are 0.1 m/s off: 4/27 x 2 s x 0.1 m/s. All else is forgotten within the margin.
    assert np.abs(whole.positions - cut.positions).max() <= 0.03
    # Chords know no lanes: a vehicle that stands in a turn has the log's angle only, until it
    # has driven some of its lengths.
    before = part.positions[part.times <= when[0]]
    driven = np.linalg.norm(np.diff(before, axis=0), axis=1).sum()
    if smoother != "linear" or driven > 20.0:
        assert np.degrees(between(whole.yaws, cut.yaws)).max() <= 1.0


@EACH
@LAWS
@given(drives(last=60.0, steps=(0.5, 1.0), slowest=4.0), st.floats(0.2, 0.8))
def test_the_asked_window_changes_tractrices_little(smoother, drawn, share):
    # A dragged axle forgets its past over some lengths: 24 m of margin leave e^-6 of it.
    trace = drawn.trace
    step = float(np.median(np.diff(trace.times)))
    begin = share * (trace.times[-1] - 4.0)
    kept = (trace.times >= begin - MARGIN) & (trace.times <= begin + 4.0 + MARGIN)
    part = replace(trace, **{name: getattr(trace, name)[kept] for name in FIELDS})
    when = np.linspace(max(begin, 0.0), min(begin + 4.0, trace.times[-1]), 101)
    whole, cut = (
        drawn.shown(smoother, "tractrix", trace=each, step=step).sample(when)
        for each in (trace, part)
    )
    assert np.degrees(between(whole.yaws, cut.yaws)).max() <= 2.0


@EACH
@HEADINGS
@LAWS
@given(drives(), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
def test_a_pose_is_a_function_of_time_alone(smoother, heading, drawn, shares):
    trace = drawn.trace
    trajectory = drawn.shown(smoother, heading)
    when = trace.times[-1] * np.array(shares)
    together = trajectory.sample(when)
    again = trajectory.sample(np.r_[when[::-1], asked(trace, 50)])
    for index in range(len(when)):
        alone = trajectory.sample(when[index : index + 1])
        for name in ("positions", "yaws", "pitches", "speeds", "travelled"):
            value = getattr(together, name)[index]
            np.testing.assert_allclose(getattr(alone, name)[0], value, atol=1e-9)
            same = getattr(again, name)[len(when) - 1 - index]
            np.testing.assert_allclose(same, value, atol=1e-9)
    trails = trajectory.pieces[0].trail(when, np.array([0.0, 4.0]))
    alone = trajectory.pieces[0].trail(when[:1], np.array([0.0, 4.0]))
    np.testing.assert_allclose(trails[0], alone[0], atol=1e-9)


# Nonsense ----------------------------------------------------------------------------------

ODD = st.floats(-60, 60) | st.sampled_from([0.0, np.nan])


@st.composite
def nonsense(draw):
    """Logs that no simulation writes: places, speeds, angles and lanes that contradict."""
    network, lanes = ROADS[draw(st.sampled_from(tuple(ROADS)))]
    count = draw(st.integers(1, 14))
    column = lambda values: np.array(draw(st.lists(values, min_size=count, max_size=count)))  # noqa: E731
    hops = column(st.sampled_from([0.0, 0.01, 0.5, 3.2, 9.0, 30.0, -1.0, -20.0, 5000.0]))
    steps = column(st.sampled_from([0.1, 0.5, 1.0, 1.0, 1.0, 1.4, 30.0]))
    sway = column(st.sampled_from([0.0, 0.0, 3.2, -6.4, 100.0]))
    times = draw(st.sampled_from([0.0, 86400.0])) + np.cumsum(steps)
    xyz = np.column_stack([np.cumsum(hops), sway, column(st.sampled_from([0.0, 0.0, 5.0, -80.0]))])
    trace = trace_of(
        times, xyz, column(st.floats(-np.pi, np.pi)), column(ODD),
        lanes=column(st.integers(-1, len(lanes) - 1)), offsets=column(ODD | st.floats(0, 300)),
        slopes=column(st.sampled_from([0.0, STEEPEST, -STEEPEST])), exact=True,
        kind=draw(st.sampled_from(["vehicle", "vehicle", "person", "container"])),
        type_id=draw(st.sampled_from(["car", "bus", "unheard of", ""])),
    )  # fmt: skip
    told = "\n".join(f"{n} {getattr(trace, n).tolist()}" for n in FIELDS)
    return Drawn(f"{trace.kind} {trace.type_id} on {lanes}\n{told}", network, lanes, trace)


@EACH
@HEADINGS
@settings(LAWS, max_examples=tries(40))
@given(nonsense())
def test_nonsense_is_shown_without_breaking(smoother, heading, drawn):
    trace = drawn.trace
    log = log_of(trace, names=drawn.names, step=1.0)
    (found,) = smooth_log(log, smoother=smoother, network=drawn.network, heading=heading)
    for remark in found.remarks:
        assert np.isfinite([remark.begin, remark.end, remark.value]).all()
        assert remark.end >= remark.begin
    assert [remark.begin for remark in found.remarks] == sorted(r.begin for r in found.remarks)
    motion = found.sample(trace.times)
    assert motion.alive.all()
    for piece in found.pieces:
        when = np.linspace(piece.begin, piece.end, 60)
        motion = piece.sample(when)
        assert np.isfinite(motion.positions).all()
        assert np.isfinite(piece.trail(when, np.array([0.0, 3.0, 40.0]))).all()
        for values in (motion.yaws, motion.pitches, motion.speeds, motion.travelled):
            assert np.isfinite(values).all()
        assert np.abs(motion.pitches).max() <= STEEPEST + 1e-9
