"""The lens that a scene file describes."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.job.lens import FOV
from sumo3dviz_pt.job.settings import LensSettings
from sumo3dviz_pt.model.lens import Lens


def lens_of(settings: LensSettings, *, degrees: float = FOV) -> Lens:
    """Return the lens that settings ask for: the only place that reads their projection.

    Args:
        settings: Of the lens.
        degrees: Opening angle of a perspective lens that does not say it [deg].
    """
    if settings.width is not None:
        return Lens(0.0, "orthographic", width=settings.width)
    degrees = settings.degrees(degrees)
    focus = settings.focus if isinstance(settings.focus, float) else float("inf")
    return Lens(
        float(np.radians(degrees)),
        settings.projection,
        aperture=settings.aperture(degrees),
        focus=focus,
        distortion=settings.distortion,
        stereo=settings.stereo,
        eye_distance=settings.eye_distance,
    )
