"""Hard manoeuvres: turning on the spot, reversing, slopes and walls, parking.

`lane` gets the road; `hermite` and `linear` get places, speeds and angles only.
"""

import numpy as np
import pytest
from drives import (
    LENGTH,
    NAMES,
    STEEPEST,
    TYPES,
    Way,
    accelerations,
    assert_sound,
    between,
    changing,
    drive,
    kinds_of,
    network_of,
    ramp,
    road,
    shown,
    sideways,
    stopping,
    trace_of,
)

from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.sumo.fcd import read_trajectories

SMOOTHERS = ("linear", "hermite", "lane")
ALL = pytest.mark.parametrize("smoother", SMOOTHERS)
CURVED = pytest.mark.parametrize("smoother", ["hermite", "lane"])
HEADINGS = pytest.mark.parametrize("heading", ["chord", "tractrix"])
BOTH_LOGS = pytest.mark.parametrize("euler", [False, True], ids=["rates", "euler"])
REAR_AXLE = 0.78 * LENGTH  # behind the front [m]
FINE = 0.04


# Turning -----------------------------------------------------------------------------------


@ALL
@HEADINGS
def test_u_turn_in_half_a_second(smoother, heading):
    times = np.arange(0, 20, 0.5)
    back = times > 9.9
    # 5 m a step: on the turn they are half a circle of 3.2 m across.
    x = np.where(back, 50.0 - 10.0 * (times - 10.0), 50.0 + 10.0 * (times - 9.5))
    trace = trace_of(times, np.column_stack([x, 3.2 * back]), np.pi * back, 10.0)
    trajectory = shown(trace, smoother, heading=heading)
    # The log's own 360 deg/s is the most that may be asked of it.
    assert_sound(trajectory, trace, turn=360.0, refused={"unlike the log", "lane change"})
    motion = trajectory.sample(np.arange(0, 19.5, FINE))
    turned = np.degrees(np.unwrap(motion.yaws))
    assert np.diff(turned).min() >= -2.0  # it turns left, which is where the road lies
    if heading == "chord":
        assert turned[-1] == pytest.approx(180.0, abs=1.0)


@pytest.mark.parametrize("step", [0.1, 1.0, 2.0])
@HEADINGS
def test_turnaround_at_a_dead_end_follows_the_road(step, heading):
    network, way = road("dead end")
    s = lambda t: 85.0 + 3.0 * np.asarray(t)  # noqa: E731
    trace = drive(way, np.arange(0, 20 + step / 2, step), s)
    trajectory = shown(trace, "lane", network, way.names, heading=heading)
    assert_sound(trajectory, trace)
    asked = np.arange(0, 20, FINE)
    motion = trajectory.sample(asked)
    # Rounding with h = 2 m moves a bend of 1.6 m by up to h^2 / (12 r) = 0.2 m.
    assert np.linalg.norm(motion.positions - way.at(s(asked)), axis=1).max() <= 0.4
    assert np.diff(np.unwrap(motion.yaws)).min() >= np.radians(-1.0)


@ALL
@pytest.mark.parametrize("name", ["corner", "roundabout"])
def test_heading_is_the_chord_of_the_displayed_way(name, smoother):
    network, way = road(name)
    trace = drive(way, np.arange(0, 26.0), lambda t: 30.0 + 5.0 * t)
    trajectory = shown(trace, smoother, network, way.names)
    (piece,) = trajectory.pieces
    asked = np.arange(0, 25, FINE)
    motion, trail = piece.sample(asked), piece.trail(asked, np.array([0.0, LENGTH]))
    # The path behind is a curve through places every 0.1 s, which rounds their corners too.
    np.testing.assert_allclose(
        trail[:, 0], motion.positions, atol=0.03 if smoother == "linear" else 0.01
    )
    chord = motion.positions - trail[:, 1]
    most = 1.0 if smoother == "linear" else 0.75
    assert np.degrees(between(motion.yaws, np.arctan2(chord[:, 1], chord[:, 0]))).max() <= most
    # Behind its birth the vehicle came straight.
    born = piece.trail(asked[:1], np.array([2.0, 30.0]))[0]
    np.testing.assert_allclose(born, way.at(np.array([28.0, 0.0])), atol=0.02)


