"""From a job to pictures: the place that knows every stage.

files -sumo-> scenario -motion-> trajectories -world, cast, shot-> shot -render-> radiance

Choices that do not exist are refused before anything is read, built or loaded.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from sumo3dviz_pt.catalog import data_root, did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.installation.dependencies import find_driver, load
from sumo3dviz_pt.job.cameras import LensSettings
from sumo3dviz_pt.job.errors import settle
from sumo3dviz_pt.job.settings import CameraSettings, Job, Quality
from sumo3dviz_pt.job.values import Finite, Positive, Seed, Size, Whole, check_variant
from sumo3dviz_pt.model.camera import frame_step
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.numbers import MOST_FRAMES, Ratio, ratio_of
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.model.traffic import Scenario, ScenarioFiles
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.accounts import account_of, key_of
from sumo3dviz_pt.pipeline.metering import exposure_of, manual_exposure
from sumo3dviz_pt.pipeline.provenance import Inputs, inputs_of
from sumo3dviz_pt.pipeline.reading import check_rider, motion_of, read_files
from sumo3dviz_pt.pipeline.reading import object_files as object_files
from sumo3dviz_pt.pipeline.reading import read as read
from sumo3dviz_pt.pipeline.reading import scenario_files as scenario_files
from sumo3dviz_pt.pipeline.scene_file import camera_settings, quality_preset
from sumo3dviz_pt.pipeline.still import Still as Still
from sumo3dviz_pt.pipeline.still import check_target as check_target
from sumo3dviz_pt.pipeline.traffic import Survey
from sumo3dviz_pt.pipeline.worlds import without_collecting, world_of

if TYPE_CHECKING:
    from sumo3dviz_pt.image.optics import Optics
    from sumo3dviz_pt.model.scene import FrameState
    from sumo3dviz_pt.render.backend import Backend
    from sumo3dviz_pt.render.session import Samples as Samples
    from sumo3dviz_pt.render.session import Session as Session
    from sumo3dviz_pt.shot.build import Shot


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
    from sumo3dviz_pt.shot.crowd import check_scene_choices

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
    from sumo3dviz_pt.world.weather import weather_course

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
    one_eye = lens is None or (lens.stereo == "none" and lens.width is None)
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


log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Request:
    """What a command asks for beyond the scene file; None leaves the file's choice.

    Attributes:
        camera: A name from `cameras`.
        quality: A preset's name.
        size: Width, height [px].
        spp: Samples per pixel instead of the preset's.
        seed: Instead of the file's.
        variant: `llvm`, `cuda` or `scalar`.
        command: The command line; empty from Python.
        time_budget: CPU-seconds that a frame may take; a pilot chooses the samples.
        target_error: FLIP that a picture may have; a pilot chooses the samples.
        metered: Exposure of cameras that are to meter it, where it is known already [EV].
    """

    camera: str | None = None
    quality: str | None = None
    size: Size | None = None
    spp: Whole | None = None
    seed: Seed | None = None
    variant: str = "llvm"
    command: Annotated[str, Field(max_length=1_000_000)] = ""
    time_budget: Positive | None = None
    target_error: Annotated[Positive, Field(lt=1)] | None = None
    metered: Annotated[Finite, Field(ge=-60, le=60)] | None = None

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)
        choices = [*self.wish, *(["spp"] if self.spp is not None else [])]
        if len(choices) > 1:
            raise ConfigError(
                f"{' and '.join(choices)} all choose the samples; give one of them", key=choices[1]
            )

    @property
    def wish(self) -> dict[str, float]:
        """What a pilot is to choose the samples by: one entry, or none."""
        wishes = {"time_budget": self.time_budget, "target_error": self.target_error}
        return {name: value for name, value in wishes.items() if value is not None}

    def applied(self, job: Job) -> Job:
        """Return the job with this request's choices."""
        changes: dict[str, Any] = {}
        if self.seed is not None:
            changes["seed"] = self.seed
        if self.quality is not None:
            changes["quality"] = self.quality
        if self.size is not None:
            changes["output"] = job.output.model_copy(update={"size": self.size})
        return job.model_copy(update=changes)


