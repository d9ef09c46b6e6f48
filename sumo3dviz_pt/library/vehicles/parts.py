"""What bodies of vehicles consist of: meshes by material, and wheels in their places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sumo3dviz_pt.model.geometry import Mesh

Meshes = Mapping[str, Mesh]
"""Meshes by material."""

MaterialMesh = tuple[str, Mesh]
"""Material and mesh."""


@dataclass(frozen=True, slots=True)
class WheelPlace:
    """Where a wheel turns.

    Attributes:
        at: Its centre in the body's frame [m].
        radius: Of the tyre [m]; `at` lies as high, so that it stands on the ground.
        steered: Whether it steers.
        reversed: Whether the wheel is mounted inside out, as the outer one of a twin pair is.
    """

    at: tuple[float, float, float]
    radius: float
    steered: bool = False
    reversed: bool = False
