"""Roads, drives and their logs made by code, and the laws that displayed motion keeps.

A drive is a function of time along lanes; what SUMO would log of it is known exactly:
front on the lane's centre line, angle from the point one vehicle length behind to the
front, place along the lane, speed either the derivative or (Euler) the last step's mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.network import Connection, Edge, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Trace, TrafficLog, VehicleType
from sumo3dviz_pt.motion import smooth_log

LENGTH = 5.0
TYPES = {
    "car": VehicleType("car", "passenger", LENGTH, 1.8, 1.5),
    "bus": VehicleType("bus", "bus", 12.0, 2.5, 3.0),
    "train": VehicleType("train", "rail", 200.0, 2.8, 4.0, params={"locomotiveLength": "16"}),
}
STEEPEST = np.radians(30.0)

# Roads -------------------------------------------------------------------------------------


def network_of(shapes, links=()):
    """A network of lanes by id, (n, 2 or 3) [m], and of links (from, to, via)."""
    edges = {}
    for name, points in shapes.items():
        edge, _, index = name.rpartition("_")
        points = np.asarray(points, dtype=float)
        shape = np.zeros((len(points), 3))
        shape[:, : points.shape[1]] = points
        length = float(np.linalg.norm(np.diff(shape, axis=0), axis=1).sum())
        lane = Lane(name, edge, int(index), shape, 3.2, 13.9, length, frozenset({"passenger"}))
        edges.setdefault(edge, []).append(lane)
    made = {
        name: Edge(name, "internal" if name[0] == ":" else "normal", "", "", tuple(lanes))
        for name, lanes in edges.items()
    }
    connections = []
    for start, end, via in links:
        connections.append(Connection(start, end, via))
        connections += [Connection(via, end)] if via else []
    return Network(made, {}, tuple(connections), Location())


def straight(*, length=1500.0, lanes=2, turn=0.0):
    """A road from the origin; lane 0 is the right one."""
    ahead, left = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    shapes = {
        f"a_{k}": np.array([3.2 * k * left, length * ahead + 3.2 * k * left]) for k in range(lanes)
    }
    return network_of(shapes)


def arc(centre, radius, first, last, count):
    """Points of an arc by its angles [deg], (count, 2)."""
    angles = np.radians(np.linspace(first, last, count))
    return np.asarray(centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def corner(*, radius=6.0):
    """A left turn by 90 degrees over an internal lane of five points, as netconvert makes it."""
    shapes = {
        "a_0": [(0, 0), (100, 0)],
        ":j_0_0": arc((100, radius), radius, -90, 0, 5),
        "b_0": [(100 + radius, radius), (100 + radius, 250)],
    }
    return network_of(shapes, [("a_0", "b_0", ":j_0_0")])


def ramp(*, grade=0.08):
    """100 m flat, 100 m of slope, 300 m flat; one lane."""
    top = 100 * grade
    return network_of({"a_0": [(0, 0, 0), (100, 0, 0), (200, 0, top), (500, 0, top)]})


def roundabout(*, radius=16.0):
    """Three quarters of a circle between two straight roads that touch it."""
    shapes = {
        "in_0": [(-100, -radius), (-2, -radius)],
        ":x_0_0": [(-2, -radius), (0, -radius)],
        "r1_0": arc((0, 0), radius, -90, 40, 14),
        ":y_0_0": arc((0, 0), radius, 40, 50, 2),
        "r2_0": arc((0, 0), radius, 50, 180, 14),
        ":z_0_0": [(-radius, 0), (-radius, -2)],
        "out_0": [(-radius, -2), (-radius, -200)],
    }
    links = [("in_0", "r1_0", ":x_0_0"), ("r1_0", "r2_0", ":y_0_0"), ("r2_0", "out_0", ":z_0_0")]
    return network_of(shapes, links)


def dead_end():
    """A road, a turnaround of radius 1.6 m at its end, and the way back."""
    shapes = {
        "a_0": [(0, 0), (100, 0)],
        ":d_0_0": arc((100, 1.6), 1.6, -90, 90, 5),
        "b_0": [(100, 3.2), (-100, 3.2)],
    }
    return network_of(shapes, [("a_0", "b_0", ":d_0_0")])


WAYS = {
    "corner": (corner, ("a_0", ":j_0_0", "b_0")),
    "ramp": (ramp, ("a_0",)),
    "roundabout": (roundabout, ("in_0", ":x_0_0", "r1_0", ":y_0_0", "r2_0", ":z_0_0", "out_0")),
    "dead end": (dead_end, ("a_0", ":d_0_0", "b_0")),
    "straight": (straight, ("a_0",)),
}

# Drives ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """Lanes one after the other."""

    names: tuple
    shape: np.ndarray  # (n, 3)
    along: np.ndarray  # (n,)
    starts: np.ndarray  # of the lanes

    @classmethod
    def of(cls, network, names):
        shape = np.concatenate([network.lanes[name].shape for name in names])
        along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(shape, axis=0), axis=1))]
        starts = np.cumsum([0.0] + [network.lanes[name].length for name in names[:-1]])
        return cls(tuple(names), shape, along, starts)

    def at(self, s):
        """Points at arc lengths, straight on beyond the ends, (n, 3)."""
        s = np.asarray(s, dtype=float)
        inside = np.column_stack([np.interp(s, self.along, axis) for axis in self.shape.T])
        first = self.shape[1] - self.shape[0]
        before = np.minimum(s, 0.0)[:, None] * first / np.linalg.norm(first)
        last = self.shape[-1] - self.shape[-2]
        after = np.maximum(s - self.along[-1], 0.0)[:, None] * last / np.linalg.norm(last)
        return inside + before + after

    def lanes(self, s):
        """Index of the lane, and place on it, at arc lengths."""
        index = np.searchsorted(self.starts, np.asarray(s) + 1e-9, side="right") - 1
        index = np.clip(index, 0, len(self.starts) - 1)
        return index, np.asarray(s) - self.starts[index]


def drive(way, times, s, *, euler=False, exact=False, length=LENGTH, **other):
    """What SUMO logs of a vehicle that is at s(t) on a way."""
    times = np.asarray(times, dtype=float)
    at = np.asarray(s(times), dtype=float)
    speeds = (s(times + 1e-4) - s(times - 1e-4)) / 2e-4
    if euler:
        speeds[1:] = np.diff(at) / np.diff(times)
    front, rear = way.at(at), way.at(at - length)
    yaws = np.arctan2(*(front - rear)[:, 1::-1].T)
    lanes, offsets = way.lanes(at)
    return trace_of(times, front, yaws, speeds, lanes=lanes, offsets=offsets, exact=exact, **other)


def trace_of(times, xyz, yaws=0.0, speeds=np.nan, *, lanes=-1, offsets=None, exact=False, **other):
    """Samples of one road user, rounded as SUMO does."""
    times, xyz = np.asarray(times, dtype=float), np.asarray(xyz, dtype=float)
    full = np.ones(len(times))
    positions = np.zeros((len(times), 3))
    positions[:, : xyz.shape[1]] = xyz
    offsets = np.full(len(times), np.nan) if offsets is None else offsets * full
    degrees = np.degrees(yaws * full)
    if not exact:
        positions, offsets = np.round(positions, 2), np.round(offsets, 2)
        degrees, speeds = np.round(degrees, 2), np.round(speeds * full, 2)
    return Trace(
        id=other.get("id", "a"),
        kind=other.get("kind", "vehicle"),
        type_id=other.get("type_id", "car"),
        times=times,
        positions=positions,
        yaws=np.arctan2(np.sin(np.radians(degrees)), np.cos(np.radians(degrees))),
        speeds=speeds * full,
        slopes=other.get("slopes", 0.0) * full,
        lanes=(lanes * full).astype(np.int64),
        signals=np.full(len(times), -1),
        offsets=offsets,
    )


def log_of(*traces, names=(), step=None):
    """A log of traces; its step is the first one's, unless told."""
    times = traces[0].times
    step = step or (float(np.median(np.diff(times))) if len(times) > 1 else 1.0)
    last = max(trace.times[-1] for trace in traces)
    return TrafficLog(traces, tuple(names), float(times[0]), float(last), step)


