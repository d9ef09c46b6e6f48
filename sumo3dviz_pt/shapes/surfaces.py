"""Tileable maps of road, ground and wall surfaces, by name of their maker.

A maker turns a `Recipe` into `Maps`; `MAKERS` registers them and an `asset.yaml`
names one. Maps are scaled to the asset's declared albedo, so that mean light
levels can be computed from the declaration.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.shapes import surface_grounds, surface_roads, surface_walls
from sumo3dviz_pt.shapes.surface_maps import Maps, Recipe

MAKERS: Mapping[str, Callable[[Recipe], Maps]] = MappingProxyType(
    {
        "asphalt": surface_roads.asphalt,
        "concrete": surface_roads.concrete,
        "paving": surface_roads.paving,
        "grass": surface_grounds.grass,
        "litter": surface_grounds.litter,
        "gravel": surface_grounds.gravel,
        "sand": surface_grounds.sand,
        "chess": surface_grounds.chess,
        "plaster": surface_walls.plaster,
        "brick": surface_walls.brick,
        "roof_tiles": surface_walls.roof_tiles,
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
