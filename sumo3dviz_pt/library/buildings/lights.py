"""How bright windows, shops and signs are at night.

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

from collections.abc import Mapping
from typing import Literal

import numpy as np

from sumo3dviz_pt.library.buildings.facade import CLASSES
from sumo3dviz_pt.library.buildings.fronts import GOODS
from sumo3dviz_pt.model.colour import LUMINANCE
from sumo3dviz_pt.model.geometry import Colour, Floats

Use = Literal["home", "office", "shop"]
"""What a building is for, which says when and how it is lit."""

WINDOWS, SHOPS = "lamp:windows", "lamp:shops"
"""Materials of parts that become lamps; their tint is a luminance by channel [cd/m2]."""

_LIT = {"home": 0.35, "office": 0.3, "shop": 0.15}  # shares of lit rooms in the evening
_LUMINANCE = {"home": 7.0, "office": 12.0, "shop": 12.0}  # median [cd/m2]
_SPREAD = 0.65  # of its logarithm
_GOODS = (0.7, 1.5, 3.0, 5.0, 8.0, 15.0)  # what stands in lit shops [cd/m2]
_CEILING = 40.0  # of lit shops [cd/m2]
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
    found: dict[str, tuple[str, Colour]] = {}
    for number in range(CLASSES):
        on, hue = rng.random(), _HUES[use][rng.choice(len(_HUES[use]), p=_ODDS[use])]
        luminance = _LUMINANCE[use] * float(np.exp(rng.normal(0.0, _SPREAD)))
        cloth = rng.uniform(0.25, 0.6) * np.array(
            [1.0, rng.uniform(0.85, 1.0), rng.uniform(0.6, 1)]
        )
        if on < _LIT[use]:
            found[f"room{number}"] = (WINDOWS, _shining(hue, luminance))
            low = float(rng.uniform(0.3, 0.8))
            found[f"low{number}"] = (WINDOWS, _shining(hue * (1.0, 0.9, 0.8), low * luminance))
            found[f"drape{number}"] = (WINDOWS, _shining(hue * cloth, luminance * cloth.mean()))
    lamp = _HUES["shop"][rng.choice(3, p=_ODDS["shop"])]
    if rng.random() < 0.75:
        for number in range(GOODS):
            goods = lamp * (rng.uniform(0.6, 1.0, 3) if number else 1.0)
            shown = float(rng.choice(_GOODS)) if number else _CEILING
            found[f"shop{number}"] = (SHOPS, _shining(goods, shown))
    for number, sign in enumerate(signs):
        on, luminance = rng.random(), float(np.exp(rng.uniform(*_SIGNS)))
        if on < 0.7:
            # Acrylic glass lit from behind: pale colours of the board.
            found[f"sign{number}"] = (SHOPS, _shining(np.array(sign) / max(sign) + 0.06, luminance))
    return found


def _shining(hue: Floats, luminance: float) -> Colour:
    """Luminance by channel of a hue [cd/m2]."""
    r, g, b = hue * luminance / float(hue @ LUMINANCE)
    return float(r), float(g), float(b)
