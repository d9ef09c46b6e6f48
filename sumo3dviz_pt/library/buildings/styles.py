"""Building models by name: designs with sizes and colours to draw from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.buildings.build import Design, raised, rectangle
from sumo3dviz_pt.library.buildings.designs import (
    BUNGALOW,
    CURTAIN_WALL,
    GABLED,
    HALL,
    HIPPED,
    OFFICE,
    PAVILION,
    PERIMETER,
    ROW,
    ROW_BRICKS,
    ROW_HOUSES,
    ROW_INFILLS,
    SLAB,
    SUPERMARKET,
    TENEMENT,
)
from sumo3dviz_pt.library.buildings.palettes import (
    BRICKS,
    CLAY,
    DECKS,
    FACADES,
    GLAZED,
    MODERN,
    PANELS,
    SHEETS,
    SLATE,
    Colours,
)
from sumo3dviz_pt.library.buildings.shell import Shell
from sumo3dviz_pt.model.geometry import Floats

Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Style:
    """A kind of building with its sizes and colours.

    Attributes:
        designs: To draw from.
        width: Of the front [m].
        depth: [m].
        height: Of the walls [m].
        colours: To draw from.
        variants: How many shells are told apart.
    """

    designs: tuple[Design, ...]
    width: Span
    depth: Span
    height: Span
    colours: Colours
    variants: int = 5

    def build(self, seed: int, level: int) -> Shell:
        """The shell of a variant at a level of detail, its front at +x."""
        rng = np.random.default_rng(seed)
        width, depth, height = (
            float(rng.uniform(*s)) for s in (self.width, self.depth, self.height)
        )
        design = self.designs[int(rng.integers(len(self.designs)))]
        plan = self.plan(depth, width)
        return raised(plan, design, height=height, level=level, seed=seed)

    @staticmethod
    def plan(depth: float, width: float) -> Floats:
        """Corners of the plan, front first, (4, 2) [m]."""
        return rectangle(depth, width)


HOMES: Mapping[str, Style] = {
    "plaster": Style(
        (GABLED,),
        (9.0, 11.5),
        (8.2, 9.6),
        (5.5, 6.0),
        Colours(FACADES[:4], CLAY),
        variants=6,
    ),
    "brick": Style((GABLED,), (9.0, 11.0), (8.4, 9.6), (5.5, 6.0), Colours(BRICKS, SLATE)),
    "hipped": Style((HIPPED,), (11.0, 13.5), (9.5, 11.0), (5.4, 6.0), Colours(FACADES, CLAY)),
    "bungalow": Style((BUNGALOW,), (12.0, 15.0), (9.0, 11.0), (3.1, 3.5), Colours(MODERN, DECKS)),
    "row": Style(
        (ROW,), (14.0, 17.5), (8.5, 9.5), (5.5, 6.2), Colours((*BRICKS, *FACADES[:3]), CLAY)
    ),
}
"""Family houses by model."""

SHOPS: Mapping[str, Style] = {
    "pavilion": Style(
        (PAVILION,),
        (12.0, 16.0),
        (11.0, 13.0),
        (4.4, 5.0),
        Colours((*FACADES, *BRICKS), DECKS, use="shop"),
    ),
    "supermarket": Style(
        (SUPERMARKET,),
        (15.0, 17.0),
        (12.0, 14.0),
        (5.2, 6.0),
        Colours((*PANELS, *BRICKS[:1]), DECKS, use="shop"),
    ),
    "hall": Style(
        (HALL,), (13.0, 16.0), (13.0, 15.0), (5.6, 6.8), Colours(SHEETS, SHEETS, use="shop")
    ),
}
"""Shops by model."""

BLOCKS: Mapping[str, Style] = {
    "plaster": Style(
        PERIMETER,
        (17.0, 22.0),
        (12.5, 14.0),
        (15.5, 22.0),
        Colours(FACADES, (*SLATE, *CLAY)),
        variants=8,
    ),
    "brick": Style(
        TENEMENT,
        (16.0, 20.0),
        (12.0, 13.5),
        (14.5, 20.0),
        Colours(BRICKS, DECKS),
        variants=6,
    ),
    "slab": Style(
        SLAB, (18.0, 22.0), (11.5, 13.0), (15.0, 25.0), Colours(PANELS, DECKS), variants=6
    ),
    "office": Style(
        (OFFICE,),
        (18.0, 22.0),
        (13.0, 15.0),
        (17.0, 26.0),
        Colours(MODERN, DECKS, use="office"),
        variants=4,
    ),
    "curtain_wall": Style(
        (CURTAIN_WALL,),
        (17.0, 21.0),
        (13.0, 15.0),
        (20.0, 29.0),
        Colours(GLAZED, DECKS, use="office"),
        variants=3,
    ),
}
"""Apartment and office blocks by model."""

_OLD = Style(ROW_HOUSES, (12.0, 20.0), (9.0, 12.0), (14.0, 21.0), Colours(FACADES, (*SLATE, *CLAY)))
_BRICK = Style(ROW_BRICKS, (12.0, 20.0), (9.0, 12.0), (14.0, 20.0), Colours(BRICKS, DECKS))
_NEWER = Style(ROW_INFILLS, (12.0, 20.0), (9.0, 12.0), (14.0, 22.0), Colours(PANELS, DECKS))

ROWS: tuple[tuple[Style, float], ...] = (
    (_OLD, 10.0),
    (_BRICK, 3.5),
    (_NEWER, 2.5),
    (BLOCKS["office"], 0.9),
    (BLOCKS["curtain_wall"], 0.5),
)
"""Styles of houses in closed rows, and how usual each is."""
