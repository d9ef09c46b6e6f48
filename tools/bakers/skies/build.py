"""Cloud layers over the upper hemisphere: heaps under fields of flakes under cirrus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from bakers.skies.march import Cumulus, march, towards_of
from bakers.skies.sheets import altocumulus, cirrus, mackerel, stratus
from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.scene import CloudLayer


@dataclass(frozen=True, slots=True)
class CloudRecipe:
    """How a cloud layer is made.

    Attributes:
        rows: Rows of the map; it has four times as many columns.
        seed: Of everything random in it.
        sun: Azimuth clockwise from north and elevation of the sun it is lit by [rad].
        cover: Share of the ground plane under cumulus, [0, 1]; 0 leaves it out.
        base: Height of the cloud bases [m].
        depth: Height from bases to the highest tops [m].
        extinction: Of the densest cloud [1/m].
        cell: Typical distance from cloud to cloud [m].
        cirrus: Opacity of the densest cirrus, [0, 1].
        flakes: Opacity of the densest altocumulus, [0, 1].
        mackerel: Opacity of the densest altocumulus of a fair evening, [0, 1].
        backlit: How strongly cirrus and the evening's altocumulus shine around a low sun.
        fades: Elevation up to which air hides clouds [deg].
        stratus: Whether a closed deck hides all else.
        at_sun: How cloudy it is where the sun stands, from the clearest place of the
            field, 0, to its thickest, 1.
        steps: Of the march through the slab.
        texels: Of the billows along each side; details have half as many.
    """

    rows: int
    seed: int
    sun: tuple[float, float]
    cover: float = 0.0
    base: float = 1300.0
    depth: float = 850.0
    extinction: float = 0.045
    cell: float = 2300.0
    cirrus: float = 0.0
    flakes: float = 0.0
    mackerel: float = 0.0
    backlit: float = 0.0
    fades: float = 4.5
    stratus: bool = False
    at_sun: float = 0.0
    steps: int = 160
    texels: int = 128


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
    sun = towards_of(*recipe.sun)
    whole = np.zeros((rows * columns, 3))
    for sheet in _sheets(recipe, towards, sun, (rows, columns)):
        # Air hides what is low over the horizon.
        sheet[:, 0] *= smoothstep(np.radians(0.2), np.radians(recipe.fades), high)
        whole = _over(sheet, whole)
    if recipe.stratus:
        whole = _over(whole, stratus(towards, seed=recipe.seed))
    return _layer(whole, (rows, columns), recipe.sun[1])


def _sheets(
    recipe: CloudRecipe, towards: Floats, sun: Floats, shape: tuple[int, int]
) -> list[Floats]:
    """Sheets from the highest to the lowest; only those that the recipe has."""
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
        sheets.append(_smoothed(march(_cumulus(recipe), towards), shape))
    return sheets


def _cumulus(recipe: CloudRecipe) -> Cumulus:
    """The part of a recipe that is marched."""
    return Cumulus(
        recipe.seed,
        recipe.sun,
        recipe.cover,
        recipe.base,
        recipe.depth,
        recipe.extinction,
        recipe.cell,
        recipe.at_sun,
        recipe.steps,
        recipe.texels,
    )


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
    """A sheet, (n, 3), as maps."""

    def image(values: Floats) -> Image:
        return np.ascontiguousarray(values.reshape(shape), dtype=np.float32)

    return CloudLayer(image(sheet[:, 0]), image(sheet[:, 1]), image(sheet[:, 2]), lit_from)