def smoothed(trace, smoother, *, network=None, names=(), step=None, heading="chord"):
    """The trajectory of one trace."""
    log = log_of(trace, names=names, step=step)
    (found,) = smooth_log(log, smoother=smoother, network=network, types=TYPES, heading=heading)
    return found


def shown(trace, smoother, network=None, names=(), **other):
    """A trajectory as `smoothed` makes it; only `lane` is given the network."""
    return smoothed(
        trace, smoother, network=network if smoother == "lane" else None, names=names, **other
    )


def road(name):
    """A network and the way through it."""
    make, lanes = WAYS[name]
    network = make()
    return network, Way.of(network, lanes)


def stopping(at, brake, speed):
    """s(t) of a drive at a speed that brakes from `at` [s] to a stop."""

    def s(t):
        slowed = np.clip(np.asarray(t) - at, 0.0, speed / brake)
        return 20.0 + speed * (np.minimum(t, at) + slowed) - brake * slowed**2 / 2.0

    return s


NAMES = ("a_0", "a_1")
"""The lanes of `changing`'s road."""


def changing(speed, *, changes=(20.5,), last=40.0, length=1500.0):
    """A drive that jumps to the other lane at some times, as SUMO does."""
    network = straight(length=length)
    times = np.arange(0, last + 0.5, 1.0)
    lanes = np.searchsorted(changes, times) % 2
    along = 10.0 + speed * times
    xy = np.column_stack([along, 3.2 * lanes])
    return network, trace_of(times, xy, 0.0, speed, lanes=lanes, offsets=along)


