"""Frames as they were traced, what neighbours need to know of them, and how they are stored.

Layers are stored in half precision, with a text. Guides are rounded to fewer digits than half
precision has, because their last digits are noise that no compression makes smaller. Placements are
stored in single precision relative to the camera, on a grid, wherever the network lies.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.exr import HALF_MAX
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Transform
from sumo3dviz_pt.model.layers import LUMINANCE, Channels, Layers, MovingPart
from sumo3dviz_pt.model.lens import Lens, planes_of_rays
from sumo3dviz_pt.model.scene import View

AVERAGED = Channels.in_order(radiance=3, albedo=3, normal=3, hit=1, depth=1)
"""Layers that are averaged over frames, and where they lie in `TracedFrame.planes`."""

_NEAR, _NEAR_SHARE = 0.02, 0.01  # how far distances may differ [m], and as a share
_GRAZING = 0.05  # least cosine by which a surface stretches a pixel
_DARK = 0.02  # share of white that is added before logarithms, so that black has one
_EXACT = 1e-9  # how far a placement may lie from another that counts as the same
_ABOUT = 3e-4  # the same for what rides with a camera: less than a pixel, half a metre away


@dataclass(frozen=True, eq=False)
class TracedFrame:
    """A frame as it was traced, neither denoised nor hazed.

    Attributes:
        layers: `radiance`, `albedo`, `normal`, `hit`, `depth`, `ids` and `first_depth`; see
            `model/layers.py`. Others stay as they are.
        view: Of the camera.
        white: Radiance that is shown as white, scene units.
        samples: Of each pixel.
        parts: What the numbers of `ids` stand for, from 1 on.
    """

    layers: Layers
    view: View
    white: float = 1.0
    samples: int = 1
    parts: tuple[MovingPart, ...] = ()

    @cached_property
    def planes(self) -> Image:
        """All averaged layers, one channel after the other, (channels, h, w)."""
        width, height = self.layers.size
        # Joined as they are, they would keep all channels of a pixel side by side.
        planes = np.empty((AVERAGED.count, height, width), dtype=np.float32)
        for name, place in AVERAGED.places.items():
            planes[place] = np.moveaxis(np.atleast_3d(self.layers[name]), -1, 0)
        return planes

    @cached_property
    def numbers(self) -> NDArray[np.int32]:
        """The layer `ids`, as whole numbers, (h, w)."""
        return self.layers["ids"].astype(np.int32)

    @cached_property
    def moving(self) -> NDArray[np.intp]:
        """Flat indices of pixels that show what moves, ascending, (n,)."""
        return np.flatnonzero(self.numbers)

    @cached_property
    def marks(self) -> NDArray[np.int32]:
        """Twice each pixel's number, and one more where it is pure, (h, w)."""
        return 2 * self.numbers + self.pure

    @cached_property
    def distance(self) -> Image:
        """Of what is seen, along the ray, (h, w) [m]; 0 is the sky."""
        first, hit = self.layers["first_depth"], self.layers["hit"]
        mean = self.layers["depth"] / np.maximum(hit, np.float32(1e-6))
        # A mean lies nearer to the middle of the pixel, if all samples met one surface.
        return np.where(self.pure & (first > 0.0), mean, first)

    @cached_property
    def pure(self) -> Bools:
        """Whether all samples of a pixel met about the same as its first, (h, w)."""
        hit, first = self.layers["hit"], self.layers["first_depth"]
        apart = np.abs(self.layers["depth"] - first * hit)
        return np.where(first > 0.0, (apart < self.room) & (hit > 0.99), hit < 0.01)

    @cached_property
    def room(self) -> Image:
        """How far distances within a pixel, or to a neighbour's, may differ, (h, w) [m]."""
        away = self.layers["first_depth"]
        # A surface that is seen from its side is stretched along the ray. Fog shortens normals, so
        # there distances may differ more; fog hides what that lets through.
        camera = self.view.world_from_camera.matrix[:3, :3].T.astype(np.float32)
        across = camera @ plane_of(self.planes, "normal").reshape(3, -1)
        facing = np.einsum("ij,ij->j", self.rays.reshape(3, -1), across).reshape(away.shape)
        facing = np.clip(np.abs(facing), np.float32(_GRAZING), np.float32(1.0))
        pixel = np.float32(self.view.lens.pixel_angle(self.layers.size[0]))
        slope = np.sqrt(1.0 - facing * facing) / facing
        return np.asarray(np.float32(_NEAR) + away * (np.float32(_NEAR_SHARE) + pixel * slope))

    @cached_property
    def levels(self) -> Image:
        """Logarithm of the picture's luminance, (h, w)."""
        return self.levels_of(self.planes)

    def levels_of(self, planes: Image) -> Image:
        """Return the logarithm of luminance of planes such as this frame's, (h, w)."""
        red, green, blue = (np.float32(one / self.white) for one in LUMINANCE)
        r, g, b = plane_of(planes, "radiance")
        light = red * r + green * g + blue * b
        return np.asarray(np.log(np.maximum(light, 0.0) + np.float32(_DARK)))

    def work_out(self) -> None:
        """Work out what is asked for often, so that threads need not do so at once."""
        _ = self.planes, self.levels, self.distance, self.room, self.marks, self.moving, self.rays

    @property
    def rays(self) -> Image:
        """Direction through every pixel in the camera's frame, unit, (3, h, w)."""
        return planes_of_rays(self.view.lens, self.layers.size)


