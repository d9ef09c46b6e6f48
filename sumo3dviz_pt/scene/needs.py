"""Decides what a shot needs: what some camera can see, or what can cast light into it.

Everything here is a pure function of the whole shot, never of what was rendered
before, so that any part of a film can be rendered alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.scene import Slots, View

AROUND = 60.0
"""What is nearer than this is kept even behind the camera: shadows, reflections [m]."""

FAR_END = 3000.0
"""Road users farther than this are smaller than a pixel in haze [m]."""

NEAR_END = 250.0
"""Farther road users are drawn by their stand-ins [m]."""

MOST_NEAR = 120
"""Road users in detail in one frame, at most."""

MOST_SLOTS = 240
"""Instances in one scene; the cost of recording them grows faster than their number."""

_CHUNK = 200


@dataclass(frozen=True, slots=True, eq=False)
class Gaze:
    """Where a shot's camera is and looks, over n times.

    Attributes:
        positions: (n, 3) [m].
        forwards: Unit viewing directions, (n, 3).
        half_angles: Half the diagonal opening angle, (n,) [rad].
    """

    positions: Floats
    forwards: Floats
    half_angles: Floats

    @classmethod
    def of(cls, views: Sequence[View], *, aspect: float) -> Gaze:
        """Collect views; `aspect` is height / width."""
        half = np.tan(np.array([view.fov for view in views]) / 2) * np.hypot(1.0, aspect)
        return cls(
            np.stack([view.position for view in views]),
            np.stack([view.forward for view in views]),
            np.arctan(half),
        )

    def slice(self, part: slice) -> Gaze:
        """Some of the times."""
        return Gaze(self.positions[part], self.forwards[part], self.half_angles[part])


def in_view(gaze: Gaze, points: Floats, *, radius: float) -> Bools:
    """Which balls can be seen at which times.

    Args:
        gaze: n times.
        points: Centres, (k, 3) or, one for each time, (k, n, 3) [m].
        radius: Of the balls, shadow included [m].

    Returns:
        (k, n); also true for what is nearer than `AROUND`.
    """
    centres = points[:, None, :] if points.ndim == 2 else points
    towards = centres - gaze.positions
    distance = np.linalg.norm(towards, axis=-1)
    with np.errstate(invalid="ignore"):
        cosine = np.einsum("knc,nc->kn", towards, gaze.forwards) / np.maximum(distance, 1e-9)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        ball = np.arcsin(np.clip(radius / np.maximum(distance, 1e-9), 0.0, 1.0))
        return np.asarray((distance < AROUND + radius) | (angle < gaze.half_angles + ball))


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """Which road users are drawn how, (k, n) each.

    Attributes:
        near: In detail.
        far: By their stand-ins.
    """

    near: Bools
    far: Bools


def choose(gaze: Gaze, alive: Bools, positions: Floats, *, limit: int) -> Choice:
    """Choose the nearest visible road users for detail and the others for stand-ins.

    Args:
        gaze: n times.
        alive: (k, n).
        positions: (k, n, 3) [m]; anything where not alive.
        limit: How many are drawn in detail at once, at most.
    """
    places = np.where(alive[..., None], positions, 1e9)
    distance = np.linalg.norm(places - gaze.positions, axis=-1)
    # 40 m covers a long vehicle and its shadow at most hours of the day.
    shown = alive & (distance < FAR_END) & in_view(gaze, places, radius=40.0)
    ranked = np.where(shown & (distance < NEAR_END), distance, np.inf)
    order = np.argsort(ranked, axis=0, kind="stable")
    rank = np.empty_like(order)
    np.put_along_axis(rank, order, np.arange(len(order))[:, None], axis=0)
    near = np.isfinite(ranked) & (rank < limit)
    return Choice(near, shown & ~near)


@dataclass(frozen=True, slots=True)
class CrowdPlan:
    """How a shot draws its road users.

    Attributes:
        slots: Room for each body.
        limit: Road users in detail in one frame, at most.
    """

    slots: Slots
    limit: int


def plan_crowd(bodies: Sequence[str], frames: Sequence[tuple[Gaze, Bools, Floats]]) -> CrowdPlan:
    """Find how many bodies of each kind a shot shows at once.

    Args:
        bodies: Prototype of each of the k road users.
        frames: Stretches of the shot: gaze, alive (k, n), positions (k, n, 3).
    """
    limit = MOST_NEAR
    while True:
        near, far = _counts(bodies, frames, limit)
        if sum(near.values()) <= MOST_SLOTS or limit <= 8:
            return CrowdPlan(Slots(near, far), limit)
        limit = limit * 3 // 4


def _counts(
    bodies: Sequence[str], frames: Sequence[tuple[Gaze, Bools, Floats]], limit: int
) -> tuple[Mapping[str, int], Mapping[str, int]]:
    """Most bodies of each kind at once, near and far."""
    names = sorted(set(bodies))
    index = np.array([names.index(body) for body in bodies], dtype=np.int64)
    member = np.zeros((len(names), len(bodies)))
    member[index, np.arange(len(bodies))] = 1.0
    most = np.zeros((2, len(names)))
    for gaze, alive, positions in frames:
        choice = choose(gaze, alive, positions, limit=limit)
        for row, chosen in enumerate((choice.near, choice.far)):
            if chosen.shape[1]:
                most[row] = np.maximum(most[row], (member @ chosen).max(axis=1))
    near, far = (
        {name: int(count) for name, count in zip(names, row, strict=True) if count} for row in most
    )
    return near, far


def chunks(count: int) -> Iterator[slice]:
    """Stretches of a shot that fit into memory."""
    for first in range(0, count, _CHUNK):
        yield slice(first, min(first + _CHUNK, count))
