"""Bodies on the road: motion pieces made of legs; in each leg a body drives only one way.

A leg drives forward, backs up, or moves aside into or out of a parking place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Remark
from sumo3dviz_pt.motion.driven import (
    STEEPEST,
    Driven,
    Heading,
    UnitPath,
    chord,
    chords,
    logged,
    slopes_of,
    tractrix,
)
from sumo3dviz_pt.motion.front import Front, Hermite
from sumo3dviz_pt.motion.manoeuvres import ManoeuvreStretch, settled, stretches
from sumo3dviz_pt.motion.samples import LoggedSamples, wrapped
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.hermite import CurveFront
from sumo3dviz_pt.motion.smoothers.registry import Smoother


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A stretch of motion in which the body drives either forward or backward.

    Attributes:
        driven: The path of its front.
        headings: Yaw and pitch over time, (n, 2) [rad]; None where the front has its own.
        follows: Whether the body follows its front.
        start: Distance travelled before it [m].
        sense: -1 where it backs up, else 1.
        units: The path that its units follow; None where that is its front's.
    """

    driven: Driven
    headings: Hermite | None
    follows: bool = True
    start: float = 0.0
    sense: float = 1.0
    units: UnitPath | None = None

    @property
    def front(self) -> Front:
        """The motion of its front."""
        return self.driven.front

    @property
    def travelled(self) -> float:
        """Distance travelled at its end [m]."""
        return self.start + self.sense * float(self.driven.travelled[-1])

    def sample(self, times: Floats) -> Motion:
        """Return the motion at times within it, (n,) [s]."""
        motion = self.front.at(times)
        travelled = self.driven.travelled_at(times, motion.positions)
        yaws, pitches = motion.yaws, motion.pitches
        if self.headings is not None:
            yaws, pitches = self.headings.at(times)[0].T
        assert yaws is not None and pitches is not None
        return Motion(
            np.ones(len(times), dtype=np.bool_),
            motion.positions,
            wrapped(yaws),
            pitches,
            motion.speeds,
            self.start + self.sense * travelled,
        )

    def trail(self, times: Floats, distances: Floats) -> Floats:
        """Return points behind its front, (n, k, 3) [m]; see `MotionPiece.trail`."""
        places = self.front.at(times).positions
        # A body that does not follow its front has straight points behind it.
        if not self.follows and self.headings is not None:
            yaws = self.headings.at(times)[0][:, 0]
            ahead = np.stack([np.cos(yaws), np.sin(yaws), np.zeros(len(yaws))], axis=1)
            return np.asarray(places[:, None] - distances[None, :, None] * ahead[:, None])
        travelled = self.driven.travelled_at(times, places)
        ways = travelled[:, None] - distances
        points = self.driven.points_at(ways.ravel()).reshape(*ways.shape, 3)
        return points if self.units is None else self.units.straightened(points, travelled, ways)


@dataclass(frozen=True, slots=True, eq=False)
class LegsPiece:
    """One unbroken stretch of motion.

    Attributes:
        legs: Legs in time order; each begins where the one before it ends.
    """

    legs: tuple[Leg, ...]

    @property
    def begin(self) -> float:
        """First sample's time [s]."""
        return self.legs[0].front.begin

    @property
    def end(self) -> float:
        """Last sample's time [s]."""
        return self.legs[-1].front.end

    def sample(self, times: Floats) -> Motion:
        """Return the motion at times within [begin, end], (n,) [s]."""
        if len(self.legs) == 1:
            return self.legs[0].sample(times)
        parts = [(inside, leg.sample(times[inside])) for inside, leg in self._legs_at(times)]
        order = np.argsort(np.concatenate([inside for inside, _ in parts]), kind="stable")
        names = ("alive", "positions", "yaws", "pitches", "speeds", "travelled")
        return Motion(
            *(np.concatenate([getattr(part, name) for _, part in parts])[order] for name in names)
        )

    def trail(self, times: Floats, distances: Floats) -> Floats:
        """Return points behind the front, (n, k, 3) [m]; see `MotionPiece.trail`."""
        points = np.empty((len(times), len(distances), 3))
        for inside, leg in self._legs_at(times):
            points[inside] = leg.trail(times[inside], distances)
        return points

    def _legs_at(self, times: Floats) -> list[tuple[np.ndarray, Leg]]:
        """Return the legs that cover any of the times, each with the indices of these times."""
        joints = np.array([leg.front.begin for leg in self.legs[1:]])
        which = np.searchsorted(joints, times, side="right")
        return [(np.flatnonzero(which == n), self.legs[n]) for n in np.unique(which).tolist()]


