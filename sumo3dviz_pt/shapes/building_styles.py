"""Building models by name: shells with colours to draw from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.scene import Colour
from sumo3dviz_pt.shapes.buildings import block, home, shop
from sumo3dviz_pt.shapes.shell import Palette, Shell


@dataclass(frozen=True, slots=True)
class Style:
    """A kind of building with its colours.

    Attributes:
        build: Makes the shell of a seed and a level of detail.
        walls: Wall colours to draw from.
        roofs: Roof colours to draw from.
        accents: Colours of doors, signs and blinds to draw from.
        variants: How many shells are told apart.
    """

    build: Callable[[int, int], Shell]
    walls: tuple[Colour, ...]
    roofs: tuple[Colour, ...]
    accents: tuple[Colour, ...]
    variants: int = 5


BRICKWORK, PLASTERED, TILED = (0.27, 0.125, 0.09), (0.7, 0.7, 0.7), (0.24, 0.1, 0.065)
"""Mean reflectances of the surfaces that stand for these colours nearby."""

SURFACES: Mapping[Colour, str] = {
    BRICKWORK: "surface:brick",
    PLASTERED: "surface:plaster",
    TILED: "surface:roof_tiles",
}
"""Materials with textures, by their mean reflectance."""


def palette(
    style: Style,
    rng: np.random.Generator,
    wall_colour: Colour | None = None,
    *,
    textured: bool = False,
) -> Palette:
    """Colours of one building of a style; all roles that a shell may have.

    Args:
        style: What to draw from.
        rng: Draws.
        wall_colour: Instead of the style's.
        textured: Whether walls and roofs with a colour of `SURFACES` show that surface;
            from afar a plain colour looks the same and makes no noise.
    """

    def drawn(colours: tuple[Colour, ...]) -> Colour:
        base, factor = colours[int(rng.integers(len(colours)))], rng.uniform(0.92, 1.08)
        if base in SURFACES:
            return base
        r, g, b = np.clip(np.array(base) * factor, 0.01, 0.8)
        return float(r), float(g), float(b)

    def finish(material: str, colour: Colour) -> tuple[str, Colour | None]:
        surface = SURFACES.get(colour) if textured else None
        return (material, colour) if surface is None else (surface, None)

    main, roof, accent = drawn(style.walls), drawn(style.roofs), drawn(style.accents)
    main = wall_colour or main
    pale: Colour = (0.55, 0.54, 0.51)

    def mixed(share: float, other: Colour) -> Colour:
        r, g, b = (share * m + (1 - share) * o for m, o in zip(main, other, strict=True))
        return r, g, b

    base = mixed(0.45, (0.3, 0.29, 0.27))
    return {
        "wall": finish("wall", main),
        "base": ("wall", base),
        "plinth": ("wall", (0.26, 0.25, 0.24)),
        "reveal": ("wall", mixed(0.9, pale)),
        "trim": ("wall", mixed(0.3, pale)),
        "chimney": ("wall", (0.3, 0.14, 0.1)),
        "roof": finish("roof", roof),
        "deck": ("roof", (0.2,) * 3),
        "band": ("sign", mixed(0.3, (0.03, 0.035, 0.04))),
        "window": ("window", None),
        "frame": ("frame", None),
        "sill": ("frame", None),
        "metal": ("metal_sheet", None),
        "rail": ("signal_housing", None),
        "blind": ("wall", mixed(0.2, (0.5, 0.48, 0.44))),
        "door": ("sign", accent),
        "sign": ("sign", accent),
        "awning": ("sign", accent),
        "letter": ("sign", (0.72, 0.72, 0.7)),
    }


_BRICK: tuple[Colour, ...] = (BRICKWORK, BRICKWORK, (0.36, 0.18, 0.12))
_PLASTER: tuple[Colour, ...] = (
    (0.62, 0.6, 0.55),
    PLASTERED,
    (0.58, 0.47, 0.28),
    (0.56, 0.52, 0.44),
    (0.55, 0.4, 0.3),
    (0.48, 0.52, 0.5),
)
_TILES: tuple[Colour, ...] = (
    TILED,
    TILED,
    (0.07, 0.072, 0.078),
    (0.13, 0.085, 0.065),
)
_DECK: tuple[Colour, ...] = ((0.22, 0.215, 0.21), (0.16, 0.16, 0.165))
_DOORS: tuple[Colour, ...] = (
    (0.06, 0.09, 0.07),
    (0.16, 0.075, 0.035),
    (0.1, 0.02, 0.02),
    (0.04, 0.06, 0.11),
    (0.5, 0.5, 0.48),
)
_SIGNS: tuple[Colour, ...] = (
    (0.42, 0.03, 0.03),
    (0.03, 0.12, 0.34),
    (0.03, 0.24, 0.09),
    (0.55, 0.32, 0.03),
    (0.05, 0.05, 0.055),
    (0.3, 0.04, 0.16),
)

HOMES: Mapping[str, Style] = {
    "plaster": Style(home, _PLASTER[:4], _TILES, _DOORS),
    "brick": Style(home, _BRICK, _TILES[2:], _DOORS),
}
"""Family houses by model."""

SHOPS: Mapping[str, Style] = {"pavilion": Style(shop, (*_PLASTER, BRICKWORK), _DECK, _SIGNS)}
"""Shops by model."""

BLOCKS: Mapping[str, Style] = {
    "plaster": Style(block, _PLASTER, _DECK, _DOORS, variants=8),
    "brick": Style(block, _BRICK, _DECK, _DOORS, variants=5),
}
"""Apartment blocks by model."""
