"""Reads the layers of films again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.layers import Box2d, Box3d
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.layers import Layers, Thing
from sumo3dviz_pt.model.numbers import LAYER_KINDS
from sumo3dviz_pt.pipeline.films import layers as places
from sumo3dviz_pt.pipeline.films.layers import FORMS


@dataclass(frozen=True, slots=True, eq=False)
class StoredCamera:
    """A pinhole with square pixels; whole numbers are pixels' centres.

    Attributes:
        size: Width, height [px].
        focal: Focal length [px].
        centre: Column and row of the optical axis [px].
        world_from_camera: Its place; +x forward, +y left, +z up.
    """

    size: tuple[int, int]
    focal: float
    centre: tuple[float, float]
    world_from_camera: Transform


@dataclass(frozen=True, slots=True, eq=False)
class FrameLayers:
    """The layers of a frame.

    Attributes:
        frame: Its number.
        time: SUMO's [s].
        layers: `depth`, `normals`, `albedo`, `instance`, `semantic`, `flow` and `flow_valid`, as
            they were asked for; the last frame of a film has no flow.
        things: What the numbers of instances stand for, of all that pixels show.
        boxes2d: Around the pixels of things.
        boxes3d: Around the bodies of road users.
        lamps: Names of those that are lit.
        camera: What it was taken with.
    """

    frame: int
    time: float
    layers: Layers
    things: Mapping[int, Thing]
    boxes2d: tuple[Box2d, ...]
    boxes3d: tuple[Box3d, ...]
    lamps: frozenset[str]
    camera: StoredCamera


def read_frame(folder: Path, number: int) -> FrameLayers:
    """Return the layers of a frame.

    Args:
        folder: A film's, such as `film.layers`.
        number: The frame's.

    Raises:
        InputError: If they are missing, damaged or of another form.
    """
    path = places.said_file(folder, number)
    content = _said(path)
    try:
        return FrameLayers(
            content["frame"],
            content["time"],
            _pictures(folder, number),
            things={int(key): Thing(one[0], one[1]) for key, one in content["things"].items()},
            **{layer: row.read(content.get(layer, ())) for layer, row in places.SAID.items()},
            camera=_camera(content["camera"]),
        )
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"is damaged ({error}); render the frame again", file=path) from error


def _said(path: Path) -> dict[str, Any]:
    """Return what is said of a frame."""
    try:
        content = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    except ValueError as error:
        raise InputError(f"is damaged ({error})", file=path) from error
    if not isinstance(content, dict) or content.get("form") not in FORMS:
        raise InputError("is of another version; render the frame again", file=path)
    return content


def _pictures(folder: Path, number: int) -> Layers:
    """Return all layers of a frame that are pictures."""
    from sumo3dviz_pt.image.exr import read_channels

    values: dict[str, Any] = {}
    if (file := places.channels_file(folder, number)).is_file():
        channels, _ = read_channels(file)
        for layer, kind in LAYER_KINDS.items():
            own = [channels[f"{layer}.{k}"] for k in kind.channels if f"{layer}.{k}" in channels]
            if own:
                whole = np.stack(own, axis=-1)
                whole = whole.astype(np.float32) if kind.dtype.startswith("float") else whole
                values[layer] = whole[..., 0] if len(kind.channels) == 1 else whole
    for layer, row in places.OWN_FILES.items():
        file = places.own_file(folder, number, layer)
        if row.read is not None and file.is_file():
            values |= row.read(file)
    return Layers(values)


def _camera(camera: Mapping[str, Any]) -> StoredCamera:
    """Return a camera."""
    (width, height), (across, down) = camera["size"], camera["centre"]
    placed = Transform(np.array(camera["world_from_camera"]))
    return StoredCamera((width, height), camera["focal"], (across, down), placed)
