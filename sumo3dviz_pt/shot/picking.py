"""Finds the road user at a point of a picture: the one whose box the ray meets first.

Boxes are as long, wide and high as what is drawn; vehicles that bend have one for each of
their units. A box that holds the surface seen there comes first, then any box in front of
that, and last a box that the point misses by little: people far away are a few pixels wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.cast.articulation import rigid_frames, unit_frames
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.cast.pose_sampler import links_of
from sumo3dviz_pt.cast.presence import Present
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View

_LEAST = 1.0
"""Boxes can be clicked as if their sides were at least this long [m]."""

_LEAST_SHARE = 0.03
"""Boxes can be clicked as if their sides took at least this share of the picture's width."""

_MIRRORS = 0.25
"""Things that stand out of a box by no more than this belong to it, such as mirrors [m]."""

_SLACK, _SLACK_SHARE = 0.3, 0.01
"""How far a surface may lie in front of a box [m], and how much more per metre of distance."""

_PARALLEL = 1e-12
"""A ray this parallel to a side of a box is taken as a little oblique."""


@dataclass(frozen=True, slots=True, eq=False)
class _Ray:
    """A ray from the eye: (3,) [m] and a unit direction, (3,)."""

    origin: Floats
    direction: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Boxes:
    """Boxes on the ground, fronts' middles at their origins, unscaled.

    Attributes:
        users: Index of the road user of each, (b,).
        frames: (b, 4, 4).
        sizes: Length, width, height, (b, 3) [m].
    """

    users: Ints
    frames: Floats
    sizes: Floats


def pick(
    present: Present,
    fleet: Fleet,
    view: View,
    point: tuple[float, float],
    *,
    aspect: float,
    distance: float = np.inf,
) -> str | None:
    """Find the road user that is seen at a point of a picture.

    Args:
        present: Everyone at the picture's time.
        fleet: What they show.
        view: The camera; road users around it are not found.
        point: From the left and from the top, in [0, 1].
        aspect: Height / width of the picture.
        distance: Along the ray to the surface that is seen there [m]; road users behind it are
            not found.

    Returns:
        The road user's key, such as `vehicle:flow_0.3`, or None.
    """
    ray = _ray(view, point, aspect)
    boxes = _boxes(present, fleet, _near(present, fleet, ray, view.lens))
    margins = _margins(boxes, ray, view.lens)
    # Cross the boxes as they are, and a little larger.
    slack = _SLACK + _SLACK_SHARE * distance
    enter, leave = _crossed(ray, boxes, np.zeros_like(margins))
    widely, left = _crossed(ray, boxes, margins)
    near_by = (widely > 0.0) & (widely <= left) & (widely <= distance + slack)
    hit = near_by & (enter <= leave) & (enter <= distance + slack)
    seen = hit & (leave + slack >= distance)
    # Take the nearest of the best kind of hit.
    for found, depths in ((seen, enter), (hit, enter), (near_by, widely)):
        if found.any():
            first = int(np.argmin(np.where(found, depths, np.inf)))
            return fleet.trajectories[int(boxes.users[first])].key
    return None


def _ray(view: View, point: tuple[float, float], aspect: float) -> _Ray:
    """The ray through a point of the picture."""
    direction = view.world_from_camera.directions(view.lens.ray(point, aspect)[None])[0]
    return _Ray(view.position, direction)


def _near(present: Present, fleet: Fleet, ray: _Ray, lens: Lens) -> Ints:
    """Rows of those that the ray may meet: it passes no farther away than they reach."""
    to_front = present.positions - ray.origin
    along = to_front @ ray.direction
    aside = np.linalg.norm(to_front - np.maximum(along, 0.0)[:, None] * ray.direction, axis=1)
    away = np.linalg.norm(to_front, axis=1)
    widest = np.array([max(fleet.bodies[k].size[1:]) for k in present.users.tolist()])
    reach = np.hypot(fleet.lengths[present.users], np.hypot(widest, widest))
    return np.flatnonzero(aside <= reach + _least(away, lens))


def _least(away: Floats, lens: Lens) -> Floats:
    """How long sides of boxes must be to be clicked, by their distances, (b,) [m]."""
    return np.asarray(np.maximum(_LEAST, lens.length_of(_LEAST_SHARE, away)))


def _margins(boxes: _Boxes, ray: _Ray, lens: Lens) -> Floats:
    """What boxes are enlarged by on each side, small ones more, (b, 3) [m]."""
    away = np.linalg.norm(boxes.frames[:, :3, 3] - ray.origin, axis=1)
    return np.maximum((_least(away, lens)[:, None] - boxes.sizes) / 2.0, _MIRRORS)


def _boxes(present: Present, fleet: Fleet, rows: Ints) -> _Boxes:
    """Boxes of some of those who exist at a time."""
    users = present.users[rows]
    sizes = np.array([fleet.bodies[k].size for k in users.tolist()]).reshape(-1, 3)
    frames = rigid_frames(present.positions[rows], present.yaws[rows], present.pitches[rows])
    rigid = np.array([not fleet.bodies[k].assembly.bends for k in users.tolist()], dtype=np.bool_)
    bent = [_units(present, fleet, row) for row in rows[~rigid].tolist()]
    whole = _Boxes(users[rigid], frames[rigid], sizes[rigid])
    return _Boxes(
        np.concatenate([whole.users, *(each.users for each in bent)]),
        np.concatenate([whole.frames, *(each.frames for each in bent)]),
        np.concatenate([whole.sizes, *(each.sizes for each in bent)]),
    )


def _units(present: Present, fleet: Fleet, row: int) -> _Boxes:
    """One box for each unit of a vehicle that bends."""
    user = int(present.users[row])
    body, links = fleet.bodies[user], links_of(fleet.bodies[user])
    piece = fleet.presence.pieces[int(present.pieces[row])]
    assert links is not None
    frames = unit_frames(piece, np.array([present.time]), links)[0]
    sizes = np.array([(length, *body.size[1:]) for length in links.lengths.tolist()])
    return _Boxes(np.full(len(sizes), user), frames, sizes)


def _crossed(ray: _Ray, boxes: _Boxes, margins: Floats) -> tuple[Floats, Floats]:
    """Where a ray enters and leaves boxes, (b,) [m]; it misses those it leaves before.

    Args:
        ray: From the eye.
        boxes: Some.
        margins: Added on both sides along x, y, z, (b, 3) [m].
    """
    rotations = boxes.frames[:, :3, :3]
    origins = np.einsum("bji,bj->bi", rotations, ray.origin - boxes.frames[:, :3, 3])
    directions = np.einsum("bji,j->bi", rotations, ray.direction)
    oblique = np.where(np.abs(directions) < _PARALLEL, _PARALLEL, directions)
    # From the front's middle on the ground to the box's lowest and highest corner.
    low = boxes.sizes * [-1.0, -0.5, 0.0] - margins
    high = boxes.sizes * [0.0, 0.5, 1.0] + margins
    first, second = (low - origins) / oblique, (high - origins) / oblique
    enter = np.minimum(first, second).max(axis=1)
    leave = np.maximum(first, second).min(axis=1)
    return enter, leave
