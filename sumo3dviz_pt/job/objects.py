"""The scene file's settings of static objects: trees, fences, buildings."""

from __future__ import annotations

from typing import Any

from pydantic import Field, model_validator

from sumo3dviz_pt.job.ranges import File, Finite, Names
from sumo3dviz_pt.job.values import HexColour, Settings, listed


class ObjectSettings(Settings):
    """Static objects of one kind, from POIs or polygons."""

    file: File | None = Field(None, description="default: by the POI's or polygon's type")
    model: Names = Field((), description="models to draw from; default all")
    scale: Finite = Field(1.0, ge=0.01, le=20, description="mean size factor")
    variation: Finite = Field(0.2, ge=0, lt=1, description="relative spread of sizes")
    colour: HexColour | None = Field(None, description="#rrggbb; default seeded, natural")

    @model_validator(mode="before")
    @classmethod
    def _lists(cls, data: Any) -> Any:
        """Let a single model stand without brackets."""
        if isinstance(data, dict) and "model" in data:
            return {**data, "model": listed(data["model"])}
        return data


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
