"""Where a shot's camera is and looks, what lies in its view, and when it lets light in.

A shutter answers at which moments a frame is seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.scene import View


@dataclass(frozen=True, slots=True)
class Shutter:
    """A span of time in which light comes in, seen at so many moments.

    Attributes:
        opens: First moment, from the frame's time [s].
        closes: Last moment, from the frame's time [s]; of the picture's first row.
        moments: At how many of its moments a row of the picture is seen.
        rolling: How much later the picture's last row is seen than its first [s].
    """

    opens: float = 0.0
    closes: float = 0.0
    moments: int = 1
    rolling: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a shutter that closes before it opens."""
        if not self.opens <= self.closes:
            raise ValueError(f"a shutter opens at {self.opens} s and closes at {self.closes} s")

    @property
    def is_instant(self) -> bool:
        """Whether all light comes in at one moment."""
        return self.opens == self.closes and self.rolling == 0.0

    @property
    def open_for(self) -> float:
        """How long light comes in [s]."""
        return self.closes - self.opens

    @property
    def lasts(self) -> float:
        """How long after the frame's time the last row is still seen [s]."""
        return self.closes + self.rolling

    @property
    def middle(self) -> float:
        """The middle of the exposure, of the row in the picture's middle [s]."""
        return 0.5 * (self.opens + self.closes + self.rolling)

    def at(self, time: float) -> Shutter:
        """Return the same shutter for the frame of a time [s]."""
        return Shutter(time + self.opens, time + self.closes, self.moments, self.rolling)

    def times(self, count: int) -> tuple[float, ...]:
        """Middles of so many equal parts of the span [s]; a single moment for an instant."""
        if self.opens == self.closes:
            return (self.opens,)
        part = (self.closes - self.opens) / count
        return tuple(self.opens + (number + 0.5) * part for number in range(count))

    def exposures(self) -> tuple[tuple[float, tuple[float, float]], ...]:
        """Return the moments of a frame [s], and which rows are seen then: shares of the height.

        Rows of a rolling shutter are seen in bands, so that every row is seen at `moments` of
        them, in the same steps.
        """
        if self.rolling == 0.0:
            return tuple((moment, (0.0, 1.0)) for moment in self.times(self.moments))
        # Each band of rows is as much later than the one above it as moments lie apart, so that
        # both share moments.
        count = 1 if self.opens == self.closes else self.moments
        span = self.closes - self.opens
        step = span / count if span > 0.0 else self.rolling / max(2, self.moments)
        bands = max(1, math.ceil(self.rolling / step - 1e-9))
        edges = [min(1.0, number * step / self.rolling) for number in range(bands + 1)]
        first = self.opens + (step if span > 0.0 else 0.5 * step)
        return tuple(
            (first + n * step, (edges[max(0, n - count + 1)], edges[min(bands, n + 1)]))
            for n in range(bands + count - 1)
        )


INSTANT = Shutter()
"""What every camera has: nothing blurs because it moves."""


def frame_step(times: Sequence[float] | Floats, *, fps: float) -> float:
    """Return the time from a frame to the next [s].

    Args:
        times: Of a shot's frames, (n,) [s], n >= 1.
        fps: Frames per second, for a shot of a single frame.
    """
    return float(times[1] - times[0]) if len(times) > 1 else 1.0 / fps


_SLOPE = float(np.tan(np.radians(25.0)) * np.hypot(1.0, 9 / 16))
"""Half the diagonal of what a camera of 50 degrees shows one metre ahead [m]."""

AROUND = 60.0
"""What is nearer than this is kept even behind the camera: shadows, reflections [m]."""


_MIRRORED = float(np.radians(42.0))
"""What mirrors show lies within this of their direction: convex ones look far aside [rad]."""

_MIRROR_REACH = 400.0
"""Road users and houses farther behind than this are left out: a car fills two or three pixels of
a plane mirror there [m]."""