@ALL
@pytest.mark.parametrize("name", ["corner", "roundabout"])
def test_tractrix_slips_nowhere(name, smoother):
    network, way = road(name)
    trace = drive(way, np.arange(0, 26.0), lambda t: 30.0 + 5.0 * t)
    motion = shown(trace, smoother, network, way.names, heading="tractrix").sample(
        np.arange(0, 25, FINE)
    )
    assert sideways(motion).max() <= (
        1.2 if smoother == "linear" else 0.1
    )  # [m/s]; the chord's rear axle slips by 1.7


@CURVED
@pytest.mark.parametrize("name", ["corner", "roundabout"])
def test_lanes_and_angles_are_kept_in_bends(name, smoother):
    network, way = road(name)
    s = lambda t: 30.0 + 5.0 * np.asarray(t)  # noqa: E731
    trace = drive(way, np.arange(0, 26.0), s)
    asked = np.arange(0, 25, FINE)
    motion = shown(trace, smoother, network, way.names).sample(asked)
    away = np.linalg.norm(motion.positions - way.at(s(asked)), axis=1)
    front, rear = way.at(s(asked)), way.at(s(asked) - LENGTH)
    off = np.degrees(between(motion.yaws, np.arctan2(*(front - rear)[:, 1::-1].T)))
    # Rounding with h = 2 m moves a corner of 22.5 degrees by h / 6 x 0.39 = 0.13 m.
    limits = {"lane": (0.15, 2.0), "hermite": (0.30, 6.0)}[smoother]
    assert away.max() <= limits[0]
    assert off.max() <= limits[1]


@CURVED
@BOTH_LOGS
def test_bends_are_driven_without_jolts(smoother, euler):
    network, way = road("roundabout")
    trace = drive(way, np.arange(0, 26.0), lambda t: 30.0 + 5.0 * t, euler=euler)
    (piece,) = shown(trace, smoother, network, way.names).pieces
    # 25 / 16 = 1.6 m/s2 in the ring; SUMO's corners of 10 degrees would be 22 m/s2 a frame.
    assert accelerations(piece).max() <= 4.0


@pytest.mark.parametrize(("type_id", "length"), [("bus", 12.0), ("train", 16.0)])
@pytest.mark.parametrize("name", ["corner", "roundabout"])
@pytest.mark.parametrize("start", [30.0, 108.0], ids=["born before", "born within"])
def test_long_bodies_head_as_sumo_says(name, type_id, length, start):
    # Of a train SUMO logs the angle of the locomotive.
    network, way = road(name)
    s = lambda t: start + 5.0 * np.asarray(t)  # noqa: E731
    trace = drive(way, np.arange(0, 26.0), s, type_id=type_id, length=length)
    trajectory = shown(trace, "lane", network, way.names)
    assert_sound(trajectory, trace)
    asked = np.arange(0, 25, FINE)
    front, rear = way.at(s(asked)), way.at(s(asked) - length)
    truth = np.arctan2(*(front - rear)[:, 1::-1].T)
    off = np.degrees(between(trajectory.sample(asked).yaws, truth))
    # Where it drove before its birth only the angles of its first samples tell.
    assert off[asked > (0.0 if start < 100 else length / 5.0)].max() <= 1.5
    assert off.max() <= (1.5 if start < 100 else 10.0)


# Reversing ---------------------------------------------------------------------------------


@ALL
@HEADINGS
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["speed without sign", "negative speed"])
@pytest.mark.parametrize("bent", [False, True], ids=["straight", "corner"])
def test_reversing_does_not_turn_round(smoother, heading, sign, bent):
    network, way = road("corner" if bent else "straight")
    start = 118.0 if bent else 60.0

    def s(t):  # forward, stop, back by 12 m, stop
        t = np.asarray(t)
        return start - 2.0 * np.clip(10.0 - t, 0, 10) - 2.0 * np.clip(t - 14.0, 0, 6)

    trace = drive(way, np.arange(0, 25.0), s)
    backing = (trace.times > 14.0) & (trace.times < 20.5)
    speeds = np.where(backing, sign * 2.0, np.where(trace.times < 10.5, 2.0, 0.0))
    trace = trace_of(
        trace.times, trace.positions, trace.yaws, speeds, lanes=trace.lanes, offsets=trace.offsets
    )
    trajectory = shown(trace, smoother, network, way.names, heading=heading)
    assert_sound(trajectory, trace)
    asked = np.arange(0, 24, FINE)
    motion = trajectory.sample(asked)
    logged = np.interp(asked, trace.times, np.unwrap(trace.yaws))
    most = 25.0 if bent else 1.0
    assert np.degrees(between(motion.yaws, logged)).max() <= most
    assert np.linalg.norm(motion.positions - way.at(s(asked)), axis=1).max() <= 0.4
    assert "reversing" in kinds_of(trajectory)


