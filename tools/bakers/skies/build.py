"""Cloud layers over the upper hemisphere: heaps under fields of flakes under cirrus."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from bakers.skies.march import march
from bakers.skies.recipe import CloudRecipe, towards_of
from bakers.skies.sheets import altocumulus, cirrus, mackerel, stratus
from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.weather import CloudLayer


def make_clouds(recipe: CloudRecipe) -> CloudLayer:
    """Look at a cloud layer in all directions above the horizon.

    Args:
        recipe: How it is made.

    Returns:
        Maps of (rows, 4 x rows), axes as in `CloudLayer`.
    """
    rows, columns = recipe.rows, 4 * recipe.rows
    elevation = (1.0 - (np.arange(rows) + 0.5) / rows) * np.pi / 2
    azimuth = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    high = np.repeat(elevation, columns)
    towards = towards_of(np.tile(azimuth, rows), high)
    return _layer(look(recipe, towards, (rows, columns)), (rows, columns), recipe.sun[1])


def look(recipe: CloudRecipe, towards: Floats, shape: tuple[int, int]) -> Floats:
    """Look at a cloud layer in directions.

    Args:
        recipe: How it is made.
        towards: Unit vectors above the horizon, (n, 3).
        shape: Rows and columns of the picture that they make, n in all.

    Returns:
        Opacity, sunlit and skylit share, (n, 3).
    """
    sun, high = towards_of(*recipe.sun), np.arcsin(towards[:, 2])
    whole = np.zeros((len(towards), 3))
    for sheet in _sheets(recipe, towards, sun, shape):
        # Air hides what is low over the horizon.
        sheet[:, 0] *= smoothstep(np.radians(0.2), np.radians(recipe.fades), high)
        whole = _over(sheet, whole)
    if recipe.stratus:
        whole = _over(whole, stratus(towards, seed=recipe.seed))
    return whole


def _sheets(
    recipe: CloudRecipe, towards: Floats, sun: Floats, shape: tuple[int, int]
) -> list[Floats]:
    """Make the sheets that a recipe has, from the highest to the lowest, (n, 3) each."""
    sheets = []
    seed, backlit = recipe.seed, recipe.backlit
    if recipe.cirrus > 0.0:
        made = cirrus(towards, seed=seed + 20, opacity=recipe.cirrus, sun=sun, backlit=backlit)
        sheets.append(made)
    if recipe.mackerel > 0.0:
        made = mackerel(towards, seed=seed + 40, opacity=recipe.mackerel, sun=sun, backlit=backlit)
        sheets.append(made)
    if recipe.flakes > 0.0:
        sheets.append(altocumulus(towards, seed=seed + 30, opacity=recipe.flakes, sun=sun))
    if recipe.cover > 0.0:
        sheets.append(_smoothed(march(recipe, towards), shape))
    return sheets


def _smoothed(sheet: Floats, shape: tuple[int, int]) -> Floats:
    """Take the march's jitter out of a sheet, (n, 3), at the scale of a texel."""
    weighted = np.column_stack([sheet[:, :1], sheet[:, :1] * sheet[:, 1:]]).reshape(*shape, 3)
    across = gaussian_filter(weighted, (0.0, 0.6, 0.0), mode="wrap")
    calm = np.asarray(gaussian_filter(across, (0.6, 0.0, 0.0), mode="nearest")).reshape(-1, 3)
    return np.column_stack([calm[:, :1], calm[:, 1:] / np.maximum(calm[:, :1], 1e-4)])


def _over(near: Floats, far: Floats) -> Floats:
    """Lay one sheet over another, both (n, 3), straight colours."""
    shown = far[:, :1] * (1.0 - near[:, :1])
    cover = near[:, :1] + shown
    light = (near[:, :1] * near[:, 1:] + shown * far[:, 1:]) / np.maximum(cover, 1e-4)
    return np.column_stack([cover, light])


def _layer(sheet: Floats, shape: tuple[int, int], lit_from: float) -> CloudLayer:
    """Turn a sheet, (n, 3), into maps."""

    def image(values: Floats) -> Image:
        return np.ascontiguousarray(values.reshape(shape), dtype=np.float32)

    return CloudLayer(image(sheet[:, 0]), image(sheet[:, 1]), image(sheet[:, 2]), lit_from)
