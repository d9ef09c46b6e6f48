"""Trees that grow from a seed: branches as tapered tubes, leaves as real triangles.

No picture of a leaf with a mask: real triangles cost less in a path tracer and do
not look like cards. From level to level leaves get fewer and larger, so that their
total area and the crown's outline stay.

References:
    Golden angle of phyllotaxis: P. Prusinkiewicz, A. Lindenmayer: The Algorithmic Beauty of
    Plants, 1990, section 4.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.library.plants.branches import Branches, Manner, bark, children, root_flare, trunk
from sumo3dviz_pt.library.plants.foliage import crown, foliage
from sumo3dviz_pt.library.plants.seasons import bare, leafy, twiggy
from sumo3dviz_pt.library.plants.species import SHRUBS, SPECIES, Species
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import Part

__all__ = ["LEVELS", "SHRUBS", "SPECIES", "Species", "tree"]


@dataclass(frozen=True, slots=True)
class _PlantDetail:
    """What a level of detail spends: leaves, and facets and steps of each bark order.

    Outer orders that would take more than `wood` triangles hide among the leaves.
    Shrubs are small, so they get half as many leaves.
    """

    leaves: int
    sides: tuple[int, ...]
    steps: tuple[int, ...]
    folded: bool
    wood: int
    flare: int = 0


_DETAILS = (
    _PlantDetail(21_000, (10, 5, 3, 3), (8, 5, 3, 1), True, 11_000, 16),
    _PlantDetail(8400, (8, 4, 3), (6, 4, 2), False, 4000, 10),
    _PlantDetail(3400, (6, 3), (5, 3), False, 900, 7),
    _PlantDetail(1750, (5, 3), (4, 2), False, 500),
    _PlantDetail(700, (3,), (3,), False, 100),
    _PlantDetail(240, (3,), (2,), False, 100),
)

LEVELS = len(_DETAILS)
"""Levels of detail: 0 within reach, 5 far."""

_NEEDLE = 4.0  # leaves this many times longer than wide are needles

_KNOWN: Mapping[str, Species] = MappingProxyType({**SPECIES, **SHRUBS})


def tree(
    species: str,
    *,
    seed: int,
    level: int = 0,
    height: float | None = None,
    season: str = "summer",
) -> tuple[Part, ...]:
    """Grow a tree or a shrub; the same seed gives the same crown at every level of detail.

    Args:
        species: A key of `SPECIES` or `SHRUBS`.
        seed: Of its shape.
        level: 0 within reach (about 50,000 triangles), 1 near (11,000), 2 (4,000), 3 middle
            (2,000), 4 far (700), 5 farther (260); shrubs have half of that.
        height: [m]; default the species' usual one.
        season: `winter` leaves twigs instead of leaves; colours are summer's.

    Returns:
        Bark and foliage; the foot stands at the origin, 0.3 m deep in the ground.
    """
    kind, detail = _KNOWN[species], _DETAILS[level]
    orders = _skeleton(kind, np.random.default_rng(seed))
    grown = crown(kind, orders[2], orders[3])
    # Crowns grow as chance has it; the highest twig decides what one metre is.
    scale = (height or kind.height) / float(grown.bounds[1, 2])
    winter = bare(kind, season)
    grows = twiggy(kind) if winter else leafy(kind, season)
    # Needles are too narrow to be folded, so there may be twice as many.
    folded = detail.folded and grows.slender < _NEEDLE
    count = detail.leaves * (2 if detail.folded and not folded and not winter else 1)
    count //= 2 if species in SHRUBS else 1
    leaves, tint = foliage(
        grows, grown, leaves=count, folded=folded, rng=np.random.default_rng([seed, 1])
    )
    wood, colours = _wood(kind, orders, detail, np.random.default_rng([seed, 2]))
    return (
        Part(_scaled(wood, scale), "bark", colours),
        Part(_scaled(leaves, scale), "leaf", tint),
    )


def _skeleton(kind: Species, rng: np.random.Generator) -> tuple[Branches, ...]:
    """Grow trunk, boughs, branches and twigs."""
    stem = trunk(
        kind.height,
        kind.girth * kind.height,
        rng=rng,
        top=kind.top,
        crooked=0.055 * kind.wobble,
    )
    orders = [stem, _boughs(kind, stem, rng)]
    for count, share_of in zip(kind.fork, (0.5, 0.5), strict=True):
        parent = orders[-1]
        at = np.linspace(0.25, 1.0, count)[None] + rng.normal(0, 0.04, (parent.count, count))
        grown = parent.lengths[:, None] * share_of * (1.25 - 0.7 * at)
        angles = rng.uniform(0.5, 1.05, at.shape)
        manner = Manner(kind.bend, kind.wobble, kind.flat)
        at = np.clip(at, 0.1, 1.0)
        orders.append(children(parent, at, grown, angles=angles, rng=rng, manner=manner))
    return tuple(orders)


def _boughs(kind: Species, stem: Branches, rng: np.random.Generator) -> Branches:
    """Grow what leaves the trunk: in a spiral, or in whorls one above the other."""
    number = np.arange(kind.boughs) // kind.whorl * kind.whorl + 0.5 * (kind.whorl - 1)
    share = (number + 0.5) / kind.boughs + rng.normal(0, 0.004, kind.boughs)
    share = np.clip(share, 0.0, 1.0)
    along = (kind.clear + (0.97 * kind.top - kind.clear) * share) / kind.top
    lengths = kind.reach * kind.height * np.interp(share, np.linspace(0, 1, 5), kind.crown)
    lengths = lengths * rng.uniform(0.8, 1.15, kind.boughs)
    angles = np.interp(share, (0, 1), kind.rise) + rng.normal(0, 0.1, kind.boughs)
    manner = Manner(kind.bend, kind.wobble, thick=kind.thick)
    return children(stem, along[None], lengths[None], angles=angles[None], rng=rng, manner=manner)


def _wood(
    kind: Species, orders: tuple[Branches, ...], detail: _PlantDetail, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """Build the bark of trunk and branches, and tint each face."""
    each = [
        2 * order.count * n * m
        for order, n, m in zip(orders, detail.sides, detail.steps, strict=False)
    ]
    count = max(int((np.cumsum(each) <= detail.wood).sum()), 1)
    wood = bark(orders[:count], detail.sides[:count], detail.steps[:count])
    if detail.flare:
        foot = root_flare(kind.girth * kind.height, sides=detail.flare, rng=rng)
        wood = merge_meshes([wood, foot])
    height = wood.vertices[wood.faces].mean(axis=1)[:, 2] / kind.height
    colours = np.tile(np.array(kind.bark), (len(wood.faces), 1))
    if kind.upper_bark is not None:
        upper = np.clip((height - 0.25) / 0.25, 0.0, 1.0)[:, None]
        colours = colours * (1 - upper) + np.array(kind.upper_bark) * upper
    colours = colours * rng.uniform(0.85, 1.15, (len(colours), 1))
    # Moss and splashed soil darken the foot.
    colours *= np.clip(0.72 + 8.0 * height, 0.72, 1.0)[:, None]
    dark = rng.random(len(colours)) < kind.marks
    return wood, np.where(dark[:, None], 0.5 * colours, colours)


def _scaled(mesh: Mesh, scale: float) -> Mesh:
    """Enlarge a mesh about the origin."""
    return Mesh(mesh.vertices * scale, mesh.faces, mesh.normals)
