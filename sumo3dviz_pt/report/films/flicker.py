"""Flicker of a film: how much a surface point changes from one frame to the next.

Each pixel is followed back to where its surface point was in the picture before.
Points in the box of a road user move with it, all others stand still, and the sky
turns with the camera. What was hidden or out of the picture before is left out.
Mirrors, shadows and flashing lamps are not followed: a change of theirs counts. Much
foliage is left out, for its depth is as noisy as its picture.

A low flicker alone says little: a film that lags behind its light has it, too. Quote
the error of the same frames beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import map_coordinates

from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Transform
from sumo3dviz_pt.model.scene import FrameState, Mover, Prototype, View

PlaneOrder = Literal[0, 1, 3]
"""Nearest pixel, bilinear, cubic spline."""

Bounds = Floats
"""Lowest and highest corner of a body, (2, 3) [m]."""

MARGIN = 0.03
"""A body's box is larger than its mesh by this, for paint and depth noise [m]."""

GROUND = 0.01
"""Points lower than this above a body's origin belong to the road [m]."""

DEPTH_TOLERANCE = 0.02
"""Share of the distance by which two depths of one surface may differ; beyond it another surface
was seen before. Depth pictures of few samples are noisy where a road is seen at a flat angle."""

SKY = 1e-6
"""Reciprocal distance up to which a point counts as sky [1/m]: rounding puts places a
hair beside a pixel's centre, where a neighbour's distance mixes in."""

BORDER = 0.01
"""How far outside the outermost pixel centres a place still counts as inside [px]."""

NEAR = 0.01
"""Corners of a box closer to the eye's plane than this have no place on screen [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenFrame:
    """A frame and how far away each of its pixels is.

    Attributes:
        frame: Camera and road users.
        depth: Distance along the ray through the pixel's centre, (h, w) [m]; inf is sky.
    """

    frame: FrameState
    depth: Image


@dataclass(frozen=True, slots=True, eq=False)
class Flow:
    """Where each pixel's surface point was in the picture before.

    Attributes:
        places: Row and column, (2, h, w) [px]; whole numbers are pixel centres.
        valid: Where the same point was seen before, (h, w).
    """

    places: Floats
    valid: Bools


@dataclass(frozen=True, slots=True)
class Flicker:
    """How much a picture differs from the one before, motion apart.

    Attributes:
        codes: Mean |difference| of valid pixels and channels [8-bit codes], [0, 255];
            NaN without a valid pixel.
        share: Share of valid pixels, [0, 1].
    """

    codes: float
    share: float


def body_bounds(prototypes: Mapping[str, Prototype]) -> dict[str, Bounds]:
    """Return the box of each body, near and far together; bodies without vertices have none."""
    bounds = {}
    for name, prototype in prototypes.items():
        meshes = [part.mesh for part in (*prototype.parts, *prototype.far)]
        corners = [mesh.bounds for mesh in meshes if len(mesh.vertices)]
        if corners:
            low_high = np.stack(corners)
            bounds[name] = np.stack([low_high[:, 0].min(axis=0), low_high[:, 1].max(axis=0)])
    return bounds


def flow_between(now: SeenFrame, before: SeenFrame, bodies: Mapping[str, Bounds]) -> Flow:
    """Follow every pixel of a frame back into the frame before.

    Args:
        now: The frame whose pixels are followed.
        before: The frame in which they are looked for, of the same size.
        bodies: Boxes of the prototypes, as from `body_bounds`.

    Raises:
        ValueError: If the depth pictures differ in size.
    """
    if now.depth.shape != before.depth.shape:
        raise ValueError(f"depth of {now.depth.shape} against {before.depth.shape}")
    height, width = now.depth.shape
    view, past = now.frame.view, before.frame.view
    rays = view.directions((width, height))
    hit = np.isfinite(now.depth)
    points = view.position + rays * np.where(hit, now.depth, 0.0)[..., None]
    known = _carry(points, hit, now.frame, before.frame, bodies=bodies)
    # Sky is infinitely far: only its direction counts.
    offsets = np.where(hit[..., None], points - past.position, rays)
    local = offsets @ past.world_from_camera.matrix[:3, :3]
    places, ahead = past.lens.project(local, (width, height))
    inside = ahead & (places > -BORDER).all(axis=0)
    inside &= (places[0] < height - 1 + BORDER) & (places[1] < width - 1 + BORDER)
    places = np.where(inside, places, 0.0)
    expected = np.divide(1.0, local[..., 0], out=np.zeros(hit.shape), where=hit & inside)
    return Flow(places, known & inside & _agrees(expected, before, places))


def flicker(picture: Image, before: Image, flow: Flow, *, order: PlaneOrder = 3) -> Flicker:
    """Return the mean change of a film's picture along the flow.

    Reading between pixel centres averages noise, and so hides flicker, or misplaces
    texture, and so adds some. Measured at camera speeds of traffic (white noise of
    known sigma, whose mean change is 2 sigma / sqrt(pi); plain and checkered road
    without noise): the cubic spline finds 5 % too little white noise and leaves the
    least texture; bilinear finds 14 % too little; the nearest pixel finds all, but
    leaves 1.2 to 3 times the texture. Noise that spans pixels, as behind a denoiser,
    both interpolations find to 2 %.

    Args:
        picture: sRGB-encoded, (h, w, 3) in [0, 1].
        before: The picture before, in the same form.
        flow: Where the pixels of `picture` were in `before`.
        order: How `before` is read: 3 cubic spline, 1 bilinear, 0 nearest pixel.

    Raises:
        ValueError: If the sizes differ.
    """
    if not picture.shape[:2] == before.shape[:2] == flow.valid.shape:
        raise ValueError(f"{picture.shape}, {before.shape} and a flow of {flow.valid.shape}")
    valid = flow.valid
    if not valid.any():
        return Flicker(float("nan"), 0.0)
    moved = warped(before, flow, order=order)
    change = np.abs(picture[valid] - moved[valid]).mean(dtype=np.float64)
    return Flicker(255.0 * float(change), float(valid.mean()))


def warped(before: Image, flow: Flow, *, order: PlaneOrder = 3) -> Image:
    """Return the picture before as its surfaces lie now, (h, w, 3).

    Pixels that are not valid hold whatever lies at their place.

    Args:
        before: The picture before, (h, w, 3).
        flow: Where the pixels of now were in it.
        order: How it is read: 3 cubic spline, 1 bilinear, 0 nearest pixel.
    """
    channels = [
        map_coordinates(before[..., channel], flow.places, order=order, mode="nearest")
        for channel in range(before.shape[-1])
    ]
    return np.stack(channels, axis=-1)


# Movers ------------------------------------------------------------------------------------


def _carry(
    points: Floats,
    hit: Bools,
    now: FrameState,
    before: FrameState,
    *,
    bodies: Mapping[str, Bounds],
) -> Bools:
    """Move the points on road users, in place, to where they were before.

    Args:
        points: World points, (h, w, 3) [m]; overwritten.
        hit: Where there is a point, (h, w).
        now: The frame in which the points were seen.
        before: The frame to go back to.
        bodies: Boxes of the prototypes.

    Returns:
        Where it is known what the point did, (h, w): not on road users that just appeared.
    """
    past = {(mover.id, mover.part): mover for mover in before.everyone}
    known = np.ones(hit.shape, dtype=bool)
    # Each point goes with one mover only, even where boxes overlap.
    free = hit.copy()
    for mover in now.everyone:
        box = bodies.get(mover.prototype)
        if box is None:
            continue
        box = _inflated(box, mover.world_from_body)
        window = _window(box, mover.world_from_body, now.view, hit.shape)
        own = _on_body(points[window], box, mover) & free[window]
        free[window] &= ~own
        if (mover.id, mover.part) in past:
            _move(points[window], own, mover, past[mover.id, mover.part])
        else:
            known[window] &= ~own
    return known


def _inflated(box: Bounds, world_from_body: Transform) -> Bounds:
    """Return a body's box, in its own units, with the margin around and without the ground."""
    scale = np.linalg.norm(world_from_body.matrix[:3, :3], axis=0)
    low, high = box[0] - MARGIN / scale, box[1] + MARGIN / scale
    return np.stack([[low[0], low[1], max(low[2], GROUND / scale[2])], high])


