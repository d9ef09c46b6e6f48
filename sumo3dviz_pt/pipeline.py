"""From a job to pictures: the place that knows every stage.

files -sumo-> scenario -motion-> trajectories -scene-> shot -render-> radiance
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job import CameraSettings, Job, LagrangianCamera, Quality
from sumo3dviz_pt.jobfile import camera_settings, quality_preset
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scenario import Scenario, ScenarioFiles
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.provenance import input_hashes, versions
from sumo3dviz_pt.still import Still as Still
from sumo3dviz_pt.still import check_target as check_target

if TYPE_CHECKING:
    from sumo3dviz_pt.render.session import Session
    from sumo3dviz_pt.scene.shot import Shot

log = logging.getLogger(__name__)

AfterPass = Callable[[int, int], None]


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
    """

    camera: str | None = None
    quality: str | None = None
    size: tuple[int, int] | None = None
    spp: int | None = None
    seed: int | None = None
    variant: str = "llvm"

    def applied(self, job: Job) -> Job:
        """The job with this request's choices."""
        changes: dict[str, Any] = {}
        if self.seed is not None:
            if not 0 <= self.seed < 2**31:
                raise ConfigError(f"must lie in 0..{2**31 - 1}, not {self.seed}", key="seed")
            changes["seed"] = self.seed
        if self.quality is not None:
            changes["quality"] = self.quality
        if self.size is not None:
            if not all(1 <= side <= 16384 for side in self.size):
                raise ConfigError(
                    f"must lie in 1..16384, not {self.size[0]}x{self.size[1]}", key="size"
                )
            changes["output"] = job.output.model_copy(update={"size": self.size})
        return job.model_copy(update=changes)


