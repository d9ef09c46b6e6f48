"""Averages a frame with what its neighbours saw of the same things in the same light.

What a neighbour saw counts where the same thing is seen in both frames, at the distance that
exact motion tells, and its light has not changed. Where nothing moves before a camera that
stands still, pixels are averaged with themselves; elsewhere a neighbour's picture is sampled
where things lay then. A frame without neighbours comes out as it was.

References:
    Nehab et al., "Accelerating real-time shading with reverse reprojection caching",
    Graphics Hardware 2007, doi:10.2312/EGGH/EGGH07/025-036.
    Schied et al., "Spatiotemporal variance-guided filtering", HPG 2017,
    doi:10.1145/3105762.3105770.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.image.accumulation.frames import (
    TracedFrame,
    all_around,
    common_numbers,
    relative_motions,
    stays,
)
from sumo3dviz_pt.image.accumulation.light import likeness
from sumo3dviz_pt.image.accumulation.places import Places, places_of
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Layers

_AVERAGED = ("radiance", "albedo", "normal", "hit", "depth")

NEAR, NEAR_SHARE = 0.02, 0.01  # how far distances may differ [m], and as a share
_ALONG = 0.5  # cosine between normals that still count as one
_GRAZING = 0.05  # least cosine by which a surface stretches a pixel
_PLAIN = np.float32(0.05)  # added to albedos before their ratio is taken


@dataclass(frozen=True, slots=True, eq=False)
class Accumulated:
    """A frame with its neighbours' help.

    Attributes:
        layers: The frame's, those that neighbours know better replaced.
        frames: How many frames' worth of samples each pixel has, (h, w), at least 1.
    """

    layers: Layers
    frames: Image


def accumulated(
    centre: TracedFrame, neighbours: Iterable[TracedFrame], *, white: float
) -> Accumulated:
    """Average a frame with its neighbours.

    Args:
        centre: The frame.
        neighbours: Frames before and after it, of the same size, in any order.
        white: Radiance that is shown as white, scene units.
    """
    names = [name for name in _AVERAGED if name in centre.layers]
    own = _stack(centre.layers, names)
    total = own.astype(np.float32)
    weight = np.ones(total.shape[:2], dtype=np.float32)
    for other in neighbours:
        seen, known = seen_by(other, centre, names)
        if not known.any():
            continue
        share = likeness(own[..., :3], seen[..., :3], known=known, white=white)
        total += seen * share[..., None]
        weight += share
    return Accumulated(centre.layers | _unstacked(total / weight[..., None], names), weight)


def seen_by(other: TracedFrame, centre: TracedFrame, names: list[str]) -> tuple[Image, Bools]:
    """Return what another frame holds of what a frame shows.

    Args:
        other: The other frame.
        centre: The frame.
        names: Of layers.

    Returns:
        Values in the frame's pixels, (h, w, channels), and where there are any, (h, w).
    """
    motions, known = relative_motions(centre, other)
    numbers = common_numbers(centre, other)
    still = stays(motions) & known
    before = _stack(other.layers, names)

    # Where nothing moves, pixels correspond; what a pixel sees besides does not matter.
    resting = np.where(numbers >= 0, still[np.maximum(numbers, 0).astype(np.intp)], False)
    same = all_around(still[centre.ids.astype(np.intp)] & resting)
    if same.all():
        return before, same

    # Elsewhere the other picture is sampled.
    wanted = ~same & known[centre.ids.astype(np.intp)] & is_pure(centre)
    places = places_of(wanted, centre, other, motions)
    found = before * same[..., None]
    sampled, weight = _sampled(places, before, centre, other, numbers)
    corrected = _as_here(sampled, places, centre, names)
    flat = same.reshape(-1).copy()
    flat[places.pixels] = weight > 0.25
    found.reshape(-1, found.shape[-1])[places.pixels] = corrected * (weight > 0.25)[:, None]
    return found, flat.reshape(same.shape)


def is_pure(frame: TracedFrame) -> Bools:
    """Return where all samples of a pixel met about the same as the first, (h, w)."""
    if "depth" not in frame.layers:
        return np.ones(frame.ids.shape, dtype=bool)
    hit, first = frame.layers["hit"], frame.distance
    mean = frame.layers["depth"] / np.maximum(hit, 1e-6)
    close = np.abs(mean - first) < _tolerance(frame)
    return np.where(first > 0, close & (hit > 0.99), hit <= 0.01)


def _tolerance(frame: TracedFrame) -> Image:
    """Return how far distances in a pixel may differ, (h, w) [m]."""
    away = frame.distance
    room = NEAR + NEAR_SHARE * away
    if "normal" not in frame.layers:
        return room
    size = frame.layers.size
    facing = np.abs((frame.view.directions(size) * frame.layers["normal"]).sum(axis=-1))
    slope = np.sqrt(np.maximum(1.0 - facing**2, 0.0)) / np.maximum(facing, _GRAZING)
    return np.asarray(room + away * frame.view.lens.pixel_angle(size[0]) * slope, np.float32)


def _sampled(
    places: Places, before: Image, centre: TracedFrame, other: TracedFrame, numbers: Image
) -> tuple[Image, Image]:
    """Sample a picture between its pixels, from those that show the thing; see `_accepts`."""
    height, width = before.shape[:2]
    row, column = np.floor(places.row), np.floor(places.column)
    down, right = places.row - row, places.column - column
    room = _tolerance(centre).reshape(-1)[places.pixels]
    pure = is_pure(other).reshape(-1)
    number = centre.ids.reshape(-1)[places.pixels]
    total = np.zeros((len(places.pixels), before.shape[-1]), dtype=np.float32)
    weight = np.zeros(len(places.pixels), dtype=np.float32)
    flat = before.reshape(-1, before.shape[-1])
    for lower in (0, 1):
        for later in (0, 1):
            share = (down if lower else 1 - down) * (right if later else 1 - right)
            y = np.clip(row + lower, 0, height - 1).astype(np.intp)
            x = np.clip(column + later, 0, width - 1).astype(np.intp)
            tap = y * width + x
            away = other.distance.reshape(-1)[tap]
            fits = pure[tap] & (numbers.reshape(-1)[tap] == number)
            fits &= (np.abs(away - places.distance) < room) & ((away > 0) == (places.distance > 0))
            share = (share * fits).astype(np.float32)
            total += flat[tap] * share[:, None]
            weight += share
    return (total / np.maximum(weight, 1e-6)[:, None]).astype(np.float32), weight


def _as_here(sampled: Image, places: Places, centre: TracedFrame, names: list[str]) -> Image:
    """Return what was sampled with this frame's textures and distances."""
    found = sampled.copy()
    start = 0
    spans = {}
    for name in names:
        width = 1 if centre.layers[name].ndim == 2 else 3
        spans[name] = slice(start, start + width)
        start += width
    if "albedo" in spans:
        own = centre.layers["albedo"].reshape(-1, 3)[places.pixels]
        ratio = (own + _PLAIN) / (sampled[:, spans["albedo"]] + _PLAIN)
        found[:, spans["radiance"]] *= np.clip(ratio, 0.25, 4.0)
        found[:, spans["albedo"]] = own
    if "depth" in spans:
        ratio = np.where(places.distance > 0, places.ahead / np.maximum(places.distance, 1e-6), 1)
        found[:, spans["depth"]] *= ratio[:, None]
    return found


def _stack(layers: Layers, names: list[str]) -> Image:
    """Return layers side by side, (h, w, channels)."""
    return np.concatenate(
        [np.atleast_3d(layers[name]).astype(np.float32, copy=False) for name in names], axis=-1
    )


def _unstacked(stack: Image, names: list[str]) -> dict[str, Image]:
    """Return layers that lie side by side; `hit` and `depth` have one channel."""
    found: dict[str, Image] = {}
    start = 0
    for name in names:
        width = 1 if name in ("hit", "depth") else 3
        part = stack[..., start : start + width]
        found[name] = part[..., 0] if width == 1 else part
        start += width
    return found