_SHRINKS = 2.5
"""How much smaller things look in convex mirrors."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraPath:
    """Where a shot's camera is and looks, over n times.

    Attributes:
        positions: (n, 3) [m].
        forwards: Unit viewing directions, (n, 3).
        half_angles: Half the diagonal opening angle, (n,) [rad].
        parallel: Where rays are parallel: half the diagonal of what they show, (n,) [m]; 0 for
            other cameras. None if all are others.
        behind: Where mirrors in the picture look, unit, (n, 3); 0 where there are none. None if
            there are none at all.
    """

    positions: Floats
    forwards: Floats
    half_angles: Floats
    parallel: Floats | None = None
    behind: Floats | None = None

    @classmethod
    def of(cls, views: Sequence[View], *, aspect: float) -> CameraPath:
        """Collect views; `aspect` is height / width."""
        return cls(
            settled([view.position for view in views]),
            np.stack([view.forward for view in views]),
            np.array([view.lens.half_diagonal(aspect) for view in views]),
            _half_diagonals(views, aspect),
            _behind(views),
        )

    @classmethod
    def all_round(cls, positions: Floats) -> CameraPath:
        """Eyes at positions, (n, 3) [m], that see in all directions."""
        ahead = np.tile([1.0, 0.0, 0.0], (len(positions), 1))
        return cls(positions, ahead, np.full(len(positions), np.pi))

    @classmethod
    def joined(cls, paths: Sequence[CameraPath]) -> CameraPath:
        """Return all views of several paths; at least one."""

        def joint(name: str, usual: Callable[[CameraPath], Floats]) -> Floats | None:
            arrays = [getattr(path, name) for path in paths]
            if all(each is None for each in arrays):
                return None
            some = zip(arrays, paths, strict=True)
            return np.concatenate([usual(path) if v is None else v for v, path in some])

        return cls(
            np.concatenate([path.positions for path in paths]),
            np.concatenate([path.forwards for path in paths]),
            np.concatenate([path.half_angles for path in paths]),
            joint("parallel", lambda path: np.zeros(len(path.positions))),
            joint("behind", lambda path: np.zeros((len(path.positions), 3))),
        )

    @property
    def eyes(self) -> Floats | None:
        """Where the cameras are, (n, 3) [m]; None if they may also look or go anywhere else."""
        anywhere = not len(self.positions) or bool((self.half_angles >= np.pi).any())
        return None if anywhere else self.positions

    def slice(self, part: slice) -> CameraPath:
        """Return some of the times."""
        parallel = None if self.parallel is None else self.parallel[part]
        behind = None if self.behind is None else self.behind[part]
        return CameraPath(
            self.positions[part], self.forwards[part], self.half_angles[part], parallel, behind
        )

    def away(self, points: Floats) -> Floats:
        """Return how far points are from the cameras, by how large they look, (k, n) [m].

        Parallel rays show all things as large, however far away they are: as large as a camera of
        50 degrees that shows as much. What only convex mirrors show looks smaller.

        Args:
            points: One for each time, (k, n, 3) [m].
        """
        away = np.linalg.norm(points - self.positions, axis=-1)
        if self.behind is not None:
            backwards = np.einsum("knc,nc->kn", points - self.positions, self.behind) > 0.0
            away = np.where(backwards & (away > AROUND), AROUND + _SHRINKS * (away - AROUND), away)
        if self.parallel is None:
            return np.asarray(away)
        return np.where(self.parallel > 0.0, self.parallel / _SLOPE, away)


def in_view(camera_path: CameraPath, points: Floats, *, radius: float | Floats) -> Bools:
    """Return which balls can be seen at which times.

    Args:
        camera_path: n times.
        points: Centres, (k, 3) or, one for each time, (k, n, 3) [m].
        radius: Of the balls, shadow included; one, or (k, 1) [m].

    Returns:
        (k, n); also true for what is nearer than `AROUND`, and for what mirrors show
        up to 400 m behind.
    """
    seen = _within(camera_path, points, radius=radius, around=AROUND + radius)
    if camera_path.behind is None:
        return seen
    centres = points[:, None, :] if points.ndim == 2 else points
    near = np.linalg.norm(centres - camera_path.positions, axis=-1) < _MIRROR_REACH + radius
    return np.asarray(seen | (near & in_mirrors(camera_path, points, radius=radius)))


def in_picture(camera_path: CameraPath, points: Floats, *, radius: float | Floats) -> Bools:
    """Return which balls lie in a picture; what is near, but beside or behind, does not count.

    Args:
        camera_path: n times.
        points: Centres, (k, 3) or, one for each time, (k, n, 3) [m].
        radius: Of the balls; one, or (k, 1) [m].

    Returns:
        (k, n).
    """
    return _within(camera_path, points, radius=radius, around=radius)


def in_mirrors(camera_path: CameraPath, points: Floats, *, radius: float | Floats) -> Bools:
    """Return which balls mirrors in the picture show; arguments and result as in `in_picture`."""
    count = len(camera_path.positions)
    if camera_path.behind is None:
        return np.zeros((len(points), count), dtype=np.bool_)
    there = np.linalg.norm(camera_path.behind, axis=-1) > 0.5
    angles = np.full(count, _MIRRORED)
    mirrors = CameraPath(camera_path.positions, camera_path.behind, angles)
    return np.asarray(_within(mirrors, points, radius=radius, around=radius) & there)


def _within(
    camera_path: CameraPath, points: Floats, *, radius: float | Floats, around: float | Floats
) -> Bools:
    """Which balls reach into the viewing cone or lie nearer than a distance, (k, n)."""
    centres = points[:, None, :] if points.ndim == 2 else points
    towards = centres - camera_path.positions
    if camera_path.parallel is not None and (camera_path.parallel > 0.0).all():
        return _within_tube(camera_path, towards, room=around)
    distance = np.linalg.norm(towards, axis=-1)
    with np.errstate(invalid="ignore"):
        cosine = np.einsum("knc,nc->kn", towards, camera_path.forwards) / np.maximum(distance, 1e-9)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        ball = np.arcsin(np.clip(radius / np.maximum(distance, 1e-9), 0.0, 1.0))
        near = settled(distance - around) < 0.0
        return np.asarray(near | (settled(angle - camera_path.half_angles - ball) < 0.0))


def _within_tube(camera_path: CameraPath, towards: Floats, *, room: float | Floats) -> Bools:
    """Which balls reach into what parallel rays show, (k, n).

    Args:
        camera_path: n times.
        towards: From the cameras to the balls' centres, (k, n, 3) [m].
        room: How far the balls' centres may lie outside; one, or (k, 1) [m].
    """
    along = np.einsum("knc,nc->kn", towards, camera_path.forwards)
    aside = np.linalg.norm(towards - along[..., None] * camera_path.forwards, axis=-1)
    assert camera_path.parallel is not None
    inside = settled(aside - camera_path.parallel - room) < 0.0
    return np.asarray(inside & (settled(along + room) > 0.0))


def _half_diagonals(views: Sequence[View], aspect: float) -> Floats | None:
    """Return half the diagonal of what parallel rays show, (n,) [m]; None if there are none."""
    if all(not view.lens.kind.is_parallel for view in views):
        return None
    return np.array([0.5 * view.lens.width * np.hypot(1.0, aspect) for view in views])


def _behind(views: Sequence[View]) -> Floats | None:
    """Return where mirrors look, (n, 3); None if no view has any."""
    if all(view.mirrors is None for view in views):
        return None
    return np.array([np.zeros(3) if view.mirrors is None else view.mirrors for view in views])
