"""What the roles of a building's shell are made of, and in which colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.buildings.facade import CLASSES
from sumo3dviz_pt.library.buildings.fronts import GOODS
from sumo3dviz_pt.library.buildings.lights import Use, lit_roles
from sumo3dviz_pt.library.buildings.shell import Palette
from sumo3dviz_pt.model.geometry import Colour

Coat = tuple[str, Colour]
"""A cladding's name and its mean reflectance."""

Role = tuple[str, Colour | None]
"""A material's name, and its colour unless it has one of its own."""

CLADDINGS: Mapping[str, str] = {
    "plaster": "wall",
    "brick": "wall",
    "concrete": "wall",
    "roof_tiles": "roof",
}
"""Surfaces that show a texture nearby, and the material that stands for each from afar."""


def cladding(surface: str) -> str:
    """The material that shows a surface in the colour of each face."""
    return f"cladding:{surface}"


BRICKS: tuple[Coat, ...] = (
    ("brick", (0.27, 0.125, 0.09)),
    ("brick", (0.23, 0.1, 0.07)),
    ("brick", (0.33, 0.18, 0.12)),
    ("brick", (0.36, 0.27, 0.18)),
)
FACADES: tuple[Coat, ...] = (
    ("plaster", (0.6, 0.57, 0.5)),
    ("plaster", (0.66, 0.65, 0.62)),
    ("plaster", (0.56, 0.46, 0.3)),
    ("plaster", (0.54, 0.5, 0.42)),
    ("plaster", (0.52, 0.38, 0.28)),
    ("plaster", (0.45, 0.48, 0.46)),
    ("plaster", (0.48, 0.34, 0.22)),
    ("plaster", (0.58, 0.42, 0.17)),
    ("plaster", (0.52, 0.3, 0.22)),
    ("plaster", (0.42, 0.47, 0.38)),
    ("plaster", (0.4, 0.46, 0.52)),
)
PANELS: tuple[Coat, ...] = (
    ("plaster", (0.6, 0.59, 0.56)),
    ("concrete", (0.42, 0.41, 0.385)),
    ("plaster", (0.55, 0.5, 0.4)),
    ("plaster", (0.5, 0.52, 0.52)),
)
MODERN: tuple[Coat, ...] = (
    ("plaster", (0.68, 0.68, 0.66)),
    ("concrete", (0.38, 0.375, 0.36)),
    ("concrete", (0.5, 0.46, 0.39)),
    ("plaster", (0.3, 0.3, 0.3)),
)
GLAZED: tuple[Coat, ...] = (
    ("glass", (0.055, 0.085, 0.095)),
    ("glass", (0.16, 0.17, 0.175)),
    ("glass", (0.28, 0.285, 0.28)),
)
SHEETS: tuple[Coat, ...] = (
    ("sheet", (0.42, 0.43, 0.44)),
    ("sheet", (0.2, 0.26, 0.33)),
    ("sheet", (0.45, 0.42, 0.34)),
    ("sheet", (0.18, 0.2, 0.19)),
)
CLAY: tuple[Coat, ...] = (
    ("roof_tiles", (0.24, 0.1, 0.065)),
    ("roof_tiles", (0.27, 0.12, 0.08)),
    ("roof_tiles", (0.15, 0.085, 0.065)),
    ("roof_tiles", (0.085, 0.085, 0.09)),
)
SLATE: tuple[Coat, ...] = (
    ("roof_tiles", (0.075, 0.078, 0.085)),
    ("roof_tiles", (0.1, 0.1, 0.105)),
    ("roof_tiles", (0.17, 0.09, 0.065)),
)
DECKS: tuple[Coat, ...] = (("concrete", (0.22, 0.215, 0.21)), ("concrete", (0.15, 0.15, 0.155)))
DOORS: tuple[Colour, ...] = (
    (0.06, 0.09, 0.07),
    (0.16, 0.075, 0.035),
    (0.1, 0.02, 0.02),
    (0.04, 0.06, 0.11),
    (0.5, 0.5, 0.48),
)
SIGNS: tuple[Colour, ...] = (
    (0.42, 0.03, 0.03),
    (0.03, 0.12, 0.34),
    (0.03, 0.24, 0.09),
    (0.55, 0.32, 0.03),
    (0.05, 0.05, 0.055),
    (0.3, 0.04, 0.16),
    (0.5, 0.48, 0.44),
)


