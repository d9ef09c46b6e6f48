"""How frames are stored as they were traced.

Layers are stored in half precision, with a text. Guides are rounded to fewer digits than half
precision has, because their last digits are noise that no compression makes smaller. Placements are
stored in single precision relative to the camera, on a grid, wherever the network lies.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.exr import HALF_MAX
from sumo3dviz_pt.model.geometry import Floats, Image, Transform
from sumo3dviz_pt.model.layers import Layers, MovingPart
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traced import TracedFrame

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