# Up and down -------------------------------------------------------------------------------


@ALL
@BOTH_LOGS
def test_a_ramp_is_climbed_on_the_road(smoother, euler):
    network, way = road("ramp")
    s = lambda t: 20.0 + 12.0 * np.asarray(t)  # noqa: E731
    trace = drive(way, np.arange(0, 31.0), s, euler=euler)
    trajectory = shown(trace, smoother, network, way.names)
    assert_sound(trajectory, trace)
    asked = np.arange(0, 30, FINE)
    motion = trajectory.sample(asked)
    assert np.abs(motion.positions[:, 2] - way.at(s(asked))[:, 2]).max() <= 0.25
    front, rear = way.at(s(asked)), way.at(s(asked) - LENGTH)
    pitch = np.arctan2((front - rear)[:, 2], np.hypot(*(front - rear)[:, :2].T))
    on_one_slope = np.abs(asked - 6.7) > 1.5
    on_one_slope &= np.abs(asked - 15.1) > 1.5
    off = np.degrees(np.abs(motion.pitches - pitch))
    assert off[on_one_slope].max() <= 0.5
    assert "steep" not in kinds_of(trajectory)


def test_places_on_steep_lanes_are_three_dimensional():
    # SUMO counts places along the slope: here 107.7 m for 100 m of map.
    network = ramp(grade=0.4)
    way = Way.of(network, ("a_0",))
    s = lambda t: 20.0 + 12.0 * np.asarray(t)  # noqa: E731
    trace = drive(way, np.arange(0, 31.0), s)
    trajectory = shown(trace, "lane", network, way.names)
    assert trajectory.remarks == ()
    asked = np.arange(0, 30, FINE)
    assert np.abs(trajectory.sample(asked).positions - way.at(s(asked))).max() <= 0.2


@ALL
@pytest.mark.parametrize("slope", [90.0, -90.0])
def test_a_slope_of_90_degrees_in_the_log_is_refused(smoother, slope, tmp_path):
    # Monaco's log has such rows on flat ground; the reader cuts them to 30 degrees.
    rows = "".join(
        f'<timestep time="{t}"><vehicle id="a" x="{20 + 8 * t}" y="0" z="3" angle="90" type="car"'
        f' speed="8" pos="{20 + 8 * t}" lane="a_0" slope="{slope if t == 7 else 0}"/></timestep>'
        for t in range(16)
    )
    file = tmp_path / "fcd.xml"
    file.write_text(f"<fcd-export>{rows}</fcd-export>", encoding="utf-8")
    log = read_trajectories([file])
    network = network_of({"a_0": [(0, 0, 3), (500, 0, 3)]}) if smoother == "lane" else None
    (found,) = smooth_log(log, smoother=smoother, network=network, types=TYPES)
    assert_sound(found, log.traces[0])
    motion = found.sample(np.arange(0, 15, FINE))
    assert np.abs(motion.positions[:, 2] - 3.0).max() <= 0.01
    assert np.degrees(np.abs(motion.pitches)).max() <= 0.1  # the ground is flat


@ALL
@pytest.mark.parametrize("rise", [6.0, -6.0])
def test_a_wall_in_the_heights_is_refused_and_reported(smoother, rise):
    times = np.arange(20.0)
    along = 20.0 + 3.0 * times
    network = network_of({"a_0": [(0, 0, 0), (49, 0, 0), (51, 0, rise), (500, 0, rise)]})
    height = np.interp(along, [49, 51], [0.0, rise])
    xyz = np.column_stack([along, 0 * along, height])
    trace = trace_of(times, xyz, 0.0, 3.0, lanes=0, offsets=along)
    trajectory = shown(trace, smoother, network, ("a_0",))
    assert_sound(trajectory, trace)
    motion = trajectory.sample(np.arange(0, 19, FINE))
    assert np.abs(motion.pitches).max() <= STEEPEST + 1e-9
    assert "steep" in kinds_of(trajectory)