def _on_body(points: Floats, box: Bounds, mover: Mover) -> Bools:
    """Return which world points, (h, w, 3), lie in a mover's box, (h, w)."""
    body_from_world = np.linalg.inv(mover.world_from_body.matrix)
    inside: Bools = np.ones(points.shape[:2], dtype=bool)
    for axis in range(3):
        local = points @ body_from_world[axis, :3] + body_from_world[axis, 3]
        inside &= (local >= box[0, axis]) & (local <= box[1, axis])
    return inside


def _move(points: Floats, own: Bools, now: Mover, before: Mover) -> None:
    """Take the own points, in place, from a mover's placement now to the one before."""
    motion = before.world_from_body.matrix @ np.linalg.inv(now.world_from_body.matrix)
    points[own] = Transform(motion).points(points[own])


def _window(
    box: Bounds, world_from_body: Transform, view: View, shape: tuple[int, ...]
) -> tuple[slice, slice]:
    """Return rows and columns that hold a box; the whole picture if it reaches behind the eye."""
    height, width = shape
    chosen = np.indices((2, 2, 2)).reshape(3, 8)
    corners = world_from_body.points(box[chosen, np.arange(3)[:, None]].T)
    local = (corners - view.position) @ view.world_from_camera.matrix[:3, :3]
    if (local[:, 0] <= NEAR).all():
        return slice(0, 0), slice(0, 0)
    if (local[:, 0] <= NEAR).any():
        return slice(0, height), slice(0, width)
    places, _ = view.lens.project(local, (width, height))
    first = np.clip(np.floor(places.min(axis=1)), 0, (height, width)).astype(int)
    last = np.clip(np.ceil(places.max(axis=1)) + 1, 0, (height, width)).astype(int)
    return slice(first[0], last[0]), slice(first[1], last[1])


# Pictures ----------------------------------------------------------------------------------


def _agrees(expected: Floats, before: SeenFrame, places: Floats) -> Bools:
    """Return whether the surface that was seen before lies where it is expected, (h, w).

    The reciprocal of the depth along the camera's axis is linear on the screen for
    every plane, so it is what may be interpolated: distances may not, which run away
    by 10 % per pixel on far road. Across an edge the mixture fits neither side.

    Args:
        expected: Reciprocal axial depth in the frame before, (h, w) [1/m]; 0 is sky.
        before: The frame before.
        places: Where to look, (2, h, w) [px].
    """
    height, width = before.depth.shape
    view = before.frame.view
    axial = before.depth * (view.directions((width, height)) @ view.forward)
    depths = map_coordinates(1.0 / axial, places, order=1, mode="nearest")
    return np.asarray(np.abs(depths - expected) <= DEPTH_TOLERANCE * expected + SKY)
