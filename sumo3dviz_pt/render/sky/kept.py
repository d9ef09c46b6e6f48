"""Skies with clouds or stars: kept in the user's cache, as baking one takes a CPU-second."""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
from pathlib import Path

import mitsuba as mi
import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.files.kept import Files, keep, make_room, read_whole
from sumo3dviz_pt.files.values import kinds_in, packed
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.render.sky.map import SkyMap, Sun, bake_dome, bake_sky, map_size, sky_of_dome

_LOG = logging.getLogger(__name__)

_LEAST = 8_000_000
"""Texels of a map that is worth keeping."""

_MOST = 600_000_000
"""What all skies may take, a dozen [bytes]."""

_KINDS = kinds_in(Sky)

_DOME, _SUN = "dome.f32", "sun.json"


def kept_sky(sky: Sky, size: tuple[int, int] | None = None) -> SkyMap:
    """Return a baked sky: what was kept of it, or newly baked, and then kept if it is large.

    Args:
        sky: The recipe.
        size: Rows and columns of the map; default what the sky needs.
    """
    size = size or map_size(sky)
    if sky.image is not None or size[0] * size[1] < _LEAST:
        return bake_sky(sky, size)
    folder, upper = _folder(sky, size), (size[0] // 2, size[1])
    kept = _kept_dome(folder, upper)
    if kept is None:
        kept = bake_dome(sky, upper)
        _keep_dome(folder, *kept)
    return sky_of_dome(*kept)


def _folder(sky: Sky, size: tuple[int, int]) -> Path:
    """Return where a sky is kept: its recipe, our code and Mitsuba are in the name."""
    recipe = packed((sky, size, mi.__version__, mi.variant()), _KINDS)
    digest = hashlib.blake2b(catalog.code_digest("render/sky"), digest_size=16)
    for content in recipe.values():
        digest.update(content)
    return catalog.cache_root() / "skies" / digest.hexdigest()


def _kept_dome(folder: Path, size: tuple[int, int]) -> tuple[Image, Sun | None] | None:
    """Return a kept upper half and what stands in it; None if it is not there or damaged."""
    files = read_whole(folder)
    if files is None:
        return None
    with contextlib.suppress(OSError):
        os.utime(folder)  # the oldest are removed first
    sun = json.loads(files[_SUN])
    return np.frombuffer(files[_DOME], np.float32).reshape(*size, 3), sun and Sun(
        np.array(sun["direction"]), np.array(sun["irradiance"]), sun["moon"]
    )


def _keep_dome(folder: Path, dome: Image, sun: Sun | None) -> None:
    """Keep an upper half, and remove the oldest ones if there are too many."""
    about = sun and {
        "direction": sun.direction.tolist(),
        "irradiance": sun.irradiance.tolist(),
        "moon": sun.moon,
    }
    files: Files = {
        _DOME: np.asarray(dome, np.float32).tobytes(),
        _SUN: json.dumps(about).encode(),
    }
    try:
        keep(folder, files)
        make_room(folder, _MOST)
    except OSError as error:
        _LOG.info("%s: the sky is not kept (%s)", folder, error)
