"""Boxes around things in the picture, and around bodies in space.

References:
    Lin et al., "Microsoft COCO: Common Objects in Context", ECCV 2014,
        doi:10.1007/978-3-319-10602-1_48; form of files: https://cocodataset.org/#format-data.
    Geiger, Lenz and Urtasun, "Are we ready for Autonomous Driving? The KITTI Vision Benchmark
        Suite", CVPR 2012, doi:10.1109/CVPR.2012.6248074; form of labels as in its development kit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Transform
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.things import LABELS

SURFACES = frozenset({"road", "sidewalk", "terrain", "ground", "rail track", "sky", "static"})
"""Classes of what has no box: it has no outline of its own, or no class."""

_KITTI: Mapping[str, str] = {
    "bicycle": "Cyclist",
    "car": "Car",
    "motorcycle": "Cyclist",
    "person": "Pedestrian",
    "train": "Tram",
    "truck": "Truck",
}
"""KITTI's words for classes; all others are `Misc`."""

_NEAR = 0.05  # corners of boxes nearer than this before the camera are cut off [m]


@dataclass(frozen=True, slots=True)
class Box2d:
    """The smallest box around all pixels of a thing.

    Attributes:
        name: Of the thing.
        left: First column.
        top: First row.
        right: After the last column.
        bottom: After the last row.
        pixels: How many pixels show it.
    """

    name: str
    left: int
    top: int
    right: int
    bottom: int
    pixels: int


@dataclass(frozen=True, slots=True, eq=False)
class Box3d:
    """A box around a body, or around a unit of a long vehicle; its foot stands on the road.

    Attributes:
        name: Of the road user.
        part: Empty, or which unit it is.
        size: Length, width, height [m].
        world_from_box: Its middle; +x forward, +y left, +z up.
    """

    name: str
    part: str
    size: tuple[float, float, float]
    world_from_box: Transform

    @property
    def corners(self) -> Floats:
        """All corners in the network's coordinates, (8, 3) [m]."""
        signs = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        return self.world_from_box.points(signs * self.size)


def boxes_2d(owner: Ints, names: Sequence[str]) -> tuple[Box2d, ...]:
    """Return the box of every name that some pixel shows, in the names' order.

    Args:
        owner: Number of the name at each pixel, (h, w); 0 has none.
        names: Of things; the first is empty.
    """
    from scipy import ndimage

    counts = np.bincount(owner.ravel(), minlength=len(names))
    found = []
    for number, box in enumerate(ndimage.find_objects(owner.astype(np.int32)), start=1):
        if box is not None:
            rows, columns = box
            edges = (columns.start, rows.start, columns.stop, rows.stop)
            found.append(Box2d(names[number], *edges, int(counts[number])))
    return tuple(found)


def box_3d(name: str, part: str, bounds: Floats, world_from_body: Transform) -> Box3d:
    """Return the box around a body, down to the road.

    Args:
        name: Of the road user.
        part: Which unit it is, or empty.
        bounds: Lowest and highest corner in the body's frame, (2, 3) [m].
        world_from_body: Its placement.
    """
    low, high = np.array(bounds)
    low[2] = min(low[2], 0.0)
    scale = np.linalg.norm(world_from_body.matrix[:3, :3], axis=0)
    matrix = world_from_body.matrix.copy()
    matrix[:3, :3] /= scale
    matrix[:3, 3] = world_from_body.points(0.5 * (low + high)[None])[0]
    length, width, height = ((high - low) * scale).tolist()
    return Box3d(name, part, (length, width, height), Transform(matrix))


def coco_categories() -> list[dict[str, Any]]:
    """Return all classes as COCO lists them."""
    return [{"id": number, "name": name} for name, number in LABELS.items()]


def kitti_line(box: Box3d, seen: Box2d, label: str, view: View, size: tuple[int, int]) -> str:
    """Return a line of a KITTI label file.

    KITTI's boxes turn about the camera's vertical axis alone, so those of a camera that looks up
    or down are not exact; `Box3d` is. How much is hidden is said to be unknown (3).

    Args:
        box: Around the body.
        seen: Around its pixels.
        label: Its class.
        view: Of the camera.
        size: Width, height of the picture [px].
    """
    forward = _camera_axes(box.world_from_box.matrix[:3, 0], view)
    length, width, height = box.size
    foot = box.world_from_box.points(np.array([[0.0, 0.0, -0.5 * height]]))[0]
    x, y, z = _camera_axes(foot - view.position, view)
    turn = float(-np.arctan2(forward[2], forward[0]))
    alpha = (turn - np.arctan2(x, z) + np.pi) % (2.0 * np.pi) - np.pi
    numbers = [height, width, length, x, y, z, turn]
    edges = (seen.left, seen.top, seen.right - 1, seen.bottom - 1)
    return " ".join(
        [
            _KITTI.get(label, "Misc"),
            f"{truncated(box, view, size):.2f} 3 {alpha:.4f}",
            *(f"{edge:.2f}" for edge in edges),
            *(f"{number:.4f}" for number in numbers),
        ]
    )


def kitti_calibration(focal: float, centre: tuple[float, float]) -> str:
    """Return KITTI's calibration of a single camera, with all lines in the order of its files.

    All four cameras are this one. The laser scanner and the inertial unit, which we do not have,
    sit in its eye: forward, left, up.

    Args:
        focal: Focal length [px].
        centre: Column and row of the optical axis [px].
    """
    camera = (focal, 0, centre[0], 0, 0, focal, centre[1], 0, 0, 0, 1, 0)
    lines = {
        **{f"P{k}": camera for k in range(4)},
        "R0_rect": (1, 0, 0, 0, 1, 0, 0, 0, 1),
        "Tr_velo_to_cam": (0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0),
        "Tr_imu_to_velo": (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0),
    }
    return "".join(
        f"{name}: {' '.join(f'{value:.12e}' for value in values)}\n"
        for name, values in lines.items()
    )


def truncated(box: Box3d, view: View, size: tuple[int, int]) -> float:
    """Return the share of a box's rectangle in the picture that lies outside of it, [0, 1]."""
    local = (box.corners - view.position) @ view.world_from_camera.matrix[:3, :3]
    if view.lens.is_straight:
        local[:, 0] = np.maximum(local[:, 0], _NEAR)
    places, _ = view.lens.project(local, size)
    low, high = places.min(axis=1), places.max(axis=1)
    ends = np.array([size[1], size[0]]) - 0.5
    inside = np.maximum(np.minimum(high, ends) - np.maximum(low, -0.5), 0.0)
    return float(1.0 - inside.prod() / max(float((high - low).prod()), 1e-9))


def _camera_axes(vector: Floats, view: View) -> Floats:
    """Return a world vector as KITTI's cameras have it: right, down, forward."""
    forward, left, up = view.world_from_camera.matrix[:3, :3].T @ vector
    return np.array([-left, -up, forward])
