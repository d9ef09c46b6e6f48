"""What a film's account says of its road users: bodies, colours, motion, lamps.

Two films show the same traffic if these are the same; motion is told by digests, because the
places of a hundred road users in a thousand frames would be most of the account.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sumo3dviz_pt.model.scene import FrameState, Mover

_STEP = 1.0e-4
"""Placements count to a tenth of a millimetre: processors differ in the last bits [m]."""


@dataclass(slots=True)
class _Kept:
    """What is known of one road user so far."""

    body: str
    colour: tuple[float, ...]
    first: int
    last: int = 0
    lit: list[tuple[int, list[str]]] = field(default_factory=list)
    motion: Any = field(default_factory=lambda: hashlib.blake2b(digest_size=8))


@dataclass(slots=True)
class RoadUsers:
    """Collects what frames show of road users, in their order."""

    _known: dict[str, _Kept] = field(default_factory=dict)

    def add(self, number: int, frame: FrameState) -> str:
        """Take a frame; return a digest of where everyone is, and in which pose.

        Args:
            number: The frame's.
            frame: What it shows.
        """
        whole = hashlib.blake2b(digest_size=8)
        for mover in sorted(frame.everyone, key=lambda each: (each.id, each.part)):
            where = _placement(mover)
            whole.update(where)
            # The part without a name, if there is one, comes first: it is the body.
            kept = self._seen(number, mover)
            kept.motion.update(f"{number}:".encode() + where)
        return whole.hexdigest()

    def account(self) -> dict[str, Any]:
        """Return what is known of each, by id; `lamps` has the frames at which lamps change."""
        return {
            key: {
                "body": kept.body,
                "colour": list(kept.colour),
                "frames": [kept.first, kept.last],
                "motion": kept.motion.hexdigest(),
                "lamps": [{"frame": number, "lit": lit} for number, lit in kept.lit],
            }
            for key, kept in sorted(self._known.items())
        }

    def _seen(self, number: int, mover: Mover) -> _Kept:
        """Note that a road user is there, and which of its lamps shine."""
        colour = tuple(round(float(value), 6) for value in mover.colour)
        made = _Kept(_body(mover.prototype), colour, number)
        kept = self._known.setdefault(mover.id, made)
        kept.last, lit = number, sorted(mover.lit)
        if not kept.lit or kept.lit[-1][1] != lit:
            kept.lit.append((number, lit))
        return kept


def brake_onsets(lamps: Iterable[Any]) -> list[int]:
    """Return the frames at which brake lamps begin to shine, by a road user's `lamps`.

    Those that shine in the first frame have begun before.
    """
    found, shone = [], True
    for change in lamps:
        shines = "brake" in change["lit"]
        if shines and not shone:
            found.append(int(change["frame"]))
        shone = shines
    return found


def _body(prototype: str) -> str:
    """Return the model that a body is of, at whatever level of detail it is drawn."""
    return prototype.partition("/")[0]


def _placement(mover: Mover) -> bytes:
    """Return who stands where in which pose, for a digest."""
    steps = np.floor(mover.world_from_body.matrix[:3] / _STEP + 0.5)
    pose = f"{mover.name}|{mover.phase:.4f}|{mover.effort:.4f}|"
    return pose.encode() + steps.astype(np.int64).tobytes()
