"""Bakes a sky asset's cloud layer from the recipe in its `asset.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bakers.skies.build import make_clouds
from bakers.skies.recipe import CloudRecipe
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.library.pictures import cloud_image

CLOUD_LOSS = 300.0
"""Level of DWAB compression: errors of 0.006 rms, a megabyte a sky."""


def cloud_recipe(meta: Mapping[str, Any]) -> CloudRecipe:
    """Read the recipe of a sky asset.

    Args:
        meta: Content of `asset.yaml`; angles there are degrees.

    Raises:
        ConfigError: If a key is missing or unknown.
    """
    try:
        sun = np.radians([float(meta["sun"]["azimuth"]), float(meta["sun"]["elevation"])])
        return CloudRecipe(sun=(float(sun[0]), float(sun[1])), **meta["recipe"])
    except (KeyError, TypeError) as error:
        raise ConfigError(f"a sky's asset.yaml is incomplete or wrong: {error}") from error


def bake_clouds(folder: Path, *, lossy: float | None = CLOUD_LOSS) -> tuple[Path, ...]:
    """Make the cloud map in a sky's folder again from its `asset.yaml`, the same every time.

    Args:
        folder: The asset's folder.
        lossy: Level of DWAB compression; None stores half floats without loss.

    Returns:
        The file written.

    Raises:
        ConfigError: If `asset.yaml` is incomplete.
    """
    meta = yaml.safe_load((folder / "asset.yaml").read_text(encoding="utf-8"))
    path = folder / str(meta["map"])
    radiance = cloud_image(make_clouds(cloud_recipe(meta)))
    write_exr(path, {"radiance": radiance}, lossy=lossy)
    return (path,)
