"""Bakes a surface asset's maps from the recipe in its `asset.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from bakers.surfaces.build import make_surface
from bakers.surfaces.maps import Maps, Recipe
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.png import write_png
from sumo3dviz_pt.model.geometry import Floats

Bytes = NDArray[np.uint8]


def surface_recipe(meta: Mapping[str, Any]) -> tuple[str, Recipe]:
    """Read a surface asset: its maker's name and its recipe.

    Args:
        meta: Content of `asset.yaml`.

    Raises:
        ConfigError: If a needed key is missing.
    """
    try:
        recipe = dict(meta["recipe"])
        maker, pixels = str(recipe.pop("maker")), int(recipe.pop("pixels"))
        red, green, blue = (float(value) for value in meta["albedo"])
        tile, seed = float(meta["scale"]), int(recipe.pop("seed", 0))
    except KeyError as missing:
        raise ConfigError(f"a surface's asset.yaml lacks {missing}") from missing
    return maker, Recipe(pixels, tile, (red, green, blue), seed, recipe)


def srgb_bytes(linear: Floats) -> Bytes:
    """Encode linear reflectance as 8-bit sRGB (IEC 61966-2-1), any shape."""
    linear = np.clip(linear, 0.0, 1.0)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255.0 * curve).astype(np.uint8)


def surface_pixels(maps: Maps, *, step: int = 1) -> dict[str, Bytes]:
    """Return the pixels of each map by file name, (h, w, 3) or (h, w).

    Args:
        maps: What the maker made.
        step: Colours are rounded to multiples of this many codes; in grainy maps
            2 or 3 is invisible and saves a third of the file.
    """
    codes = srgb_bytes(maps.albedo).astype(np.int64)
    colours = np.minimum(np.round(codes / step) * step, 255).astype(np.uint8)
    pixels = {"albedo.png": colours}
    if maps.roughness is not None:
        pixels["roughness.png"] = np.round(255.0 * maps.roughness).astype(np.uint8)
    return pixels


def bake_surface(folder: Path) -> tuple[Path, ...]:
    """Make the maps in a surface's folder again from its `asset.yaml`, the same pixels every time.

    Only maps that its BSDF names are written.

    Returns:
        The files written.

    Raises:
        ConfigError: If `asset.yaml` is incomplete or names an unknown maker.
    """
    text = (folder / "asset.yaml").read_text(encoding="utf-8")
    meta = yaml.safe_load(text)
    maker, recipe = surface_recipe(meta)
    step = int(recipe.params.get("step", 1))
    pixels = surface_pixels(make_surface(maker, recipe), step=step)
    wanted = [name for name in pixels if f"filename: {name}" in text]
    for name in wanted:
        write_png(folder / name, pixels[name])
    return tuple(folder / name for name in wanted)
