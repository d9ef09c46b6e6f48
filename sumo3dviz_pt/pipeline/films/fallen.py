"""What falls and flies before a camera as text, so that a stored frame can be finished alone."""

from __future__ import annotations

import base64
import json
import zlib
from dataclasses import fields
from typing import Any

import numpy as np

from sumo3dviz_pt.model.falling import Cabin, Falling, Glows, Puffs, SkyLight, Throws, Windscreen

_PARTS = {
    "glows": Glows,
    "throws": Throws,
    "puffs": Puffs,
    "cabin": Cabin,
    "windscreen": Windscreen,
}


def as_plain(value: Any) -> Any:
    """Return a value of `model/falling.py` as plain ones; arrays keep all of their bits."""
    if isinstance(value, np.ndarray):
        raw = np.ascontiguousarray(value, dtype=np.float64).tobytes()
        return {"shape": list(value.shape), "raw": base64.b64encode(zlib.compress(raw, 9)).decode()}
    if isinstance(value, Falling | SkyLight | Glows | Throws | Puffs | Cabin | Windscreen):
        return {field.name: as_plain(getattr(value, field.name)) for field in fields(value)}
    return value


def falling_of(said: dict[str, Any]) -> Falling:
    """Return what plain values say that falls and flies.

    Raises:
        KeyError: If something is missing.
        ValueError: If something is damaged.
    """
    given: dict[str, Any] = {}
    for name, value in said.items():
        made = _PARTS.get(name)
        given[name] = (
            _of_plain(value)
            if made is None or value is None
            else made(**{key: _of_plain(part) for key, part in value.items()})
        )
    return Falling(**given)


def light_of(said: dict[str, Any]) -> SkyLight:
    """Return the light of the sky from plain values."""
    return SkyLight(**{name: _of_plain(value) for name, value in said.items()})


def _of_plain(value: Any) -> Any:
    """Return an array, a tuple or a number from plain values."""
    if isinstance(value, dict):
        raw = zlib.decompress(base64.b64decode(value["raw"]))
        return np.frombuffer(raw, dtype=np.float64).reshape(value["shape"])
    return tuple(value) if isinstance(value, list) else value


def text_of(falling: Falling, light: SkyLight | None) -> str:
    """Return what falls, and in what light, as text."""
    return json.dumps({"falling": as_plain(falling), "light": as_plain(light)})


def read_text(text: str) -> tuple[Falling, SkyLight]:
    """Return what falls, and in what light, from its text.

    Raises:
        ValueError: If it is damaged.
    """
    try:
        said = json.loads(text)
        return falling_of(said["falling"]), light_of(said["light"])
    except (KeyError, TypeError, zlib.error) as error:
        raise ValueError(f"does not say what falls in it ({error})") from error
