"""Where on a surface weather acts, and how far rain and snow reach it there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.kernel.rows import Kind

_CABIN = 3.0
"""What moves and lies nearer than this to where a ray starts may be the inside of a cabin [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """A place on a surface, as arrays of Dr.Jit.

    Attributes:
        p: Relative to the renderer's origin [m].
        own: Where patterns are read that move with the surface [m].
        normal: Unit shading normal.
        wi: Unit direction to where the ray came from, in the world.
        away: Distance along the ray [m].
        kind: What is special about the material.
        moves: Whether the surface moves.
        rigid: Whether it moves without changing its shape.
        parked: Whether it could move, but never does.
        active: Which lanes count.
    """

    p: Any
    own: Any
    normal: Any
    wi: Any
    away: Any
    kind: Any
    moves: Any
    rigid: Any
    parked: Any
    active: Any

    @property
    def inside(self) -> Any:
        """Whether it may lie in a cabin in which the camera rides: no weather gets there."""
        return self.moves & (self.away < _CABIN)

    def has(self, what: Kind) -> Any:
        """Return whether the material is any of some kinds."""
        return (self.kind & int(what)) != 0


@dataclass(frozen=True, slots=True, eq=False)
class Exposure:
    """How far rain and snow reach a place, as arrays of Dr.Jit.

    Attributes:
        place: In coordinates that repeat, for patterns [m].
        open: How far it lies under the sky, in [0, 1].
        up: Vertical part of its normal; leaves have two sides.
        low: How low the ground lies there.
        rut: How deep in a rut of wheels it lies, in [0, 1].
        above: Height over what is seen from above, bare of leaves [m].
        leaf: Whether it is a leaf.
        pixel: Angle of a pixel [rad].
        tracks: How much snow wheels took away and made dirty, and the slopes of the former
            towards the east and the north [1/m]; None where there are no tracks.
    """

    place: Any
    open: Any
    up: Any
    low: Any
    rut: Any
    above: Any
    leaf: Any
    pixel: Any
    tracks: tuple[Any, Any, Any, Any] | None = None

    def paved(self, spot: Spot, what: Kind) -> Any:
        """Return whether a place is level ground that is paved in some way."""
        return spot.has(what) & (self.up > 0.8) & ~spot.moves


def soft(value: Any) -> Any:
    """Return a value, cut to [0, 1], with soft ends."""
    share = dr.clip(value, 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def number(value: float) -> Any:
    """Return a number that is no part of the kernel's code."""
    return dr.opaque(mi.Float, float(value))