@dataclass(frozen=True, eq=False)
class Production:
    """A shot ready to be rendered.

    Attributes:
        job: With the request's choices applied.
        camera: The camera's name.
        shot: What it shows.
        times: Of all its frames, (n,) [s].
        quality: Samples, depth, denoiser.
        variant: As asked for.
        files: The simulation's files.
        reading: CPU-seconds of reading, smoothing and building.
        command: The command line; empty from Python.
        pilot: What a pilot chose, for the account; None where there was none.
        metered: At which exposure the camera's pictures look right, if that was metered [EV].
    """

    job: Job
    camera: str
    shot: Shot
    times: Floats
    quality: Quality
    variant: str
    files: ScenarioFiles
    reading: float
    command: str = ""
    pilot: Mapping[str, Any] | None = None
    metered: float | None = None

    @property
    def device(self) -> dict[str, str]:
        """The GPU and its driver: pixels hang on them. Empty where processors render.

        On all processors pixels are the same.
        """
        if self.variant != "cuda":
            return {}
        driver = find_driver()
        return {"device": f"{driver.device}, CUDA {driver.cuda}"}

    @property
    def settings(self) -> CameraSettings:
        """What the scene file says of its camera."""
        return self.job.cameras[self.camera]

    @property
    def exposure(self) -> float:
        """EV between radiance and the picture: the camera's, by default the sky's, and the film's.

        Raises:
            ConfigError: If a manual exposure lacks an f-number or a shutter.
        """
        settings, by_hand = self.settings.exposure, 0.0
        if settings is not None and settings.mode == "manual":
            step = frame_step(self.times, fps=float(self.job.output.fps))
            by_hand = manual_exposure(self.settings, step=step, name=self.camera)
        sky = self.shot.data.sky.exposure
        own = exposure_of(settings, sky=sky, metered=self.metered, by_hand=by_hand)
        return own + self.job.output.exposure

    @cached_property
    def optics(self) -> Optics | None:
        """What happens to light in the camera when pictures are developed; None is nothing."""
        lens = self.settings.lens
        if lens is None or not (lens.vignetting or lens.grain):
            return None
        from sumo3dviz_pt.image.optics import Optics

        seen = self.shot.frame_at(float(self.times[0])).view.lens
        return Optics.of(seen, vignetting=lens.vignetting, grain=lens.grain)

    def frame_at(self, time: float) -> FrameState:
        """Return what is rendered of the frame at a time [s]; errors as in `Shot.exposed_at`."""
        return self.shot.exposed_at(time, samples=self.quality.spp)

    @cached_property
    def inputs(self) -> Inputs:
        """The files that it is made from, by content."""
        return inputs_of(self.job, self.files, camera=self.camera)

    @cached_property
    def key(self) -> str:
        """A hash of all that a frame's pixels depend on, beside its time and what traces it."""
        return key_of(self)

    @cached_property
    def account(self) -> Mapping[str, Any]:
        """What its pictures are made from."""
        return account_of(self)


def frame_times(start: float, end: float, fps: Ratio, speed: Fraction = Fraction(1)) -> Floats:
    """Return the times of a film's frames: all start + n speed / fps before `end`, (n,) [s].

    Args:
        start: SUMO's time of the first frame [s].
        end: After the last frame [s].
        fps: Frames per second of film.
        speed: SUMO's seconds per second of film.

    Raises:
        ConfigError: If there are more than `MOST_FRAMES`.
    """
    step = speed / ratio_of(fps)
    count = int(np.ceil((end - start) / float(step) - 1e-6))
    if count > MOST_FRAMES:
        raise ConfigError(
            f"{start:.12g} s to {end:.12g} s are {count:,} frames, and a film has at most"
            f" {MOST_FRAMES:,}; make it shorter, or fps smaller",
            key="to",
        )
    return np.array([start + float(number * step) for number in range(count)])


@without_collecting()
def prepare(
    job: Job,
    request: Request,
    times: Floats,
    *,
    film: bool = False,
    together: bool = False,
    survey: Survey | None = None,
) -> Production:
    """Read and build everything for frames at some times.

    Args:
        job: The scene file.
        request: The command's choices.
        times: Of the whole shot, (n,) [s], n >= 1.
        film: Whether it ends where the log does, with a note, and cannot begin before it.
        together: Whether its frames may help each other, if its quality says so.
        survey: Of a report, which counts and does not render; default: all is built.

    Raises:
        ConfigError: If a choice does not exist or the window holds nothing.
        InputError: If a file is wrong.
    """
    import time

    from sumo3dviz_pt.motion.breaches import note_breaches
    from sumo3dviz_pt.shot.build import build_shot
    from sumo3dviz_pt.shot.road_users import focus_target, shutter_of, users_in_view

    started = time.process_time()
    check_choices(job, request)
    job = request.applied(job)
    name, camera = camera_settings(job, request.camera)
    together = together and can_help(camera)
    quality = quality_preset(job.quality, spp=request.spp, together=together)
    shutter = shutter_of(camera, frame_step(times, fps=float(job.output.fps)))
    last = float(times[-1]) + shutter.lasts
    files, scenario = read_files(job, begin=float(times[0]), end=last)
    check_window(scenario, times)
    if film:
        times = within_log(scenario, times)
    # Whom the camera rides with says where it is, and so who else is in view.
    motion = motion_of(job, scenario, survey)
    riders = motion.smooth(motion.named(getattr(camera, "vehicle", "")))
    check_rider(camera, name=name, times=times, trajectories=riders, logs=files.trajectories)
    announce(Doing.BUILD)
    world = replace(
        world_of(scenario, job, files), outlook=None if survey is None else survey.outlook
    )
    seen = users_in_view(world, riders, camera=camera, times=times)
    followed = motion.named(getattr(camera, "vehicle", ""))
    followed |= motion.named(focus_target(camera) or "")
    trajectories = motion.smooth(seen | followed)
    note_breaches(motion, trajectories, span=(float(times[0]), last))
    shot = build_shot(world, trajectories, camera=camera, times=times)
    spent = time.process_time() - started
    return Production(
        job, name, shot, times, quality, request.variant, files, spent, request.command
    )


