"""The scene file's settings of static objects: trees, fences, buildings."""

from __future__ import annotations

from pydantic import Field

from sumo3dviz_pt.job.ranges import File, Finite, OneOrMoreNames, Whole
from sumo3dviz_pt.job.values import HexColour, Settings


class ObjectSettings(Settings):
    """Static objects of one kind, from POIs or polygons."""

    file: File | None = Field(None, description="default: by the POI's or polygon's type")
    model: OneOrMoreNames = Field((), description="models to draw from; default all")
    scale: Finite = Field(1.0, ge=0.01, le=20, description="mean size factor")
    variation: Finite = Field(0.2, ge=0, lt=1, description="relative spread of sizes")
    colour: HexColour | None = Field(None, description="#rrggbb; default seeded, natural")


class ObjectsSettings(Settings):
    """Static objects by kind."""

    trees: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    shrubs: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    hedges: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    fences: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    homes: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    shops: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    blocks: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    buildings: ObjectSettings | None = Field(ObjectSettings(), description="building polygons")
    triangles: Whole | None = Field(
        None,
        ge=10_000,
        le=2_000_000,
        description="of each kind, about: what is far is coarser; by default all kinds share what"
        " roads and street furniture leave; studies have 200000",
    )
