"""How the species of trees and shrubs grow: their habits as numbers.

References:
    Habits, heights, bark and leaf arrangements: common European street and forest trees;
    leaf reflectances: the project's look study.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from sumo3dviz_pt.model.geometry import Colour


@dataclass(frozen=True, slots=True)
class Species:
    """How a tree grows. Lengths are shares of its height, unless a unit is given.

    Attributes:
        height: Usual height [m].
        girth: Radius of the trunk at the ground.
        clear: Where the crown begins.
        reach: Length of the longest boughs.
        crown: Envelope of bough lengths at crown heights 0, 1/4, 1/2, 3/4, 1.
        rise: Angle between boughs and trunk, lowest and highest bough [rad].
        boughs: How many leave the trunk.
        leaf: Reflectance of the leaves.
        area: One-sided leaf area per squared height.
        bark: Reflectance of trunk and boughs.
        fork: Branches of a bough and twigs of a branch.
        bend: Upward bend of branches per step; negative droops.
        slender: Length of a leaf by its width.
        stray: How far leaves lie from their twig.
        turn: How far leaves turn away from their twig's direction.
        hang: How far leaves hang down.
        begin: From which share of a twig on it bears leaves.
        top: Where the trunk ends.
        whorl: Boughs that leave the trunk at one height; 1 for spirals.
        flat: Whether boughs branch in a plane, as those of firs do.
        wobble: How crooked branches are.
        upper_bark: Reflectance of upper trunk and boughs, or None.
        marks: Share of dark marks on the bark.
        thick: Radius of boughs by that of the trunk there.
        share: How often it is drawn where nobody chooses, against 1.
    """

    height: float
    girth: float
    clear: float
    reach: float
    crown: tuple[float, float, float, float, float]
    rise: tuple[float, float]
    boughs: int
    leaf: Colour
    area: float
    bark: Colour = (0.105, 0.083, 0.062)
    fork: tuple[int, int] = (7, 5)
    bend: float = 0.03
    slender: float = 1.6
    stray: float = 0.019
    turn: float = 0.8
    hang: float = 0.35
    begin: float = 0.2
    top: float = 0.9
    whorl: int = 1
    flat: bool = False
    wobble: float = 0.12
    upper_bark: Colour | None = None
    marks: float = 0.0
    thick: float = 0.5
    share: float = 1.0


SPECIES: Mapping[str, Species] = MappingProxyType(
    {
        # Plane or maple: round, wide, large leaves, bark in light patches.
        "maple": Species(
            10.5,
            0.019,
            0.24,
            0.42,
            (0.75, 1.0, 0.95, 0.72, 0.35),
            (1.2, 0.45),
            24,
            (0.121, 0.202, 0.044),
            1.8,
            bark=(0.16, 0.145, 0.11),
            marks=0.25,
            slender=1.35,
            share=3.0,
        ),
        # Lime: a tall egg, dense down to low skirts.
        "lime": Species(
            13.0,
            0.017,
            0.17,
            0.31,
            (0.95, 1.0, 0.86, 0.62, 0.28),
            (1.35, 0.4),
            32,
            (0.105, 0.185, 0.046),
            1.35,
            bark=(0.09, 0.078, 0.062),
            fork=(6, 5),
            bend=0.01,
            slender=1.3,
            share=3.0,
        ),
        # Oak: few strong crooked boughs, wider than tall, clumps with gaps between.
        "oak": Species(
            11.5,
            0.027,
            0.20,
            0.50,
            (0.85, 1.0, 0.95, 0.75, 0.45),
            (1.35, 0.6),
            15,
            (0.096, 0.157, 0.037),
            2.0,
            bark=(0.085, 0.072, 0.056),
            fork=(8, 6),
            wobble=0.24,
            stray=0.021,
            slender=1.7,
            begin=0.35,
            top=0.72,
            share=1.5,
        ),
        # Birch: white stem, airy crown, small leaves on hanging twigs.
        "birch": Species(
            12.0,
            0.0105,
            0.20,
            0.24,
            (0.85, 1.0, 0.86, 0.58, 0.22),
            (0.85, 0.4),
            26,
            (0.148, 0.230, 0.053),
            0.66,
            bark=(0.52, 0.50, 0.46),
            upper_bark=(0.30, 0.24, 0.19),
            marks=0.22,
            fork=(6, 4),
            bend=-0.11,
            hang=0.8,
            stray=0.016,
            slender=1.5,
            begin=0.1,
            share=2.0,
        ),
        # Lombardy poplar: a flame of steep boughs.
        "poplar": Species(
            17.0,
            0.0115,
            0.06,
            0.17,
            (0.75, 1.0, 0.95, 0.72, 0.3),
            (0.42, 0.16),
            44,
            (0.114, 0.190, 0.051),
            0.44,
            bark=(0.12, 0.105, 0.082),
            fork=(6, 4),
            bend=0.12,
            hang=0.15,
            stray=0.010,
            slender=1.2,
            begin=0.05,
            top=0.95,
            share=0.8,
        ),
        # Spruce: a cone of whorled, hanging fans.
        "spruce": Species(
            15.0,
            0.0125,
            0.05,
            0.21,
            (1.0, 0.80, 0.56, 0.31, 0.05),
            (1.75, 1.05),
            138,
            (0.046, 0.087, 0.037),
            1.85,
            bark=(0.11, 0.075, 0.055),
            fork=(9, 2),
            bend=0.025,
            slender=4.5,
            stray=0.004,
            turn=0.35,
            hang=0.25,
            begin=0.0,
            top=0.98,
            whorl=6,
            thick=0.22,
            flat=True,
            wobble=0.06,
            share=1.0,
        ),
        # Scots pine: bare reddish stem, flat clouds of needle tufts.
        "pine": Species(
            13.0,
            0.0135,
            0.48,
            0.29,
            (0.8, 1.0, 0.95, 0.8, 0.45),
            (1.4, 0.75),
            20,
            (0.068, 0.118, 0.053),
            0.75,
            bark=(0.10, 0.075, 0.058),
            upper_bark=(0.27, 0.135, 0.07),
            fork=(6, 5),
            bend=0.10,
            slender=6.0,
            stray=0.010,
            turn=1.1,
            hang=-0.4,
            begin=0.55,
            wobble=0.2,
            share=1.2,
        ),
        # Ornamental pear or cherry: the small upright tree of narrow streets.
        "pear": Species(
            6.5,
            0.0135,
            0.29,
            0.30,
            (0.8, 1.0, 0.95, 0.75, 0.35),
            (0.8, 0.3),
            24,
            (0.123, 0.197, 0.057),
            1.25,
            bark=(0.075, 0.062, 0.055),
            fork=(5, 5),
            slender=1.7,
            stray=0.016,
            share=2.0,
        ),
    }
)
"""Trees by name. Heights are those of street trees, not of old forest trees."""


SHRUBS: Mapping[str, Species] = MappingProxyType(
    {
        # Hazel or dogwood: many stems from the ground, wider than tall.
        "hazel": Species(
            2.6,
            0.011,
            0.01,
            0.66,
            (0.95, 1.0, 1.0, 0.95, 0.85),
            (1.05, 0.12),
            24,
            (0.108, 0.185, 0.044),
            1.9,
            fork=(6, 5),
            bend=0.05,
            slender=1.4,
            stray=0.04,
            begin=0.05,
            top=0.2,
            thick=0.45,
            share=2.0,
        ),
        # Privet or spiraea: low, round, dense.
        "privet": Species(
            1.5,
            0.010,
            0.01,
            0.62,
            (0.9, 1.0, 1.0, 0.95, 0.9),
            (1.2, 0.15),
            24,
            (0.092, 0.162, 0.044),
            2.4,
            fork=(6, 5),
            slender=1.8,
            stray=0.045,
            begin=0.0,
            top=0.2,
            thick=0.45,
            share=2.0,
        ),
        # Bramble and broom: loose, thin, yellowish.
        "broom": Species(
            1.3,
            0.009,
            0.01,
            0.80,
            (0.9, 1.0, 0.9, 0.85, 0.75),
            (1.0, 0.1),
            26,
            (0.128, 0.180, 0.052),
            1.5,
            fork=(5, 4),
            bend=0.02,
            slender=3.0,
            stray=0.05,
            begin=0.0,
            top=0.15,
            thick=0.45,
            share=1.0,
        ),
    }
)
"""Shrubs by name."""