def check_window(scenario: Scenario, times: Floats) -> None:
    """Refuse times that do not lie in the log."""
    log_of = scenario.traffic
    if times[-1] < log_of.begin - 1e-6 or times[0] > log_of.end + 1e-6:
        raise ConfigError(
            f"no time step lies from {times[0]:.12g} s to {times[-1]:.12g} s;"
            f" the log goes from {log_of.begin:.12g} s to {log_of.end:.12g} s",
            key="time",
        )


def ready_renderer(variant: str = "llvm") -> Backend:
    """Load the renderer before work begins, so that what is missing is said at once.

    Raises:
        ConfigError: If there is no such variant.
        InstallationError: If a package cannot be loaded.
        RenderError: If the variant cannot work here.
    """
    from sumo3dviz_pt.render.backend import choose_backend

    load("mitsuba_oidn", "OpenEXR")
    return choose_backend(variant)


def get_ready(job: Job, request: Request) -> None:
    """Refuse wrong choices, then load the renderer: before anything is read.

    Raises:
        ConfigError: If a choice does not exist.
        InstallationError: If a package cannot be loaded.
        RenderError: If the variant cannot work here.
    """
    check_choices(job, request)
    ready_renderer(request.variant)


def within_log(scenario: Scenario, times: Floats) -> Floats:
    """Return a film's times without those after the log's end, (n,) [s]."""
    begin, end = scenario.traffic.begin, scenario.traffic.end
    if times[0] < begin - 1e-6:
        raise ConfigError(f"the log begins at {begin:.12g} s, after {times[0]:.12g} s", key="from")
    within = times[times <= end + 1e-6]
    if len(within) < len(times):
        log.warning(
            "the log ends at %.12g s, and the film with it: %d frames instead of %d",
            end,
            len(within),
            len(times),
        )
    return within


@contextmanager
def opened(production: Production) -> Iterator[Session]:
    """Open a production in the renderer; if its frames help each other, its layers have `ids`."""
    from sumo3dviz_pt.render.backend import choose_backend
    from sumo3dviz_pt.render.session import RenderSettings, Session

    announce(Doing.OPEN)
    backend = choose_backend(production.variant)
    size = production.job.output.size
    first = production.shot.frame_at(float(production.times[0]))
    settings = RenderSettings(
        size,
        production.quality,
        production.job.seed,
        white=2.0**-production.exposure,
        pixel=first.view.pixel_angle(size[0]),
    )
    if production.quality.accumulate > 0:
        settings = replace(settings, layers=("radiance", "ids", "first_depth"))
    with Session(production.shot.data, backend, settings) as session:
        yield session


def renderer_names(session: Session) -> dict[str, str]:
    """Return Mitsuba's variant and the compiler behind it, by the names of a report's columns."""
    from sumo3dviz_pt.render.backend import llvm_description

    variant = session.backend.variant
    return {"variant": variant, "llvm": llvm_description() if "llvm" in variant else ""}


def check_tone(name: str) -> None:
    """Refuse an unknown tone curve before any work is done."""
    from sumo3dviz_pt.image.tonemap import tone_curve

    tone_curve(name)


def check_response(name: str) -> None:
    """Refuse an unknown response of a camera before any work is done."""
    from sumo3dviz_pt.image.response import response_named

    response_named(name)


def example(name: str) -> Path:
    """Return the scene file of a bundled example.

    Raises:
        ConfigError: If there is no such example.
    """
    scene = data_root("examples") / name / "scene.yaml"
    if not scene.is_file():
        known = sorted(path.parent.name for path in scene.parents[1].glob("*/scene.yaml"))
        guess = did_you_mean(name, known)
        raise ConfigError(f"no example is called {name!r}{guess}; there are {', '.join(known)}")
    return scene


def life_of(camera: CameraSettings, trajectories: tuple[Trajectory, ...]) -> tuple[float, float]:
    """Return the first and last time that a camera can show [s].

    Raises:
        ConfigError: If nobody moves, or whom the camera rides with is unknown.
    """
    from sumo3dviz_pt.model.trajectory import find_trajectory

    if camera.rides_with:
        trajectories = (find_trajectory(trajectories, camera.rides_with),)
    pieces = [piece for trajectory in trajectories for piece in trajectory.pieces]
    if not pieces:
        raise ConfigError("nobody moves in this log", key="scenario")
    return min(piece.begin for piece in pieces), max(piece.end for piece in pieces)
