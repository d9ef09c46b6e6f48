"""What the roles of a building's shell are made of, in which colours, how bright at night.

The colours to draw from stand in `assets/palettes`. Windows, shops and signs shine at night.

References:
    EN 12464-1:2021 (light and lighting of work places): offices 500 lx, sales areas
    300 lx on level planes, and half of that or less on upright ones; homes have about 100 lx
    on tables in use. What is seen through a window is then illuminance x reflectance / pi
    (Lambert) x 0.8 for the pane, with 0.5 for walls and less for what stands there: homes
    about 7 cd/m2, offices 12 (behind tinted panes), goods in shops 0.7 to 15, lamps and
    ceilings of shops 40.
    CIE 150:2017, table on bright signs: at most 400 cd/m2 in suburbs, 800 in towns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_asset
from sumo3dviz_pt.library.buildings.facade import CLASSES
from sumo3dviz_pt.library.buildings.fronts import GOODS
from sumo3dviz_pt.library.buildings.panes import PANE
from sumo3dviz_pt.library.buildings.shell import BELOW, Palette
from sumo3dviz_pt.model.geometry import Colour, Floats
from sumo3dviz_pt.model.layers import LUMINANCE

Use = Literal["home", "office", "shop"]
"""What a building is for, which says when and how it is lit."""

WINDOWS, SHOPS = "lamp:windows", "lamp:shops"
"""Materials of parts that become lamps; their tint is a luminance by channel [cd/m2]."""

_LIT = {"home": 0.35, "office": 0.3, "shop": 0.15}  # shares of lit rooms in the evening
_LUMINANCE = {"home": 7.0, "office": 12.0, "shop": 12.0}  # median [cd/m2]
_SPREAD = 0.65  # of its logarithm
_SEEN = 0.85  # of a lit room's light that passes its furniture and cloth, about
_SHOPS = (5.0, 8.0, 11.0, 16.0)  # means of lit shop windows, with goods and ceilings [cd/m2]
_SIGNS = (np.log(10.0), np.log(60.0))  # of lit boards [log cd/m2]
# Lamps of 2700 K, 3500 K and 5000 K, and a television, as a camera set to 5000 K sees them
# after a few reflections in a room.
_HUES: Mapping[str, Floats] = {
    "home": np.array([(1.0, 0.58, 0.24), (1.0, 0.66, 0.34), (1.0, 0.8, 0.56), (0.62, 0.8, 1.0)]),
    "office": np.array([(1.0, 0.82, 0.6), (1.0, 0.93, 0.82), (0.88, 0.96, 1.0)]),
    "shop": np.array([(1.0, 0.76, 0.48), (1.0, 0.86, 0.66), (0.93, 0.98, 1.0)]),
}
_ODDS: Mapping[str, Floats] = {
    "home": np.array([0.4, 0.35, 0.2, 0.05]),
    "office": np.array([0.4, 0.4, 0.2]),
    "shop": np.array([0.5, 0.4, 0.1]),
}


def lit_roles(
    use: Use, signs: tuple[Colour, ...], rng: np.random.Generator
) -> dict[str, tuple[str, Colour]]:
    """Choose which roles of a building shine in the evening, and how.

    Args:
        use: What it is for.
        signs: Reflectances of its sign boards `sign0`, ... .
        rng: Chooses rooms, lamps and curtains.

    Returns:
        `WINDOWS` or `SHOPS` and the luminance by channel [cd/m2] of each lit role.
    """
    roles: dict[str, tuple[str, Colour]] = {}
    for number in range(CLASSES):
        on, hue = rng.random(), _HUES[use][rng.choice(len(_HUES[use]), p=_ODDS[use])]
        luminance = _LUMINANCE[use] * float(np.exp(rng.normal(0.0, _SPREAD)))
        if on < _LIT[use]:
            lit = (WINDOWS, _shining(hue, _SEEN * luminance))
            roles[f"room{number}"] = roles[f"bare{number}"] = lit
    lamp = _HUES["shop"][rng.choice(3, p=_ODDS["shop"])]
    if rng.random() < 0.85:
        for number in range(GOODS):
            shown = float(rng.choice(_SHOPS))
            roles[f"shop{number}"] = (SHOPS, _shining(lamp, shown))
    for number, sign in enumerate(signs):
        on, luminance = rng.random(), float(np.exp(rng.uniform(*_SIGNS)))
        if on < 0.7:
            # Acrylic glass lit from behind: pale colours of the board.
            roles[f"sign{number}"] = (SHOPS, _shining(np.array(sign) / max(sign) + 0.06, luminance))
    return roles


def _shining(hue: Floats, luminance: float) -> Colour:
    """Luminance by channel of a hue [cd/m2]."""
    r, g, b = hue * luminance / float(hue @ LUMINANCE)
    return float(r), float(g), float(b)


Role = tuple[str, Colour | None]
"""A material's name, and its colour unless it has one of its own."""

