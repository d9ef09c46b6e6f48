"""Puts a shot under another sky, without building again what does not change."""

from __future__ import annotations

from dataclasses import replace

from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.pipeline.production import Production, Request, prepare


def under_sky(made: Production, sky: SkySettings) -> Production:
    """Return a production under another sky; built again only if lamps are lit or go out with it.

    Args:
        made: Under its own sky.
        sky: A preset, a file, or a sun by angles.

    Raises:
        ConfigError: If settings contradict each other or name what is unknown.
    """
    job = made.job.model_copy(update={"sky": sky})
    shot = made.shot.under_sky(sky, job.lights)
    if shot is not None:
        return replace(made, job=job, shot=shot)
    again = prepare(job, Request(made.camera, variant=made.variant), made.times)
    return replace(again, quality=made.quality)
