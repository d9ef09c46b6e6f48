"""Where things lie in a frame's picture: boxes of bodies, lines on the ground."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.scene import View

NEAREST = 0.3
"""What is nearer than this along the viewing direction is cut off [m]."""

EDGES = (
    *((0, 1), (1, 3), (3, 2), (2, 0)),  # on the ground
    *((4, 5), (5, 7), (7, 6), (6, 4)),  # at the top
    *((0, 4), (1, 5), (2, 6), (3, 7)),  # upright
)
"""Pairs of corners of a box, as `box_corners` counts them."""


def box_corners(pose: Floats, size: Floats) -> Floats:
    """Return the corners of a road user's box, (8, 3) [m].

    Bit 0 of a corner's number says left or right, bit 1 front or rear, bit 2 below or above.

    Args:
        pose: Front's middle on the ground [m], yaw, pitch [rad] and more, (>= 5,).
        size: Length, width, height, (3,) [m].
    """
    length, width, height = size
    local = np.array(
        [[-length * (k >> 1 & 1), width * ((k & 1) - 0.5), height * (k >> 2 & 1)] for k in range(8)]
    )
    yaw, pitch = pose[3], pose[4]
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    axes = np.array([[cy * cp, sy * cp, sp], [-sy, cy, 0.0], [-cy * sp, -sy * sp, cp]])
    return np.asarray(local @ axes + pose[:3])


def in_camera(view: View, points: Floats) -> Floats:
    """Return world points, (..., 3) [m], in the camera's frame."""
    matrix = view.world_from_camera.matrix
    return np.asarray((points - matrix[:3, 3]) @ matrix[:3, :3])


def place_of(view: View, point: Floats, size: tuple[int, int]) -> tuple[float, float] | None:
    """Return row and column of a world point, (3,) [m]; None behind or beside the picture."""
    local = in_camera(view, point)
    if local[0] < NEAREST:
        return None
    (row, column), _ = view.lens.project(local, size)
    width, height = size
    inside = -0.5 <= column <= width - 0.5 and -0.5 <= row <= height - 0.5
    return (float(row), float(column)) if inside else None


def segment(view: View, one: Floats, other: Floats, size: tuple[int, int]) -> Floats | None:
    """Return rows and columns of a line between world points, (2, 2); None if all is behind.

    What lies behind the camera is cut off.
    """
    ends = in_camera(view, np.stack([one, other]))
    near = ends[:, 0] < NEAREST
    if near.all():
        return None
    if near.any():
        share = (NEAREST - ends[0, 0]) / (ends[1, 0] - ends[0, 0])
        ends[int(near[1])] = ends[0] + share * (ends[1] - ends[0])
    return np.asarray(view.lens.project(ends, size)[0].T)


def frame_around(view: View, corners: Floats, size: tuple[int, int]) -> Floats | None:
    """Return top, left, bottom and right of a box in the picture, (4,) [px].

    Args:
        view: The camera.
        corners: Of the box in the world, (8, 3) [m].
        size: Width, height of the picture [px].

    Returns:
        None if the box lies behind the camera or beside the picture; edges that cross the camera's
        plane count from where they do.
    """
    parts = [segment(view, corners[a], corners[b], size) for a, b in EDGES]
    seen = [part for part in parts if part is not None]
    if not seen:
        return None
    points = np.concatenate(seen)
    width, height = size
    top, left = points.min(axis=0)
    bottom, right = points.max(axis=0)
    if bottom < 0 or right < 0 or top > height - 1 or left > width - 1:
        return None
    return np.array([top, left, bottom, right])


def within(view: View, poses: Floats, reach: float) -> Bools:
    """Return which road users are near enough, (n,).

    Args:
        view: The camera.
        poses: As `FrameFacts.poses`, (n, 6).
        reach: [m].
    """
    return np.asarray(np.linalg.norm(poses[:, :3] - view.position, axis=1) <= reach)