@dataclass(frozen=True, slots=True)
class Colours:
    """What a style's colours are drawn from.

    Attributes:
        walls: Surfaces and colours of walls.
        roofs: Of slopes and decks.
        signs: Of sign boards and gates.
        use: What the building is for.
    """

    walls: tuple[Coat, ...]
    roofs: tuple[Coat, ...]
    signs: tuple[Colour, ...] = SIGNS
    use: Use = "home"


_MATERIALS = {"glass": "glazing", "sheet": "sheet"}
_FRAMES: tuple[Colour, ...] = (
    (0.62, 0.62, 0.6),
    (0.62, 0.62, 0.6),
    (0.09, 0.05, 0.03),
    (0.05,) * 3,
)
_PANELS: tuple[Colour, ...] = (
    (0.5, 0.5, 0.48),
    (0.4, 0.32, 0.2),
    (0.2, 0.28, 0.36),
    (0.42, 0.2, 0.12),
    (0.28, 0.34, 0.24),
)
_SHOPFRONTS: tuple[Colour, ...] = (
    (0.05, 0.055, 0.06),
    (0.05, 0.09, 0.07),
    (0.11, 0.04, 0.035),
    (0.35, 0.31, 0.24),
    (0.045, 0.07, 0.12),
)
_SHUTTERS: tuple[Colour, ...] = (
    (0.045, 0.1, 0.065),
    (0.13, 0.065, 0.035),
    (0.2, 0.25, 0.26),
    (0.36, 0.35, 0.32),
)
_PALE: Colour = (0.55, 0.54, 0.51)


def palette(
    colours: Colours,
    rng: np.random.Generator,
    wall_colour: Colour | None = None,
    *,
    textured: bool = False,
    dark: bool = False,
) -> Palette:
    """Colours of one building of a style; all roles that a shell may have.

    Args:
        colours: What to draw from.
        rng: Draws.
        wall_colour: Instead of the style's.
        textured: Whether walls and roofs show their surfaces; from afar a plain colour
            looks the same and makes no noise.
        dark: Whether windows are lit.
    """
    surface, main = _drawn(colours.walls, rng)
    roof = _drawn(colours.roofs, rng)
    main = wall_colour or main
    signs = tuple(_accent(colours.signs, rng) for _ in range(3))
    fittings = _fittings(main, rng)
    stone: Coat = ("concrete", _mixed(main, 0.4, (0.36, 0.34, 0.31)))
    front = None if rng.random() < 0.6 else _accent(_SHOPFRONTS, rng)
    masonry = _masonry((surface, main), roof, stone)
    roles: dict[str, Role] = {name: _finish(coat, textured) for name, coat in masonry.items()}
    roles["front"] = _finish(stone, textured) if front is None else ("joinery", front)
    roles |= _plain_walls(main, roof[1])
    roles |= fittings
    roles |= _lettered(signs)
    roles |= _behind_glass(rng)
    if surface == "glass":
        roles |= _coated(rng)
    if dark:
        roles |= lit_roles(colours.use, signs, rng)
    return roles


def _finish(coat: Coat, textured: bool) -> Role:
    """The material that shows a coat."""
    surface, colour = coat
    if surface not in CLADDINGS:
        return _MATERIALS[surface], colour
    return (cladding(surface) if textured else CLADDINGS[surface]), colour


def _masonry(wall: Coat, roof: Coat, stone: Coat) -> dict[str, Coat]:
    """Coats of what shows a surface nearby."""
    return {
        "wall": wall,
        "base": stone,
        "plinth": ("concrete", (0.26, 0.25, 0.24)),
        "chimney": ("brick", (0.26, 0.12, 0.085)),
        "roof": roof,
        "deck": ("concrete", (0.2, 0.197, 0.19)),
    }


