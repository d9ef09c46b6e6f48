"""What a smoother knows: the meaning of speeds, and the length that follows a front."""

from dataclasses import replace

import numpy as np
import pytest
from drives import TYPES, drive, log_of, road, straight, trace_of

from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.motion import settings_of
from sumo3dviz_pt.motion.lanes import LaneGraph, Tracks
from sumo3dviz_pt.motion.setting import LogSettings, Setting, body_length, is_euler


def swinging(t):
    """A drive that speeds up and slows down, 2 to 10 m/s."""
    return 20.0 + 6.0 * np.asarray(t) - 12.0 * np.cos(np.asarray(t) / 3.0)


def logged(name="straight", *, euler, step=1.0, last=40.0, s=swinging, **other):
    _, way = road(name)
    return drive(way, np.arange(0.0, last, step), s, euler=euler, **other)


def type_of(length, **params):
    return VehicleType("t", "rail", length, 2.8, 4.0, params=params)


# Speeds ------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("euler", [False, True])
@pytest.mark.parametrize("name", ["straight", "corner"])
def test_both_meanings_of_speed_are_told_apart(name, euler, step):
    assert is_euler([logged(name, euler=euler, step=step)]) is euler


@pytest.mark.parametrize("euler", [False, True])
def test_places_tell_where_lanes_have_none(euler):
    trace = replace(logged(euler=euler), offsets=np.empty(0))
    assert is_euler([trace]) is euler


def test_sumos_euler_step_by_step():
    # v += a dt, then s += v dt: SUMO's own loop.
    chance = np.random.default_rng(3)
    speed, place, rows = 5.0, 10.0, []
    for _ in range(40):
        rows.append((place, speed))
        speed = max(speed + chance.uniform(-2.0, 2.0), 0.0)
        place += speed
    along, speeds = np.array(rows).T
    xy = np.column_stack([along, 0.0 * along])
    trace = trace_of(np.arange(40.0), xy, 0.0, speeds, lanes=0, offsets=along)
    assert is_euler([trace]) is True
    # The same places with the mean of both steps' speeds, as ballistic runs log them.
    rates = np.convolve(np.diff(along, prepend=along[0] - 5.0), [0.5, 0.5], mode="full")[1:]
    assert is_euler([replace(trace, speeds=rates[:40])]) is False


def test_even_speed_tells_nothing():
    trace = logged(euler=True, s=lambda t: 20.0 + 8.0 * np.asarray(t))
    assert is_euler([trace]) is None
    assert is_euler([]) is None


def test_few_steps_make_no_verdict():
    trace = logged(euler=True, last=12.0)
    assert is_euler([trace]) is True
    assert is_euler([trace], least=20) is None


def test_a_log_without_speeds_makes_no_verdict():
    trace = logged(euler=True)
    assert is_euler([replace(trace, speeds=np.full(len(trace.times), np.nan))]) is None


def test_thin_logs_of_euler_runs_hold_rates():
    # Every fifth row: the speed is that of the last step of 1 s, not of the 5 s between rows.
    trace = logged(euler=True, step=1.0, last=120.0)
    thin = slice(None, None, 5)
    names = ("times", "positions", "yaws", "speeds", "slopes", "lanes", "signals", "offsets")
    trace = replace(trace, **{name: getattr(trace, name)[thin] for name in names})
    assert is_euler([trace]) is False


def test_speeds_that_only_come_near_are_no_differences():
    trace = logged(euler=True)
    noise = 0.05 * (-1.0) ** trace.times
    assert is_euler([replace(trace, speeds=trace.speeds + noise)]) is False


def test_in_short_steps_both_meanings_come_near():
    # 7 m/s2 over 0.04 s: the two differ by 6 mm.
    trace = logged(euler=False, step=0.04, last=3.0, s=lambda t: 20.0 + 3.5 * t**2, exact=True)
    assert is_euler([trace]) is False
    trace = logged(euler=True, step=0.04, last=3.0, s=lambda t: 20.0 + 3.5 * t**2, exact=True)
    assert is_euler([trace]) is True


# Settings ----------------------------------------------------------------------------------


def test_a_vehicle_that_tells_enough_decides_for_itself():
    euler, ballistic = logged(euler=True), logged(euler=False)
    for log in (True, False):
        settings = LogSettings(euler=log)
        assert settings.of(euler).euler is True
        assert settings.of(ballistic).euler is False
        assert settings.of(logged(euler=not log, last=9.0)).euler is log


def test_only_vehicles_follow_lanes():
    tracks = Tracks(LaneGraph(straight()))
    settings = LogSettings(tracks=tracks, lane_names=("a_0",))
    vehicle, person = logged(euler=False), logged(euler=False, kind="person")
    assert settings.of(vehicle).tracks is tracks
    assert settings.of(vehicle).graph is tracks.graph
    assert settings.of(person).tracks is None and settings.of(person).graph is None
    assert settings.of(person).kind == "person"
    assert Setting().graph is None


def test_settings_of_a_log():
    network, way = road("straight")
    log = log_of(logged(euler=True), names=way.names)
    known = settings_of(log, network=network, types=TYPES)
    assert known.euler is True and known.lane_names == ("a_0",)
    assert known.tracks.graph.network is network
    assert settings_of(log).tracks is None


# Lengths -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("found", "length"),
    [
        (type_of(12.0), 12.0),
        (type_of(200.0, locomotiveLength="16"), 16.0),
        (type_of(10.0, locomotiveLength="16"), 10.0),
        (type_of(30.0, locomotiveLength="0"), 30.0),
        (type_of(30.0, locomotiveLength="-1"), 30.0),
        (type_of(30.0, locomotiveLength="long"), 30.0),
        (type_of(0.2), 0.6),
    ],
)
def test_length_that_follows_the_front(found, length):
    trace = logged(euler=False, last=3.0, type_id="t")
    assert body_length(trace, {"t": found}) == length


@pytest.mark.parametrize(
    ("kind", "length"), [("vehicle", 5.0), ("person", 0.6), ("container", 6.096)]
)
def test_length_of_unknown_types(kind, length):
    assert body_length(logged(euler=False, last=3.0, kind=kind, type_id="?"), {}) == length
