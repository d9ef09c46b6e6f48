"""Cameras that must keep a clear view: nothing grows into them or in front of them.

Trees, houses and street furniture that a scenario does not contain keep clear of cameras.
All cameras of a scene file count in each of its shots, so that every shot, and the viewer,
shows the same world. Cameras that ride do not count: nothing stands where vehicles drive.
Nothing is cleared for a camera that was found by walking through the scene: it shows what
was seen then.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.geometry import Floats, settled

KEEP_CLEAR = 1.0
"""Distance that objects keep from cameras [m]."""

_STAYS = 60.0
"""A camera that moves less shows one place only [m]."""


@dataclass(frozen=True, eq=False)
class Clearance:
    """Cameras that nothing grows into or before.

    Attributes:
        ways: Where each camera is and looks, over its whole way.
    """

    ways: tuple[CameraPath, ...] = ()

    @cached_property
    def places(self) -> Floats:
        """Where cameras are, (n, 3) [m]."""
        return np.concatenate([np.zeros((0, 3)), *(way.positions for way in self.ways)])

    @cached_property
    def tracks(self) -> NDArray[shapely.Geometry]:
        """The ways in plan, as lines, (n,) [m]."""
        lines = [np.repeat(way.positions[:, :2], 2, axis=0) for way in self.ways]
        return np.array([shapely.LineString(line) for line in lines], dtype=object)

    def distances(self, places: Floats) -> Floats:
        """Return the distance in plan of places, (k, 2) [m], to the nearest camera, (k,) [m].

        It is infinite without cameras.
        """
        if not self.ways:
            return np.full(len(places), np.inf)
        away, _ = cKDTree(self.places[:, :2]).query(places)
        return settled(away)

    @cached_property
    def outlooks(self) -> tuple[CameraPath, ...]:
        """The ways of cameras that stay: what they look at must not be hidden."""
        return tuple(w for w in self.ways if np.ptp(w.positions[:, :2], axis=0).max() <= _STAYS)
