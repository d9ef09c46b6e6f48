"""The lens that a scene file describes."""

from __future__ import annotations

from sumo3dviz_pt.job.settings import LensSettings
from sumo3dviz_pt.model.lens import Lens


def lens_of(settings: LensSettings) -> Lens:
    """Return the lens that settings ask for: the only place that reads their projection."""
    return Lens.of_degrees(settings.fov)
