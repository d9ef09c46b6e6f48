"""Refuses choices that do not exist, before anything is read, built or loaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sumo3dviz_pt.job.variants import check_variant
from sumo3dviz_pt.pipeline.scene_file import camera_settings, quality_preset

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job
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
    quality_preset(job.quality, spp=request.spp)
    if job.cameras or request.camera is not None:
        camera_settings(job, request.camera)
    check_smoother(job.motion.smoother)
    check_scene_choices(job)
