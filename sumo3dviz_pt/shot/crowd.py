"""Plans room for a shot's road users: how many bodies of each kind it shows at once.

The renderer's slots are fixed before the first frame, so that nothing compiles later
and no frame can run out of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.cast.drawing import Drawn
from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.scene import Slots
from sumo3dviz_pt.shot.visibility import MOST_NEAR, Choice, choose

MOST_SLOTS = 240
"""Instances in one scene; the cost of recording them grows faster than their number."""

MOST_FULL_MODELS = 8
"""Models in full detail in one shot, at most."""

FULL_TRIANGLES = 54_000
"""Of a car in full detail and one of its wheels: instances count once."""

FAR_TRIANGLES = 110_000
"""Of all stand-ins together; where there are many, they are coarser."""

SHOT_TRIANGLES = 1_450_000
"""Of a whole shot: every update of poses rebuilds the trees over all of them."""


class CrowdFrames(NamedTuple):
    """Cameras and road users in some frames of a shot.

    Attributes:
        camera_path: Where the camera is and looks, in n frames.
        alive: Whether each of k road users exists, (k, n).
        positions: Their fronts, (k, n, 3) [m]; NaN where they do not exist.
    """

    camera_path: CameraPath
    alive: Bools
    positions: Floats


@dataclass(frozen=True, slots=True)
class CrowdPlan:
    """How a shot draws its road users.

    Attributes:
        slots: Room for each body.
        limit: Road users in detail in one frame, at most.
        full_models: Models that are drawn in full detail where they are near enough.
    """

    slots: Slots
    limit: int
    full_models: frozenset[str] = frozenset()


def plan_crowd(
    bodies: Sequence[Drawn],
    frames: Sequence[CrowdFrames],
    *,
    triangles: Mapping[str, int] | None = None,
    budget: int = SHOT_TRIANGLES,
    limit: int = MOST_NEAR,
    full: int | None = None,
) -> CrowdPlan:
    """Find how many bodies of each kind a shot shows at once.

    Args:
        bodies: Of each of the k road users.
        frames: The whole shot.
        triangles: Of each prototype in detail.
        budget: Triangles of all road users; full detail gets what the others leave.
        limit: Road users in detail at once, at most.
        full: Models in full detail, at most, whatever the budget; None is what it leaves.
    """
    plain = _slots(bodies, frames, limit=limit, able=np.zeros(len(bodies), dtype=np.bool_))
    most = _most_full(plain, triangles or {}, budget) if full is None else full
    full_models = _full_models(bodies, frames, most=most)
    able = can_be_full(bodies, full_models)
    while True:
        slots = _slots(bodies, frames, limit=limit, able=able)
        if sum(slots.near.values()) <= MOST_SLOTS or limit <= 8:
            return CrowdPlan(slots, limit, full_models)
        limit = limit * 3 // 4


def can_be_full(bodies: Sequence[Drawn], full_models: frozenset[str]) -> Bools:
    """Return which road users can be drawn in full detail, (k,)."""
    return np.array(
        [bool(body.full) and body.model in full_models for body in bodies], dtype=np.bool_
    )


def fitting(choice: Choice, bodies: Sequence[Drawn], slots: Slots, distances: Floats) -> Choice:
    """Return how road users are drawn in a scene whose slots were planned for other views.

    The nearest get room first. Those without room in detail are drawn by stand-ins, and those
    without any room are not drawn.

    Args:
        choice: What is wanted at one time, (k, 1) each.
        bodies: Of each of the k road users.
        slots: The room that there is.
        distances: From the camera, (k,) [m].
    """
    # Hand out the slots, each road user's finest level first.
    detailed, distant = Counter(slots.detailed), Counter(slots.far)
    levels_found = ("full", "near", "far", "lettered")
    found = {level: np.zeros_like(choice.near) for level in levels_found}
    wanted = choice.near | choice.full | choice.far
    for k in sorted(np.flatnonzero(wanted[:, 0]).tolist(), key=lambda k: float(distances[k])):
        body = bodies[k]
        levels = [("far", body.far, distant)]
        if not choice.far[k, 0]:
            levels.insert(0, ("near", (*body.near, *body.deforming), detailed))
        if choice.full[k, 0]:
            levels.insert(0, ("full", (*body.full, *body.deforming), detailed))
        for level, names, room in levels:
            needed = Counter(names)
            if needed <= room:
                room.subtract(needed)
                found[level][k] = True
                wished = Counter(body.letters if choice.lettered[k, 0] and level != "far" else ())
                if wished and wished <= detailed:
                    detailed.subtract(wished)
                    found["lettered"][k] = True
                break
    return Choice(**found)


def lengths_of(bodies: Sequence[Drawn]) -> Floats:
    """Return the lengths of bodies, (k,) [m]."""
    return np.array([body.length for body in bodies], dtype=np.float64)


def _most_full(slots: Slots, triangles: Mapping[str, int], budget: int) -> int:
    """How many models in full detail the budget allows: instances count once."""
    detailed = sum(triangles.get(name, 0) for name in slots.near)
    detailed += sum(count * triangles.get(name, 0) for name, count in slots.deforming.items())
    spare = budget - FAR_TRIANGLES - detailed
    return int(np.clip(spare // FULL_TRIANGLES, 1, MOST_FULL_MODELS))


def _full_models(
    bodies: Sequence[Drawn], frames: Sequence[CrowdFrames], *, most: int
) -> frozenset[str]:
    """The models that are near enough for full detail in most frames."""
    able = np.array([bool(body.full) for body in bodies], dtype=np.bool_)
    seen: Counter[str] = Counter()
    for camera_path, alive, positions in frames:
        choice = choose(
            camera_path,
            alive,
            positions,
            limit=MOST_NEAR,
            can_be_full=able,
            lengths=lengths_of(bodies),
        )
        for k in np.flatnonzero(choice.full.any(axis=1)).tolist():
            seen[bodies[k].model] += int(choice.full[k].sum())
    ranked = sorted(seen, key=lambda model: (-seen[model], model))
    return frozenset(ranked[:most])


def _slots(
    bodies: Sequence[Drawn], frames: Sequence[CrowdFrames], *, limit: int, able: Bools
) -> Slots:
    """The most bodies of each kind at once."""
    near, far, full, moving, letters = (
        _Members.of([getattr(body, level) for body in bodies])
        for level in ("near", "far", "full", "deforming", "letters")
    )
    lengths = lengths_of(bodies)
    rigid: Counter[str] = Counter()
    deforming: Counter[str] = Counter()
    distant: Counter[str] = Counter()
    instanced: Counter[str] = Counter()
    for camera_path, alive, positions in frames:
        choice: Choice = choose(
            camera_path, alive, positions, limit=limit, can_be_full=able, lengths=lengths
        )
        rigid |= near.most(choice.near)
        deforming |= moving.most(choice.near | choice.full) | letters.most(choice.lettered)
        distant |= far.most(choice.far)
        instanced |= full.most(choice.full)
    return Slots(_sorted(rigid + instanced), _sorted(distant), _sorted(deforming))


@dataclass(frozen=True, slots=True, eq=False)
class _Members:
    """How many bodies of each prototype road users are drawn with.

    Attributes:
        names: Of the m prototypes.
        counts: Of each prototype for each road user, (m, k).
    """

    names: tuple[str, ...]
    counts: Floats

    @classmethod
    def of(cls, drawn: Sequence[tuple[str, ...]]) -> _Members:
        """Count the names of the prototypes of each road user."""
        names = sorted({name for some in drawn for name in some})
        index = {name: row for row, name in enumerate(names)}
        counts = np.zeros((len(names), len(drawn)))
        for column, some in enumerate(drawn):
            for name in some:
                counts[index[name], column] += 1.0
        return cls(tuple(names), counts)

    def most(self, chosen: Bools) -> Counter[str]:
        """Most bodies at once, by name, where the road users are chosen, (k, n)."""
        if not chosen.any():
            return Counter()
        most = (self.counts @ chosen).max(axis=1)
        return Counter({name: int(n) for name, n in zip(self.names, most, strict=True) if n})


def _sorted(counts: Mapping[str, int]) -> dict[str, int]:
    """By name, so that the order of frames does not matter."""
    return {name: counts[name] for name in sorted(counts)}
