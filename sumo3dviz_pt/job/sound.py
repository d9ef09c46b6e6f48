"""The scene file's settings of sound tracks, which tools of auralisation make sound of."""

from __future__ import annotations

from pydantic import Field

from sumo3dviz_pt.job.ranges import Finite, Positive
from sumo3dviz_pt.job.values import Settings


class SoundSettings(Settings):
    """Tracks of everyone near the camera, and of the camera, for tools that make sound of them."""

    radius: Positive = Field(
        150.0, le=2000, description="who comes as near to the camera has a track [m]"
    )
    rate: Finite | None = Field(
        None,
        ge=1,
        le=1000,
        description="samples per second of film; default one for each frame",
    )