# Laws --------------------------------------------------------------------------------------


def between(first, second):
    """Angle between directions [rad]."""
    return np.abs((np.asarray(first) - second + np.pi) % (2 * np.pi) - np.pi)


def frames(piece, fps):
    """Frame times of a film within a piece, and its ends."""
    first, last = np.ceil(piece.begin * fps - 1e-6), np.floor(piece.end * fps + 1e-6)
    inner = np.clip(np.arange(first, last + 1) / fps, piece.begin, piece.end)
    return np.unique(np.r_[piece.begin, inner, piece.end])


def logged_speed(trace, times, *, own=False):
    """The log's largest speed at the samples around each step between times, (n - 1,)."""
    moved = np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1)
    shown = np.r_[0.0, moved / np.diff(trace.times)] if len(trace.times) > 1 else np.zeros(1)
    speeds = np.where(np.isfinite(trace.speeds), np.abs(trace.speeds), shown)
    if own:
        speeds = np.maximum(speeds, np.maximum(shown, np.r_[shown[1:], 0.0]))
    first = np.searchsorted(trace.times, times[:-1] + 1e-9, side="right") - 1
    last = np.searchsorted(trace.times, times[1:] - 1e-9, side="left")
    last = np.minimum(last, len(speeds) - 1)
    return np.array([speeds[i : j + 1].max() for i, j in zip(first, last, strict=True)])


def remarked(trajectory, kinds, times):
    """Which steps between times lie in a remark of some kinds, (n - 1,)."""
    inside = np.zeros(len(times) - 1, dtype=bool)
    for remark in trajectory.remarks:
        if remark.kind in kinds:
            inside |= (times[1:] > remark.begin - 1e-6) & (times[:-1] < remark.end + 1e-6)
    return inside


def kinds_of(trajectory):
    """Kinds of remarks."""
    return {remark.kind for remark in trajectory.remarks}