def _plain_walls(wall: Colour, roof: Colour) -> dict[str, Role]:
    """Small walls and edges."""
    return {
        "reveal": ("wall", _mixed(wall, 0.85, _PALE)),
        "trim": ("wall", _mixed(wall, 0.35, _PALE)),
        "coping": ("wall", (0.3, 0.295, 0.285)),
        "dormer": ("roof", _mixed(roof, 0.7, (0.12, 0.12, 0.125))),
    }


def _fittings(wall: Colour, rng: np.random.Generator) -> dict[str, Role]:
    """Doors, windows, rails and pipes of a house with such walls."""
    door, panel = _accent(DOORS, rng), _accent(_PANELS, rng)
    shutter = _accent(_SHUTTERS, rng)
    frame = _accent(_FRAMES, rng)
    return {
        "frame": ("joinery", frame),
        "eaves": ("wall", _mixed(frame, 0.5, (0.3, 0.28, 0.25))),
        "joint": ("joinery", (0.04, 0.042, 0.045)),
        "metal": ("metal_sheet", None),
        "cooler": ("joinery", (0.5, 0.495, 0.47)),
        "pipe": ("metal_sheet", None),
        "rail": ("joinery", (0.03, 0.032, 0.034)),
        "panel": ("joinery", _mixed(panel, 0.8, wall)),
        "glazing": ("glazing", (0.1, 0.12, 0.12)),
        "door": ("joinery", door),
        "shutter": ("joinery", shutter),
    }


def _lettered(signs: Sequence[Colour]) -> dict[str, Role]:
    """Sign boards, letters that stand out from them, and an awning to match."""
    roles: dict[str, Role] = {"awning": ("cloth", signs[1])}
    for k, sign in enumerate(signs):
        roles[f"sign{k}"] = ("sign", sign)
        roles[f"letter{k}"] = ("sign", (0.72, 0.72, 0.7) if max(sign[1:]) < 0.34 else (0.05,) * 3)
    return roles


def _behind_glass(rng: np.random.Generator) -> dict[str, Role]:
    """Colours of rooms, blinds and goods as seen through panes."""
    found: dict[str, Role] = {}
    for number in range(CLASSES):
        depth = float(rng.uniform(0.01, 0.05))
        cloth = rng.uniform(0.17, 0.5) * np.array([1.0, rng.uniform(0.9, 1), rng.uniform(0.75, 1)])
        found[f"room{number}"] = ("glazing", (depth, depth * 1.05, depth * 1.1))
        low = 0.7 * depth
        found[f"low{number}"] = ("glazing", (low, low * 0.97, low * 0.93))
        found[f"drape{number}"] = ("glazing", _colour(cloth))
    for number in range(GOODS):
        goods = rng.uniform(0.01, 0.16) * rng.uniform(0.75, 1.0, 3)
        found[f"shop{number}"] = ("glazing", _colour(goods))
    return found


def _coated(rng: np.random.Generator) -> dict[str, Role]:
    """Panes with a coat against the sun, which shows more sky than room."""
    tone = rng.uniform(0.15, 0.24) * np.array([0.86, 0.97, 1.0 + 0.1 * rng.random()])
    found: dict[str, Role] = {}
    for number in range(CLASSES):
        pane = ("coated_glass", _colour(tone * rng.uniform(0.8, 1.15)))
        found[f"room{number}"] = found[f"low{number}"] = pane
    return found


def _drawn(coats: tuple[Coat, ...], rng: np.random.Generator) -> Coat:
    """One of some coats, a little lighter or darker."""
    surface, colour = coats[int(rng.integers(len(coats)))]
    return surface, _colour(np.array(colour) * rng.uniform(0.88, 1.1))


def _accent(colours: tuple[Colour, ...], rng: np.random.Generator) -> Colour:
    """One of some colours."""
    return colours[int(rng.integers(len(colours)))]


def _mixed(one: Colour, share: float, other: Colour) -> Colour:
    """A mixture of two colours."""
    return _colour(share * np.array(one) + (1 - share) * np.array(other))


def _colour(values: np.ndarray) -> Colour:
    """A reflectance that surfaces have."""
    r, g, b = np.clip(values, 0.004, 0.75)
    return float(r), float(g), float(b)
