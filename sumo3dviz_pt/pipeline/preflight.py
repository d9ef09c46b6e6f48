"""Refuses choices that do not exist, before anything is read, built or loaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.variants import check_variant
from sumo3dviz_pt.pipeline.scene_file import camera_settings, quality_preset

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job, Quality
    from sumo3dviz_pt.pipeline.production import Request


def check_choices(job: Job, request: Request) -> None:
    """Look at all names and files of a job that need no simulation.

    Args:
        job: The scene file.
        request: The command's choices.

    Raises:
        ConfigError: If variant, quality, camera, smoother, a model, a surface or a file of the
            user's does not exist, or settings contradict each other.
    """
    from sumo3dviz_pt.motion import check_smoother
    from sumo3dviz_pt.shot.choices import check_scene_choices

    check_variant(request.variant)
    job = request.applied(job)
    quality = quality_preset(job.quality, spp=request.spp)
    _check_weather(job, quality, request.variant)
    if job.cameras or request.camera is not None:
        camera_settings(job, request.camera)
    check_smoother(job.motion.smoother)
    check_scene_choices(job)


def _check_weather(job: Job, quality: Quality, variant: str) -> None:
    """Refuse weather where our own kernel does not trace.

    Raises:
        ConfigError: If Mitsuba's path tracer would, which knows neither fog nor water.
    """
    from sumo3dviz_pt.world.weather.course import weather_course

    course = weather_course(job.weather)
    if course is None or not course.is_seen:
        return
    if quality.tracer != "kernel" or variant == "scalar":
        what = f"the variant {variant}" if variant == "scalar" else f"the quality {job.quality!r}"
        raise ConfigError(
            f"{what} cannot show weather, which only our own kernel traces;"
            " take another one, or leave weather out",
            key="weather",
        )