CLADDINGS: Mapping[str, str] = {
    "plaster": "wall",
    "brick": "wall",
    "concrete": "wall",
    "roof_tiles": "roof",
}
"""Surfaces that show a texture nearby, and the material that stands for each from afar."""

_PLAIN: Mapping[str, str] = {"glass": "glazing", "sheet": "sheet"}
"""Surfaces without a texture, and their materials."""

SURFACES = frozenset({*CLADDINGS, *_PLAIN})
"""What walls and roofs may be coated with."""


def cladding(surface: str) -> str:
    """Name the material that shows a surface in the colour of each face."""
    return f"cladding:{surface}"


@dataclass(frozen=True, slots=True)
class Coat(RecipeValue):
    """What a wall or a roof is coated with.

    Attributes:
        surface: One of `SURFACES`.
        colour: Its mean reflectance.
    """

    surface: str
    colour: Colour

    def __post_init__(self) -> None:
        """Check the surface's name, which no type can."""
        if self.surface not in SURFACES:
            raise ValueError(
                f"no surface of buildings is called {self.surface!r}"
                f"{did_you_mean(self.surface, SURFACES)}"
            )


@dataclass(frozen=True, slots=True)
class Colours:
    """What a style's colours are drawn from.

    Attributes:
        walls: Coats of walls.
        roofs: Coats of slopes and decks.
        use: What the building is for.
    """

    walls: tuple[Coat, ...]
    roofs: tuple[Coat, ...]
    use: Use = "home"


@dataclass(frozen=True, slots=True)
class _Accents(RecipeValue):
    """Reflectances of what is painted; each colour of a list is as usual as the others.

    Attributes:
        doors: Of front doors.
        signs: Of sign boards.
        letters: Of what is written on them, where it stands out.
        awnings: Of cloth over shop windows.
        frames: Of windows.
        panels: Of balconies.
        shopfronts: Of the joinery around shop windows, where it is painted.
        shutters: Of windows.
    """

    doors: tuple[Colour, ...]
    signs: tuple[Colour, ...]
    letters: tuple[Colour, ...]
    awnings: tuple[Colour, ...]
    frames: tuple[Colour, ...]
    panels: tuple[Colour, ...]
    shopfronts: tuple[Colour, ...]
    shutters: tuple[Colour, ...]


@dataclass(frozen=True, slots=True)
class _Palettes(RecipeValue):
    """Colours of all buildings: palettes of named coats, and accents."""

    coats: Mapping[str, Mapping[str, Coat]]
    accents: _Accents


@dataclass(frozen=True, slots=True, kw_only=True)
class _PalettesFile(AssetFile):
    """Content of an `asset.yaml` with palettes."""

    kind: Literal["palettes"]
    recipe: _Palettes


_KNOWN = read_asset("palettes", "buildings", _PalettesFile).recipe
_ACCENTS = _KNOWN.accents

SIGNS = _ACCENTS.signs
"""Colours of sign boards."""

_PALE: Colour = (0.55, 0.54, 0.51)