@dataclass(frozen=True, slots=True, eq=False)
class StandingPiece:
    """A single sample: the road user exists at exactly that time.

    Attributes:
        samples: The one sample.
    """

    samples: LoggedSamples

    @property
    def begin(self) -> float:
        """The sample's time [s]."""
        return float(self.samples.times[0])

    @property
    def end(self) -> float:
        """The sample's time [s]."""
        return self.begin

    def sample(self, times: Floats) -> Motion:
        """Return the logged pose, standing, at each of the times, (n,) [s]."""
        count = len(times)
        return Motion(
            np.ones(count, dtype=np.bool_),
            np.repeat(self.samples.positions, count, axis=0),
            wrapped(np.repeat(self.samples.yaws, count)),
            np.repeat(self.samples.slopes, count),
            np.zeros(count),
            np.zeros(count),
        )

    def trail(self, times: Floats, distances: Floats) -> Floats:
        """Return points straight behind the front, (n, k, 3) [m]."""
        yaw, slope = float(self.samples.yaws[0]), float(self.samples.slopes[0])
        ahead = np.array([np.cos(yaw), np.sin(yaw), np.tan(slope)])
        points = self.samples.positions[0] - distances[:, None] * ahead
        return np.repeat(points[None], len(times), axis=0)


def make_piece(
    samples: LoggedSamples, smoother: Smoother, setting: Setting, *, heading: Heading
) -> tuple[MotionPiece, tuple[Remark, ...]]:
    """Return the motion of one unbroken stretch of samples, and what was noticed.

    Args:
        samples: The samples, at least one.
        smoother: Makes the motion of the front.
        setting: What is known besides the samples.
        heading: How the body follows its front.
    """
    # A single sample stands, and some smoothers have headings of their own.
    if len(samples.times) == 1:
        return StandingPiece(samples), ()
    if not smoother.raw:
        samples = settled(samples)
    if smoother.heads:
        front = smoother.make(samples, setting)
        yaw = float(samples.yaws[0])
        driven = Driven.of(front, samples, length=setting.length, yaw=yaw)
        units = _units(driven, samples, setting)
        return LegsPiece((Leg(driven, None, units=units),)), front.remarks
    # Every other motion is cut where its way of driving changes.
    legs: list[Leg] = []
    remarks: list[Remark] = []
    parts = stretches(samples, kind=setting.kind)
    parked = [False, *(stretch.kind == "parking" for stretch in parts), False]
    for number, stretch in enumerate(parts):
        # Before and after a move into or out of a parking place the vehicle stands.
        here = replace(setting, rests=(parked[number], parked[number + 2]))
        leg, steep = _leg(stretch, smoother, here, heading, legs[-1] if legs else None)
        legs.append(leg)
        remarks += [*leg.front.remarks, *_manoeuvre(stretch), *steep]
    return LegsPiece(tuple(legs)), tuple(remarks)


def _leg(
    stretch: ManoeuvreStretch,
    smoother: Smoother,
    setting: Setting,
    heading: Heading,
    before: Leg | None,
) -> tuple[Leg, tuple[Remark, ...]]:
    """Return a leg that begins as the one before it ends, and remarks on too steep slopes."""
    # Make the motion of the front, and the path that it drove.
    samples = stretch.samples
    parking = stretch.kind == "parking"
    front = _aside(samples) if parking else smoother.make(samples, setting)
    yaw, start = float(samples.yaws[0]), 0.0
    if before is not None:
        yaw, start = float(before.sample(np.array([front.begin])).yaws[0]), before.travelled
    driven = Driven.of(front, samples, length=setting.length, yaw=yaw)
    # Choose the headings: the log's in manoeuvres and of people, else those behind the front.
    if stretch.kind:
        headings = logged(samples, yaw=yaw, at_once=parking)
        sense = -1.0 if stretch.kind == "reversing" else 1.0
        return Leg(driven, headings, follows=False, start=start, sense=sense), ()
    if setting.kind == "person":
        # People turn and step aside on the spot.
        return Leg(driven, logged(samples, yaw=yaw, at_once=False), start=start), ()
    ahead = chords(driven, setting.length)
    if heading == "tractrix":
        headings = tractrix(driven, ahead, setting.length, yaw=yaw)
    else:
        headings = chord(driven, ahead, samples, setting.length)
    units = _units(driven, samples, setting)
    return Leg(driven, headings, start=start, units=units), _steep(driven, ahead)


def _units(driven: Driven, samples: LoggedSamples, setting: Setting) -> UnitPath | None:
    """Return the path that a vehicle's units follow, unless it is the driven one."""
    # Wheels stay on the rails whatever the log's angle.
    if setting.railed or setting.kind != "vehicle":
        return None
    return UnitPath(driven, samples, setting.length)


def _aside(samples: LoggedSamples) -> Front:
    """Return a move from place to place that begins and ends at rest."""
    return CurveFront(Hermite(samples.times, samples.positions, np.zeros_like(samples.positions)))


def _manoeuvre(stretch: ManoeuvreStretch) -> tuple[Remark, ...]:
    """Return a remark on a manoeuvre; ordinary driving gets none."""
    if not stretch.kind:
        return ()
    samples = stretch.samples
    moved = float(np.linalg.norm(samples.positions[-1, :2] - samples.positions[0, :2]))
    return (Remark(stretch.kind, float(samples.times[0]), float(samples.times[-1]), moved),)


def _steep(driven: Driven, ahead: Floats) -> tuple[Remark, ...]:
    """Return a remark on slopes that are steeper than shown, if there are any."""
    slopes = np.abs(slopes_of(ahead))
    steep = np.flatnonzero(slopes > STEEPEST)
    if not len(steep):
        return ()
    times = driven.knots[steep]
    return (Remark("steep", float(times[0]), float(times[-1]), float(slopes.max())),)
