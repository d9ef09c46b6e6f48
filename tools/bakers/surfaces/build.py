"""Tileable maps of road, ground and wall surfaces, by name of their maker.

A maker turns a `Recipe` into `Maps`; `MAKERS` registers them and an `asset.yaml`
names one. Maps are scaled to the asset's declared albedo, so that mean light
levels can be computed from the declaration.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from bakers.surfaces import grounds, roads, walls
from bakers.surfaces.maps import Maps, Recipe
from sumo3dviz_pt.errors import ConfigError

MAKERS: Mapping[str, Callable[[Recipe], Maps]] = MappingProxyType(
    {
        "asphalt": roads.asphalt,
        "concrete": roads.concrete,
        "paving": roads.paving,
        "grass": grounds.grass,
        "litter": grounds.litter,
        "gravel": grounds.gravel,
        "sand": grounds.sand,
        "chess": grounds.chess,
        "plaster": walls.plaster,
        "brick": walls.brick,
        "roof_tiles": walls.roof_tiles,
    }
)


def make_surface(maker: str, recipe: Recipe) -> Maps:
    """Make the maps of a surface.

    Args:
        maker: A name in `MAKERS`.
        recipe: Size, mean colour, seed and the maker's own numbers.

    Raises:
        ConfigError: If there is no such maker.
    """
    if maker not in MAKERS:
        raise ConfigError(f"no surface maker is called {maker!r}; known: {', '.join(MAKERS)}")
    return MAKERS[maker](recipe)