def coats(chosen: Sequence[str | Coat]) -> tuple[Coat, ...]:
    """Look coats up.

    Args:
        chosen: Palettes such as `facades`, single coats of one such as `facades.cream`, or coats
            that stand in no palette.

    Raises:
        ConfigError: If there is no such palette or coat; the message suggests one.
    """
    items: list[Coat] = []
    for item in chosen:
        items += [item] if isinstance(item, Coat) else _coats_called(item)
    return tuple(items)


def _coats_called(name: str) -> list[Coat]:
    """Return all coats of a palette, or the one that the name says."""
    palettes = _KNOWN.coats
    if name in palettes:
        return list(palettes[name].values())
    single = {f"{own}.{coat}": row for own, rows in palettes.items() for coat, row in rows.items()}
    if name not in single:
        hint = did_you_mean(name, [*palettes, *single])
        raise ConfigError(f"no palette or coat of buildings is called {name!r}{hint}")
    return [single[name]]


def palette(
    colours: Colours,
    rng: np.random.Generator,
    wall_colour: Colour | None = None,
    *,
    textured: bool = False,
    dark: bool = False,
) -> Palette:
    """Draw the colours of one building of a style: those of all roles that a shell may have.

    Args:
        colours: What to draw from.
        rng: Source of all choices.
        wall_colour: Instead of the style's.
        textured: Whether walls and roofs show their surfaces; from afar a plain colour
            looks the same and makes no noise.
        dark: Whether windows are lit.
    """
    wall = _drawn(colours.walls, rng)
    roof = _drawn(colours.roofs, rng)
    if wall_colour is not None:
        wall = replace(wall, colour=wall_colour)
    signs = tuple(_accent(SIGNS, rng) for _ in range(3))
    awning = _accent(_ACCENTS.awnings, rng)
    fittings = _fittings(wall.colour, rng)
    stone = Coat("concrete", _mixed(wall.colour, 0.4, (0.36, 0.34, 0.31)))
    front = None if rng.random() < 0.6 else _accent(_ACCENTS.shopfronts, rng)
    masonry = _masonry(wall, roof, stone)
    roles: dict[str, Role] = {name: _finish(coat, textured) for name, coat in masonry.items()}
    roles["front"] = _finish(stone, textured) if front is None else ("joinery", front)
    roles |= {role + BELOW: roles[role] for role in ("wall", "base", "front")}
    roles |= _plain_walls(wall.colour, roof.colour)
    roles |= fittings
    roles |= _lettered(signs, awning, rng.spawn(1)[0])
    roles |= _behind_glass(rng)
    if wall.surface == "glass":
        roles |= _coated(rng)
    if dark:
        roles |= lit_roles(colours.use, signs, rng)
    return roles


def _finish(coat: Coat, textured: bool) -> Role:
    """Return the material that shows a coat, and its colour."""
    if coat.surface in _PLAIN:
        return _PLAIN[coat.surface], coat.colour
    material = cladding(coat.surface) if textured else CLADDINGS[coat.surface]
    return material, coat.colour


def _masonry(wall: Coat, roof: Coat, stone: Coat) -> dict[str, Coat]:
    """Return the coats of what shows a surface nearby."""
    return {
        "wall": wall,
        "base": stone,
        "plinth": Coat("concrete", (0.26, 0.25, 0.24)),
        "chimney": Coat("brick", (0.26, 0.12, 0.085)),
        "roof": roof,
        "deck": Coat("concrete", (0.2, 0.197, 0.19)),
    }


def _plain_walls(wall: Colour, roof: Colour) -> dict[str, Role]:
    """Return the colours of small walls and edges."""
    return {
        "reveal": ("wall", _mixed(wall, 0.85, _PALE)),
        "trim": ("wall", _mixed(wall, 0.35, _PALE)),
        "coping": ("wall", (0.3, 0.295, 0.285)),
        "dormer": ("roof", _mixed(roof, 0.7, (0.12, 0.12, 0.125))),
    }