def plane_of(planes: Image, name: str) -> Image:
    """Return the planes of a layer, (channels, ...)."""
    return planes[AVERAGED.places[name]]


def layers_of(planes: Image) -> Layers:
    """Return the averaged layers of planes, (channels, h, w)."""
    return AVERAGED.layers(np.moveaxis(planes, 0, -1))


@dataclass(frozen=True, eq=False)
class PixelMotion:
    """Where things went from one frame to another.

    Attributes:
        placements: From the first camera's frame to the second's, for what stands, then for each
            part of the first frame, (1 + parts, 4, 4).
        known: Whether a part is in both frames and keeps its shape, (1 + parts,).
        there: Numbers of these parts in the second frame, (1 + parts,); -1 for strangers.
        back: Numbers of the second frame's parts in the first one, (1 + its parts,); the same.
    """

    placements: Floats
    known: Bools
    there: NDArray[np.int32]
    back: NDArray[np.int32]

    @cached_property
    def still(self) -> Bools:
        """Which parts are where they were, as the camera sees them, (1 + parts,)."""
        return np.asarray(self.known & (self._moved < _EXACT))

    @property
    def still_there(self) -> Bools:
        """The same of the second frame's parts, (1 + its parts,)."""
        return self._in_second(self.still)

    @cached_property
    def riding(self) -> Bools:
        """Which parts go with a camera that moves, (1 + parts,); never what stands."""
        riding = self.known & (self._moved < _ABOUT) & ~self.still[0]
        riding[0] = False
        return np.asarray(riding)

    @property
    def riding_there(self) -> Bools:
        """The same of the second frame's parts, (1 + its parts,)."""
        return self._in_second(self.riding)

    @cached_property
    def _moved(self) -> Floats:
        """By how much placements differ from none, (1 + parts,) [m, rad]."""
        return np.asarray(np.abs(self.placements - np.eye(4)).max(axis=(1, 2)))

    def _in_second(self, which: Bools) -> Bools:
        """Return for the second frame's parts what holds for the first one's."""
        return np.asarray(np.append(which, False)[self.back])


def motion_between(centre: TracedFrame, other: TracedFrame) -> PixelMotion:
    """Return where things went from one frame to another.

    Placements are combined in double precision, so that they are right wherever the network lies.
    """
    to_other = np.linalg.inv(other.view.world_from_camera.matrix)
    from_centre = centre.view.world_from_camera.matrix
    standing = to_other @ from_centre
    if np.array_equal(other.view.world_from_camera.matrix, from_centre):
        standing = np.eye(4)
    there = {part.name: part.world_from_part for part in other.parts}
    placements = np.tile(standing, (1 + len(centre.parts), 1, 1))
    known = np.ones(len(placements), dtype=bool)
    for number, part in enumerate(centre.parts, start=1):
        now, then = part.world_from_part, there.get(part.name)
        if now is None or then is None:
            known[number] = False
        elif not np.array_equal(now.matrix, then.matrix):
            moved = then.matrix @ np.linalg.inv(now.matrix)
            placements[number] = to_other @ moved @ from_centre
    return PixelMotion(placements, known, _numbers_in(other, centre), _numbers_in(centre, other))


def _numbers_in(frame: TracedFrame, others: TracedFrame) -> NDArray[np.int32]:
    """Return which numbers another frame's parts have in a frame, (1 + parts,); -1 if none."""
    names = {part.name: number for number, part in enumerate(frame.parts, start=1)}
    numbers = [0, *(names.get(part.name, -1) for part in others.parts)]
    return np.array(numbers, dtype=np.int32)


def all_around(mask: Bools) -> Bools:
    """Return where a mask holds in all of 3 x 3 pixels, (h, w)."""
    wide = np.pad(mask, 1, mode="edge")
    rows = wide[:-2] & wide[1:-1] & wide[2:]
    return np.asarray(rows[:, :-2] & rows[:, 1:-1] & rows[:, 2:])


