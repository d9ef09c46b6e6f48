"""Gives what grows without a species its colours of the season: grass, hedges, far woods."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.library.plants.seasons import far_tints, grass_gain, grass_tints, hedge_tints
from sumo3dviz_pt.model.scene import Bsdf, StaticPart

_LEAF = "leaf"
_BLADES = ("ground/blades/", "ground/weeds")
_OWN = frozenset({"trees", "shrubs"})  # have their species' colours


def season_of(job: Job) -> str:
    """Return what leaves and grass look like in a scene file, a word of `SEASONS`."""
    return "summer" if job.weather is None else job.weather.season


def in_season(parts: Iterable[StaticPart], season: str) -> tuple[StaticPart, ...]:
    """Return what stands, with its colours of a season.

    Args:
        parts: In summer's colours, but for trees and shrubs.
        season: A word of `SEASONS`.
    """
    if season == "summer":
        return tuple(parts)
    return tuple(_turned(part, season) for part in parts)


def _turned(part: StaticPart, season: str) -> StaticPart:
    """Return a part in a season's colours."""
    tint = part.part.tint
    if part.part.material != _LEAF or tint is None or part.family in _OWN:
        return part
    far = part.family == "ground" and not part.id.startswith(_BLADES)
    change = far_tints if far else grass_tints if part.family == "ground" else hedge_tints
    return replace(part, part=replace(part.part, tint=change(tint, season)))


def grounds_in_season(materials: Mapping[str, Bsdf], season: str) -> Mapping[str, Bsdf]:
    """Return materials whose grounds of grass have their colour of a season."""
    if season == "summer":
        return materials
    gain = list(grass_gain(season))
    return {name: _grassy(bsdf, gain) for name, bsdf in materials.items()}


def _grassy(bsdf: Bsdf, gain: list[float]) -> Bsdf:
    """Return a material with another colour if it is a patchy ground of grass."""
    colour: Any = bsdf.get("base_color")
    if not isinstance(colour, Mapping) or not colour.get("patches"):
        return bsdf
    return {**bsdf, "base_color": {**colour, "gain": gain}}