def _fittings(wall: Colour, rng: np.random.Generator) -> dict[str, Role]:
    """Draw the colours of doors, windows, rails and pipes of a house with such walls."""
    door, panel = _accent(_ACCENTS.doors, rng), _accent(_ACCENTS.panels, rng)
    shutter = _accent(_ACCENTS.shutters, rng)
    frame = _accent(_ACCENTS.frames, rng)
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
        "greens": ("wall", (0.045, 0.085, 0.024)),
        "door": ("joinery", door),
        "shutter": ("joinery", shutter),
    }


_CONTRAST = 4.0  # of letters against their board, as WCAG 2.2 counts luminances


def _lettered(signs: Sequence[Colour], awning: Colour, rng: np.random.Generator) -> dict[str, Role]:
    """Colour sign boards, letters that stand out from them, and awnings."""
    roles: dict[str, Role] = {"awning": ("cloth", awning)}
    for k, sign in enumerate(signs):
        shares = [_contrast(letter, sign) for letter in _ACCENTS.letters]
        limit = min(_CONTRAST, max(shares))
        clear = tuple(c for c, s in zip(_ACCENTS.letters, shares, strict=True) if s >= limit)
        roles[f"sign{k}"] = ("sign", sign)
        roles[f"letter{k}"] = ("sign", _accent(clear, rng))
    return roles


def _contrast(one: Colour, other: Colour) -> float:
    """Return how well two colours are told apart, [1, 21] (WCAG 2.2, "contrast ratio")."""
    low, high = sorted(float(np.dot(colour, LUMINANCE)) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def _behind_glass(rng: np.random.Generator) -> dict[str, Role]:
    """Draw the colours of the walls of rooms and shops behind panes."""
    roles: dict[str, Role] = {"gap": ("glazing", (0.02, 0.02, 0.02))}
    for number in range(CLASSES):
        wall = rng.uniform(0.35, 0.72) * np.array(
            [1.0, rng.uniform(0.86, 1.0), rng.uniform(0.68, 1.0)]
        )
        roles[f"room{number}"] = roles[f"bare{number}"] = (PANE, _colour(wall))
    for number in range(GOODS):
        roles[f"shop{number}"] = (PANE, _colour(rng.uniform(0.3, 0.7) * rng.uniform(0.7, 1.0, 3)))
    return roles


def _coated(rng: np.random.Generator) -> dict[str, Role]:
    """Draw the colours of panes with a coat against the sun, which show more sky than room."""
    tone = rng.uniform(0.15, 0.24) * np.array([0.86, 0.97, 1.0 + 0.1 * rng.random()])
    roles: dict[str, Role] = {}
    for number in range(CLASSES):
        pane = ("coated_glass", _colour(tone * rng.uniform(0.8, 1.15)))
        roles[f"room{number}"] = roles[f"bare{number}"] = pane
    return roles


def _drawn(coats: tuple[Coat, ...], rng: np.random.Generator) -> Coat:
    """Draw one of some coats, a little lighter or darker, and of a hue of its own."""
    coat = coats[int(rng.integers(len(coats)))]
    warm = rng.uniform(-0.05, 0.05)
    tone = rng.uniform(0.82, 1.12) * np.array([1.0 + warm, 1.0, 1.0 - 1.6 * warm])
    return replace(coat, colour=_colour(np.array(coat.colour) * tone))


def _accent(colours: tuple[Colour, ...], rng: np.random.Generator) -> Colour:
    """Draw one of some colours."""
    return colours[int(rng.integers(len(colours)))]


def _mixed(one: Colour, share: float, other: Colour) -> Colour:
    """Mix two colours by the share of the first one."""
    return _colour(share * np.array(one) + (1 - share) * np.array(other))


def _colour(values: np.ndarray) -> Colour:
    """Limit reflectances to those that surfaces have."""
    r, g, b = np.clip(values, 0.004, 0.75)
    return float(r), float(g), float(b)