_STEPS = {"albedo": 256, "normal": 64}
"""Steps of a unit to which guides are rounded."""

_LAYERS = frozenset({"radiance", "hit", "depth", "first_depth", "ids", *_STEPS})
"""What is stored of every frame."""

_FARTHEST = 60_000.0
"""What lies farther away counts as sky [m]: the sun's disc is an object in the renderer."""

_MOST_IDS = 2048
"""Largest whole number up to which half precision holds all."""


def packed(frame: TracedFrame) -> tuple[dict[str, NDArray[Any]], str]:
    """Return what is stored of a frame: layers, and a text that says what they show.

    Args:
        frame: Also with the layer `excess`, which is stored where it is not zero.
    """
    layers = frame.layers
    whole = layers["ids"].astype(np.intp)
    counted = np.bincount(whole.reshape(-1))
    numbers = [int(number) for number in np.flatnonzero(counted) if number > 0]
    renumbered = np.zeros(len(counted), dtype=np.intp)
    renumbered[numbers] = np.arange(1, len(numbers) + 1)
    ids = renumbered[whole]
    surface = (layers["hit"] > 0.0) & (layers["first_depth"] < _FARTHEST)
    first = np.where(surface, layers["first_depth"], 0.0)
    depth = np.where(layers["hit"] > 0.0, layers["depth"], 0.0)
    stored: dict[str, NDArray[Any]] = {
        "radiance": layers["radiance"],
        "hit": layers["hit"].astype(np.float16),
        "depth": np.minimum(depth, HALF_MAX).astype(np.float16),
        "first_depth": first.astype(np.float16),
        "ids": ids.astype(np.float16 if len(numbers) < _MOST_IDS else np.float32),
    }
    for name, steps in _STEPS.items():
        stored[name] = np.rint(np.clip(layers[name], -1.0, 1.0) * steps) / np.float32(steps)
    if "excess" in layers and layers["excess"].any():
        stored["excess"] = layers["excess"]
    stored |= {name: layers[name] for name in ("reflected", "passed") if name in layers}
    return stored, json.dumps(_description(frame, numbers))


def _description(frame: TracedFrame, numbers: list[int]) -> dict[str, Any]:
    """Return what the layers show, as plain values, with only the parts that are seen."""
    parts = [frame.parts[number - 1] for number in numbers]
    origin = frame.view.origin
    poses = np.full((len(parts), 3, 4), np.nan)
    for pose, part in zip(poses, parts, strict=True):
        if part.world_from_part is not None:
            pose[:] = part.world_from_part.matrix[:3]
            pose[:, 3] -= origin
    return {
        "camera": _text(frame.view.world_from_camera.matrix, np.float64),
        "lens": frame.view.lens.as_dict(),
        "white": frame.white,
        "samples": frame.samples,
        "origin": origin.tolist(),
        "parts": [part.name for part in parts],
        "poses": _text(poses, np.float32),
    }


def unpacked(stored: Mapping[str, Image], text: str) -> TracedFrame:
    """Return a frame from what is stored of it.

    Args:
        stored: The layers.
        text: What they show.

    Raises:
        ValueError: If the text is damaged, or a layer is missing.
    """
    try:
        lacking = _LAYERS - set(stored)
        if lacking:
            raise ValueError(f"has no layer {min(lacking)}")
        content = json.loads(text)
        camera = Transform(_array(content["camera"], np.float64).reshape(4, 4))
        view = View(camera, Lens.from_dict(content["lens"]))
        poses = _array(content["poses"], np.float32).reshape(-1, 3, 4)
        origin = np.array(content["origin"], dtype=np.float64)
        parts = [
            MovingPart(str(name), _placement(pose, origin))
            for name, pose in zip(content["parts"], poses, strict=True)
        ]
        white, samples = float(content["white"]), int(content["samples"])
        return TracedFrame(Layers(stored), view, white, samples, tuple(parts))
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        raise ValueError(f"does not say what it shows ({error})") from error


def _placement(pose: Floats, origin: Floats) -> Transform | None:
    """Return a stored placement, (3, 4); None where there is none."""
    if not np.isfinite(pose).all():
        return None
    matrix = np.eye(4)
    matrix[:3] = pose
    matrix[:3, 3] += origin
    return Transform(matrix)


def _text(values: Floats, kind: type) -> str:
    """Return numbers as text that keeps all of their bits."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _array(text: str, kind: type) -> Floats:
    """Return numbers from their text."""
    return np.frombuffer(base64.b64decode(text), dtype=kind).astype(np.float64)