def assert_sound(trajectory, trace, *, fps=25.0, refused=(), turn=180.0, own=False):
    """No NaN, no jump, no spin, nothing backwards, and standing is standing.

    Args:
        refused: Kinds of remarks whose time is exempt from the limit on jumps.
        turn: Largest rate of the heading [deg/s].
        own: Whether steps of the log that are longer than its speeds say count as speeds.
    """
    assert trajectory.pieces
    for piece in trajectory.pieces:
        times = frames(piece, fps)
        motion = piece.sample(times)
        assert motion.alive.all()
        for values in (motion.positions, motion.yaws, motion.pitches, motion.speeds):
            assert np.isfinite(values).all()
        assert np.isfinite(motion.travelled).all()
        assert np.isfinite(piece.trail(times[::5], np.array([0.0, LENGTH, 12.0]))).all()
        assert np.abs(motion.pitches).max() <= STEEPEST + 1e-9
        assert motion.speeds.min() >= 0.0
        if len(times) < 2:
            continue
        backing = remarked(trajectory, {"reversing"}, times)
        assert (np.diff(motion.travelled)[~backing] >= -1e-3).all()
        steps, passed = (
            np.linalg.norm(np.diff(motion.positions[:, :2], axis=0), axis=1),
            np.diff(times),
        )
        excess = steps - 1.5 * logged_speed(trace, times, own=own) * passed - 0.02
        excess[remarked(trajectory, refused, times)] = -1.0
        assert excess.max() <= 1e-9, (
            f"{excess.max():.3f} m too far at {times[excess.argmax()]:.3f} s"
        )
        turns = np.degrees(between(motion.yaws[1:], motion.yaws[:-1]))
        # Two times may lie within a tick of each other at a piece's ends.
        rates = turns / np.maximum(passed, 0.2 / fps)
        assert rates.max() <= turn, f"{rates.max():.0f} deg/s at {times[rates.argmax()]:.3f} s"
        assert_stands(trajectory, motion, trace, times)


def assert_stands(trajectory, motion, trace, times):
    """Between two samples at one place with the same angle nothing moves or turns."""
    parking = np.r_[False, remarked(trajectory, {"parking"}, times)]
    still = (np.linalg.norm(np.diff(trace.positions, axis=0), axis=1) < 1e-9) & (
        between(trace.yaws[1:], trace.yaws[:-1]) < 1e-9
    )
    # The first and the last interval of a stand may still settle from a manoeuvre.
    inner = still[1:-1] & still[:-2] & still[2:]
    for k in np.flatnonzero(inner) + 1:
        inside = (times >= trace.times[k]) & (times <= trace.times[k + 1])
        inside &= ~parking
        if inside.sum() > 1:
            assert np.ptp(motion.positions[inside], axis=0).max() <= 0.002
            assert np.degrees(between(motion.yaws[inside], motion.yaws[inside][0]).max()) <= 0.1


def accelerations(piece, *, fps=25.0):
    """Size of the front's acceleration in the plane at frames, (n,) [m/s2]."""
    count = int(np.floor((piece.end - piece.begin) * fps + 1e-9))
    motion = piece.sample(np.minimum(piece.begin + np.arange(count + 1) / fps, piece.end))
    return np.linalg.norm(np.diff(motion.positions[:, :2], 2, axis=0), axis=1) * fps**2


def logged_acceleration(trace):
    """Largest change of speed of the log: of its places, and of what it calls speed [m/s2]."""
    steps = np.diff(trace.times)
    velocity = np.diff(trace.positions[:, :2], axis=0) / steps[:, None]
    changes = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / ((steps[1:] + steps[:-1]) / 2)
    spoken = np.abs(np.diff(trace.speeds)) / steps
    return max(np.nanmax(np.r_[0.0, changes]), np.nanmax(np.r_[0.0, spoken]))


def sideways(motion, *, step=0.04):
    """Speed of the rear axle across the body at times `step` apart, (n - 1,) [m/s]."""
    ahead = np.column_stack([np.cos(motion.yaws), np.sin(motion.yaws)])
    points = motion.positions[:, :2] - 0.78 * LENGTH * ahead
    middle = ahead[1:] + ahead[:-1]
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    steps = np.diff(points, axis=0)
    return np.abs(steps[:, 1] * middle[:, 0] - steps[:, 0] * middle[:, 1]) / step
