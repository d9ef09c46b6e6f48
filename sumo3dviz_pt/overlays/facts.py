"""What overlays are drawn from: the views, road users and lanes of a film, as values and JSON.

They lie beside the stored frames, so that a film can be developed again with its overlays and
without its simulation. Boxes of bodies and lines on the ground are placed in a frame's picture.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sumo3dviz_pt.job.overlays import OverlaySettings
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Transform, frozen
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View

_DIGITS = 4  # of metres and radians: a tenth of a millimetre
_EXACT = 12  # of a camera's direction


@dataclass(frozen=True, slots=True, eq=False)
class FrameFacts:
    """What one frame shows.

    Attributes:
        time: SUMO's [s].
        view: The camera.
        users: Rows of `FilmFacts.keys`, (n,).
        poses: Front's middle on the ground [m], yaw, pitch [rad] and speed [m/s], (n, 6).
        around: Everyone on the map: x, y [m], yaw [rad], length, width [m], speed [m/s], (k, 6).
    """

    time: float
    view: View
    users: Ints
    poses: Floats
    around: Floats


@dataclass(frozen=True, slots=True, eq=False)
class FilmFacts:
    """What a film shows.

    Attributes:
        settings: Which overlays it has.
        size: Width, height [px].
        rate: Frames per second of film.
        keys: Of all road users that a frame names, such as `vehicle:flow_0.3`.
        sizes: Their length, width and height, (v, 3) [m].
        ridden: Key of the road user that the camera rides with, or empty.
        frames: All of the film's.
        paths: Where those with trails drove, by key: time [s], place [m], speed [m/s], (n, 5).
        lanes: Centre lines of the map, (n, 2) each [m].
        widths: Of these lanes [m].
        inside: Whether the camera sits in the one that it rides with.
    """

    settings: OverlaySettings
    size: tuple[int, int]
    rate: float
    keys: Sequence[str]
    sizes: Floats
    ridden: str
    frames: Sequence[FrameFacts]
    paths: Mapping[str, Floats] = field(default_factory=dict)
    lanes: Sequence[Floats] = ()
    widths: Sequence[float] = ()
    inside: bool = False

    @property
    def seconds(self) -> float:
        """Length of the film, without what stands before and after [s]."""
        return len(self.frames) / self.rate

    def film_time(self, number: int) -> float:
        """Return the film's time of a frame [s]."""
        return number / self.rate


def named(key: str) -> str:
    """Return SUMO's id of a road user's key."""
    return key.partition(":")[2] or key


def facts_text(film: FilmFacts) -> str:
    """Return facts as JSON."""
    return json.dumps(
        {
            "settings": film.settings.model_dump(mode="json", by_alias=True),
            "size": list(film.size),
            "rate": film.rate,
            "keys": list(film.keys),
            "sizes": _rounded(film.sizes),
            "ridden": film.ridden,
            "inside": film.inside,
            "frames": [_plain(frame) for frame in film.frames],
            "paths": {key: _rounded(path) for key, path in film.paths.items()},
            "lanes": [_rounded(lane, 2) for lane in film.lanes],
            "widths": [round(width, 2) for width in film.widths],
        }
    )


def facts_of(text: str | bytes) -> FilmFacts:
    """Return facts from their JSON.

    Raises:
        ValueError: If the text is damaged.
    """
    try:
        content = json.loads(text)
        width, height = content["size"]
        return FilmFacts(
            OverlaySettings.model_validate(content["settings"]),
            (int(width), int(height)),
            float(content["rate"]),
            tuple(map(str, content["keys"])),
            frozen(content["sizes"]).reshape(-1, 3),
            str(content["ridden"]),
            tuple(_frame(frame) for frame in content["frames"]),
            {key: frozen(path).reshape(-1, 5) for key, path in content["paths"].items()},
            tuple(frozen(lane).reshape(-1, 2) for lane in content["lanes"]),
            tuple(map(float, content["widths"])),
            bool(content["inside"]),
        )
    except (KeyError, TypeError) as error:
        raise ValueError(f"does not say what overlays show ({error})") from error


def _plain(frame: FrameFacts) -> dict[str, Any]:
    """Return what a frame shows as plain values."""
    return {
        "time": frame.time,
        "camera": _rounded(frame.view.world_from_camera.matrix[:3], _EXACT),
        "lens": frame.view.lens.as_dict(),
        "users": frame.users.tolist(),
        "poses": _rounded(frame.poses),
        "around": _rounded(frame.around, 2),
    }


def _frame(content: Mapping[str, Any]) -> FrameFacts:
    """Return a frame from plain values."""
    matrix = np.eye(4)
    matrix[:3] = content["camera"]
    return FrameFacts(
        float(content["time"]),
        View(Transform(matrix), Lens.from_dict(content["lens"])),
        frozen(content["users"], np.int64),
        frozen(content["poses"]).reshape(-1, 6),
        frozen(content["around"]).reshape(-1, 6),
    )


def _rounded(values: Floats, digits: int = _DIGITS) -> list[Any]:
    """Return numbers without more digits than they need."""
    plain: list[Any] = np.round(values, digits).tolist()
    return plain


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