@dataclass(frozen=True, slots=True, eq=False)
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
    """

    job: Job
    camera: str
    shot: Shot
    times: Floats
    quality: Quality
    variant: str
    files: ScenarioFiles
    reading: float

    @property
    def exposure(self) -> float:
        """EV between radiance and the picture: the sky's own and the film's."""
        return self.shot.data.sky.exposure + self.job.output.exposure

    @property
    def key(self) -> str:
        """A hash of everything that a frame's pixels depend on, beside its time."""
        settings = self.job.model_dump(
            mode="json", exclude={"shots", "cameras", "output", "scenario", "quality"}
        )
        content = {
            "settings": settings,
            "camera": self.job.cameras[self.camera].model_dump(mode="json"),
            "size": list(self.job.output.size),
            "exposure": self.exposure,
            "quality": self.quality.model_dump(mode="json"),
            "variant": self.variant,
            "inputs": input_hashes(self.files),
            "versions": versions(),
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def scenario_files(job: Job) -> ScenarioFiles:
    """Where a job's simulation lies.

    Raises:
        InputError: If network or trajectories are missing.
        ConfigError: If the scene file names none.
    """
    from sumo3dviz_pt.sumo import find_scenario

    named = job.scenario
    place = named.sumocfg or named.folder
    if place is not None:
        files = find_scenario(place, network=named.network, trajectories=named.trajectories)
        return replace(
            files,
            signals=named.signals or files.signals,
            additional=files.additional + named.additional,
            vehicle_types=files.vehicle_types + named.vehicle_types,
        )
    if named.network is None or not named.trajectories:
        raise ConfigError("give sumocfg or folder, or network and trajectories", key="scenario")
    return ScenarioFiles(
        named.network,
        named.trajectories,
        named.signals,
        named.additional,
        named.vehicle_types + named.additional,
    )


def object_files(job: Job) -> tuple[Path, ...]:
    """Files of static objects that the scene file names."""
    kinds = (getattr(job.objects, name) for name in type(job.objects).model_fields)
    return tuple(kind.file for kind in kinds if kind is not None and kind.file is not None)


def read(
    job: Job, *, begin: float | None = None, end: float | None = None
) -> tuple[ScenarioFiles, Scenario, tuple[Trajectory, ...]]:
    """Read a simulation's window and smooth its motion.

    Args:
        job: The scene file.
        begin: First time to show [s]; the margin that smoothing needs is added.
        end: Last time to show [s].
    """
    from sumo3dviz_pt.motion import MARGIN, smooth_log
    from sumo3dviz_pt.sumo import read_scenario

    files = scenario_files(job)
    extra = tuple(path for path in object_files(job) if path not in files.additional)
    files = replace(files, additional=files.additional + extra)
    truncated = job.scenario.allow_truncated
    scenario = read_scenario(files, begin=begin, end=end, margin=MARGIN, allow_truncated=truncated)
    trajectories = smooth_log(
        scenario.traffic,
        smoother=job.motion.smoother,
        network=scenario.network,
        types=scenario.vehicle_types,
        heading=job.motion.heading,
    )
    return files, scenario, trajectories


def frame_times(start: float, end: float, fps: float) -> Floats:
    """Times of a film's frames: start + n / fps for all that lie before `end`, (n,) [s]."""
    rate = Fraction(str(fps))
    count = int(np.ceil((end - start) * float(rate) - 1e-6))
    return np.array([start + float(Fraction(number) / rate) for number in range(count)])


def prepare(job: Job, request: Request, times: Floats) -> Production:
    """Read and build everything for frames at some times.

    Args:
        job: The scene file.
        request: The command's choices.
        times: Of the whole shot, (n,) [s], n >= 1.

    Raises:
        ConfigError: If a choice does not exist or the window holds nothing.
        InputError: If a file is wrong.
    """
    import time

    from sumo3dviz_pt.scene.shot import build_shot

    started = time.process_time()
    job = request.applied(job)
    quality = quality_preset(job.quality, spp=request.spp)
    name, camera = camera_settings(job, request.camera)
    files, scenario, trajectories = read(job, begin=float(times[0]), end=float(times[-1]))
    _check_window(scenario, times)
    shot = build_shot(scenario, trajectories, job, camera=camera, times=times)
    spent = time.process_time() - started
    return Production(job, name, shot, times, quality, request.variant, files, spent)


def _check_window(scenario: Scenario, times: Floats) -> None:
    """The asked time must lie in the log."""
    log_of = scenario.traffic
    if times[-1] < log_of.begin - 1e-6 or times[0] > log_of.end + 1e-6:
        raise ConfigError(
            f"no time step lies from {times[0]:g} s to {times[-1]:g} s;"
            f" the log goes from {log_of.begin:g} s to {log_of.end:g} s",
            key="time",
        )


@contextmanager
def opened(production: Production, *, film: bool) -> Iterator[Session]:
    """A production in the renderer."""
    from sumo3dviz_pt.render.backend import choose_backend
    from sumo3dviz_pt.render.session import RenderSettings, Session

    backend = choose_backend(production.variant)
    size = production.job.output.size
    first = production.shot.frame_at(float(production.times[0]))
    settings = RenderSettings(
        size,
        production.quality,
        production.job.seed,
        white=2.0**-production.exposure,
        frozen=film,
        pixel=first.view.fov / size[0],
    )
    with Session(production.shot.data, backend, settings) as session:
        yield session


def renderer_names(session: Session) -> dict[str, str]:
    """Mitsuba's variant and the compiler behind it, by the names of a report's columns."""
    from sumo3dviz_pt.render.backend import llvm_description

    variant = session.backend.variant
    return {"variant": variant, "llvm": llvm_description() if "llvm" in variant else ""}


def provenance(production: Production, *, frame: int, time: float) -> dict[str, Any]:
    """What a frame was made from; no clock, so that the same command gives the same bytes."""
    return {
        "key": production.key,
        "camera": production.camera,
        "frame": frame,
        "time": time,
        "exposure": production.exposure,
        "tone": production.job.output.tone,
        "glare": production.job.output.glare,
        "seed": production.job.seed,
        "spp": production.quality.spp,
        "quality": production.job.quality,
        "variant": production.variant,
        "versions": versions(),
    }


def render_still(
    job: Job, request: Request, time: float, *, after_pass: AfterPass | None = None
) -> Still:
    """Render one image.

    Args:
        job: The scene file.
        request: The command's choices.
        time: SUMO's time [s].
        after_pass: Called with passes done and passes in all.
    """
    check_tone(job.output.tone)
    production = prepare(job, request, np.array([float(time)]))
    with opened(production, film=False) as session:
        rendered = session.render(production.shot.frame_at(float(time)), after_pass=after_pass)
    output = production.job.output
    account = provenance(production, frame=0, time=float(time))
    return Still(
        rendered.radiance,
        production.exposure,
        output.tone,
        output.glare,
        output.half,
        account,
        rendered,
    )


def check_tone(name: str) -> None:
    """Refuse an unknown tone curve before any work is done."""
    from sumo3dviz_pt.image.tonemap import tone_curve

    tone_curve(name)


def example(name: str) -> Path:
    """Scene file of a bundled example."""
    return data_root("examples") / name / "scene.yaml"


def life_of(camera: CameraSettings, trajectories: tuple[Trajectory, ...]) -> tuple[float, float]:
    """First and last time that a camera can show [s]."""
    begins = [piece.begin for trajectory in trajectories for piece in trajectory.pieces]
    ends = [piece.end for trajectory in trajectories for piece in trajectory.pieces]
    if isinstance(camera, LagrangianCamera):
        own = [t for t in trajectories if t.id == camera.vehicle]
        begins = [piece.begin for t in own for piece in t.pieces]
        ends = [piece.end for t in own for piece in t.pieces]
    if not begins:
        raise ConfigError("nobody moves in this log", key="scenario")
    return min(begins), max(ends)
