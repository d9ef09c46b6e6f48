"""Refuses choices that do not exist, before anything is read, built or loaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.lens import LensSettings
from sumo3dviz_pt.job.variants import check_variant
from sumo3dviz_pt.pipeline.metering import manual_exposure
from sumo3dviz_pt.pipeline.scene_file import camera_settings, quality_preset

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import CameraSettings, Job, Quality
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
        name, camera = camera_settings(job, request.camera)
        check_camera(job, camera, name=name, variant=request.variant)
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


def can_help(camera: CameraSettings) -> bool:
    """Return whether frames of a camera can help each other: sharp in time, and of one eye."""
    lens = camera.lens
    one_eye = lens is None or (lens.stereo == "none" and lens.projection != "orthographic")
    return camera.shutter is None and one_eye


def check_camera(job: Job, camera: CameraSettings, *, name: str, variant: str) -> None:
    """Refuse a lens, shutter or exposure with which nothing can be rendered.

    Args:
        job: The scene file.
        camera: Settings of the camera.
        name: Of the camera.
        variant: The renderer's.

    Raises:
        ConfigError: Names the key, and what fits.
    """
    lens = camera.lens or LensSettings()
    try:
        lens.check_size(job.output.size)
    except ValueError as error:
        raise ConfigError(str(error), key="output.size") from error
    if lens.stereo != "none":
        _check_one_eye(job)
    if camera.exposure is not None and camera.exposure.mode == "manual":
        manual_exposure(camera, step=1.0, name=name)
    ours = variant != "scalar" and quality_preset(job.quality).tracer == "kernel"
    if not ours and (camera.shutter is not None or not lens.is_pinhole):
        raise ConfigError(
            "only our own kernel has shutters, and lenses other than pinholes: take the variant"
            " llvm or cuda, and a quality with `tracer: kernel`",
            key=f"cameras.{name}",
        )


def _check_one_eye(job: Job) -> None:
    """Refuse what a picture of both eyes cannot have.

    Raises:
        ConfigError: Names the key.
    """
    if job.overlays is not None:
        raise ConfigError(
            "a picture of both eyes has no overlays; leave them out, or stereo", key="overlays"
        )
    boxed = [layer for layer in ("boxes2d", "boxes3d") if layer in job.output.layers]
    if boxed:
        raise ConfigError(
            f"a picture of both eyes has no layer {boxed[0]}: each thing is in it twice; leave it"
            " out, or stereo",
            key="output.layers",
        )