# Parking -----------------------------------------------------------------------------------


def parked(*, side=-6.4, turned=0.0, born=False):
    """A stop, a jump aside within one step, half a minute there, and the same back."""
    network, way = road("straight")
    s = stopping(8.0, 2.0, 10.0)
    trace = drive(way, np.arange(0, 70.0), lambda t: s(t) + 5.0 * np.clip(t - 55.0, 0, 20))
    aside = (trace.times >= 20.0) & (trace.times < 50.0)
    positions = trace.positions + [0.0, side, 0.0] * aside[:, None]
    first = 25 if born else 0
    trace = trace_of(
        trace.times[first:],
        positions[first:],
        (trace.yaws + turned * aside)[first:],
        trace.speeds[first:],
        lanes=trace.lanes[first:],
        offsets=trace.offsets[first:],
    )
    return network, way, trace


@ALL
@HEADINGS
@pytest.mark.parametrize("turned", [0.0, np.radians(45.0), np.radians(-90.0)])
@pytest.mark.parametrize("side", [-6.4, -1.8, 8.3])
def test_parking_takes_three_seconds_and_is_listed(smoother, heading, side, turned):
    network, way, trace = parked(side=side, turned=turned)
    trajectory = shown(trace, smoother, network, way.names, heading=heading)
    assert_sound(trajectory, trace, refused={"parking"})
    moves = [remark for remark in trajectory.remarks if remark.kind == "parking"]
    assert len(moves) == 2
    for remark, (begin, end) in zip(moves, [(19.0, 20.0), (49.0, 50.0)], strict=True):
        assert remark.end - remark.begin >= 3.0
        assert remark.begin <= begin
        assert remark.end >= end - 1e-9
        assert remark.value == pytest.approx(abs(side), abs=0.1)
    asked = np.arange(0, 69, FINE)
    motion = trajectory.sample(asked)
    steps = np.linalg.norm(np.diff(motion.positions, axis=0), axis=1) / FINE
    manoeuvring = ((asked > 15) & (asked < 25)) | ((asked > 45) & (asked < 54))
    assert steps[manoeuvring[1:]].max() <= 2.0 * abs(side) / 3.0
    there = (asked > 26) & (asked < 44)
    np.testing.assert_allclose(motion.positions[there, 1], side, atol=0.01)
    assert np.degrees(between(motion.yaws[there], turned)).max() <= 1.0


@ALL
def test_a_vehicle_born_parked_takes_sumos_angle_and_drives_off(smoother):
    network, way, trace = parked(turned=np.radians(45.0), born=True)
    trajectory = shown(trace, smoother, network, way.names)
    assert_sound(trajectory, trace, refused={"parking"})
    motion = trajectory.sample(np.arange(25, 69, FINE))
    waiting = motion.positions[:, 1] < -6.3
    assert waiting.sum() > 400
    assert np.degrees(between(motion.yaws[waiting], np.radians(45.0))).max() <= 1.0
    assert motion.positions[-1, 1] == pytest.approx(0.0, abs=0.01)


@ALL
def test_a_lane_change_in_a_creeping_queue_is_a_drive_or_a_manoeuvre(smoother):
    network, trace = changing(0.3)
    trajectory = shown(trace, smoother, network, NAMES)
    assert_sound(trajectory, trace, refused={"parking"}, own=smoother != "lane")
    for move in (remark for remark in trajectory.remarks if remark.kind == "parking"):
        assert move.end - move.begin >= 3.0


@ALL
def test_a_step_aside_while_standing_is_parking_too(smoother):
    # SUMO's lane change of a car that does not get on: 3.2 m aside at 0.05 m/s.
    network, trace = changing(0.05)
    trajectory = shown(trace, smoother, network, NAMES)
    assert_sound(trajectory, trace, refused={"parking"})
    (move,) = [remark for remark in trajectory.remarks if remark.kind == "parking"]
    assert move.end - move.begin >= 3.0
