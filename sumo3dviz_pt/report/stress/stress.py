"""Puts a user's scene under stress: many small pictures at its edges, each judged.

A shot is built for each place and moment; suns change only the sky of a shot that is there. Cases
that differ in samples or exposure alone share the renderer, too. How the cases of `check --stress`
ended is said as values and in words.
"""

from __future__ import annotations

import logging
import time as clock
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatchcase
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, Sumo3dvizError, interrupted
from sumo3dviz_pt.job.settings import Job, OutputSettings, Quality, SkySettings, SunSettings
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.accounts import preset_weather
from sumo3dviz_pt.pipeline.metering import metered
from sumo3dviz_pt.pipeline.production import (
    Production,
    Request,
    check_tone,
    frame_times,
    life_of,
    opened,
    prepare,
    read,
)
from sumo3dviz_pt.pipeline.scene_file import camera_settings, quality_preset
from sumo3dviz_pt.report.stress.cases import (
    SIZE,
    SPOTS,
    Case,
    SceneFacts,
    all_cases,
    facts_of,
    why_not,
)
from sumo3dviz_pt.report.stress.checks import CaseEvidence, judge, light_of

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Session


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


MUCH_CAPPED = 0.02
"""Share of the energy from which the report says what the firefly cap took."""


@dataclass(frozen=True, slots=True)
class CaseOutcome:
    """How a case ended.

    Attributes:
        name: The case's.
        verdict: `ok`, `failed` or `left out`.
        why: What is wrong, or why it is left out; empty if ok.
        cpu: CPU-seconds, building included.
        nonfinite: Pixels x passes that were NaN or Inf and were replaced.
        negative: Pixels x passes below zero that were replaced.
        capped: Share of the energy that the firefly cap took, [0, 1].
    """

    name: str
    verdict: str
    why: str = ""
    cpu: float = 0.0
    nonfinite: int = 0
    negative: int = 0
    capped: float = 0.0


@dataclass(frozen=True, slots=True)
class StressReport:
    """How all cases ended.

    Attributes:
        camera: Whose shot was put under stress.
        time: Of that shot [s].
        outcomes: One for each case, in the order of running.
    """

    camera: str
    time: float
    outcomes: tuple[CaseOutcome, ...]

    def count(self, verdict: str) -> int:
        """Return how many cases ended like that."""
        return sum(outcome.verdict == verdict for outcome in self.outcomes)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it for JSON."""
        return asdict(self)


def in_words(report: StressReport) -> str:
    """Return the report as people read it."""
    width = max((len(outcome.name) for outcome in report.outcomes), default=0)
    lines = [f"shot {report.camera} at {report.time:.12g} s"]
    lines += [_line(outcome, width) for outcome in report.outcomes]
    spent = sum(outcome.cpu for outcome in report.outcomes)
    lines.append(
        f"{report.count('ok')} ok, {report.count('failed')} failed,"
        f" {report.count('left out')} left out, {spent:.0f} CPU-seconds"
    )
    return "\n".join(lines)


def _line(outcome: CaseOutcome, width: int) -> str:
    """Return one case in a line."""
    words = f"{outcome.name:<{width}}  {outcome.verdict:<8}  {outcome.cpu:6.1f} CPU-s"
    notes = [outcome.why] if outcome.why else []
    if outcome.nonfinite:
        notes.append(f"{outcome.nonfinite} values were NaN or Inf")
    if outcome.negative:
        notes.append(f"{outcome.negative} values were negative")
    if outcome.capped > MUCH_CAPPED:
        notes.append(f"the firefly cap took {outcome.capped:.0%} of the energy")
    return f"{words}  {'; '.join(notes)}".rstrip()


PRESET = "draft"
"""The preset of all cases, without its denoiser, which would hide what must be seen."""

_STRESS_CAMERA = "(stress)"
_PASS_SPP = 256

# What a stage or numpy raises on an odd scene: a finding of the case, not the end of the run.
_FAULTS = (Sumo3dvizError, ArithmeticError, LookupError, ValueError, RuntimeError, MemoryError)


@dataclass(frozen=True, slots=True)
class StressOrder:
    """What to put under stress.

    Attributes:
        camera: A name from `cameras`; default the first shot's.
        time: SUMO's time [s]; default the shot's first.
        variant: `llvm`, `cuda` or `scalar`.
    """

    camera: str | None = None
    time: float | None = None
    variant: str = "llvm"


def put_under_stress(job: Job, order: StressOrder, *, cases: Sequence[Case]) -> StressReport:
    """Render a scene's edges and judge every picture.

    Args:
        job: The scene file.
        order: Which shot.
        cases: In the order in which they run; see `chosen`.

    Raises:
        ConfigError: If the shot itself cannot be built.
        InputError: If a file is wrong.
    """
    check_tone(job.output.tone)
    scene = _survey(job, order)
    outcomes = list[CaseOutcome]()
    announce(Doing.MEASURE, 0, len(cases))
    for outcome in _run(cases, scene):
        outcomes.append(outcome)
        announce(Doing.MEASURE, len(outcomes), len(cases), what=outcome.name)
    return StressReport(scene.base.camera, scene.facts.times["shot"], tuple(outcomes))


@contextmanager
def without_notes() -> Iterator[None]:
    """Hold back notes that the report says, too; one for each picture would bury it."""
    ours = logging.getLogger("sumo3dviz_pt")
    before = ours.level
    ours.setLevel(logging.ERROR)
    try:
        yield
    finally:
        ours.setLevel(before)


def chosen(patterns: Sequence[str]) -> tuple[Case, ...]:
    """Return the cases whose names match one of some patterns, with * and ?; all if there are none.

    Raises:
        ConfigError: If a pattern matches no case.
    """
    cases = all_cases()
    for pattern in patterns:
        if not any(fnmatchcase(case.name, pattern) for case in cases):
            hint = did_you_mean(pattern, [case.name for case in cases])
            raise ConfigError(f"no case is called {pattern!r}{hint}", key="--only")
    return tuple(
        case
        for case in cases
        if not patterns or any(fnmatchcase(case.name, pattern) for pattern in patterns)
    )


# One scene --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _UserScene:
    """The user's scene and what it offers.

    Attributes:
        job: The scene file.
        order: Which shot to start from.
        base: That shot, ready to be rendered.
        facts: What the scene has to offer to the cases.
    """

    job: Job
    order: StressOrder
    base: Production
    facts: SceneFacts


def _survey(job: Job, order: StressOrder) -> _UserScene:
    """Read the whole log once and build the user's own shot."""
    _, scenario, trajectories = read(job)
    name, camera = camera_settings(job, order.camera)
    starts = [shot.start for shot in job.shots if shot.camera == name]
    time = order.time
    if time is None:
        time = starts[0] if starts else float(np.mean(life_of(camera, trajectories)))
    request = Request(name, PRESET, SIZE, variant=order.variant)
    base = metered(prepare(job, request, np.array([time])))
    return _UserScene(job, order, base, facts_of(base, scenario, trajectories, time=time))


def _production(scene: _UserScene, case: Case) -> Production:
    """Return a case's shot, ready to be rendered."""
    made = scene.base
    job, name = scene.job, made.camera
    output: OutputSettings = made.job.output
    if case.weather is not None:
        job = job.model_copy(update={"weather": preset_weather(case.weather)})
    wanted = (case.spot, case.moment, case.size, case.film)
    if job is not scene.job or wanted != ("shot", "shot", SIZE, False):
        if case.spot != "shot":
            name = _STRESS_CAMERA
            stand = SPOTS[case.spot](scene.facts, case)
            x, y, z = scene.base.shot.fleet.location.outside(stand.position).tolist()
            stand = stand.model_copy(update={"position": (x, y, z)})
            job = job.model_copy(update={"cameras": {**job.cameras, name: stand}})
        time = scene.facts.times[case.moment]
        times = frame_times(time, time + 1 / float(output.fps), output.fps)
        request = Request(name, PRESET, case.size, variant=scene.order.variant)
        made = metered(prepare(job, request, times))
    if case.elevation is not None:
        made = _under_sun(made, scene.facts, case.elevation)
    return replace(made, quality=_quality(case))


def _under_sun(made: Production, facts: SceneFacts, elevation: float) -> Production:
    """Return the same shot with the sun at another height [deg]; it does not turn."""
    assert facts.sun is not None
    azimuth = float(np.degrees(np.arctan2(facts.sun[0], facts.sun[1])))
    sun = SunSettings(azimuth=azimuth, elevation=elevation)
    sky = made.job.sky.model_copy(update={"sun": sun})
    return under_sky(made, sky)


def _quality(case: Case) -> Quality:
    """Return the samples and cap of a case; its exposure moves the cap as a film's would."""
    preset = quality_preset(PRESET)
    changes: dict[str, Any] = {
        "spp": case.spp,
        "pass_spp": min(case.spp, _PASS_SPP),
        "denoise": "none",
    }
    if preset.cap is not None:
        changes["cap"] = preset.cap * 2.0**-case.exposure
    return preset.model_copy(update=changes)


# Cases ------------------------------------------------------------------------------------


def _run(cases: Sequence[Case], scene: _UserScene) -> Iterator[CaseOutcome]:
    """Yield how each case ended, in order."""
    for _, group in groupby(cases, key=lambda case: case.stage):
        with ExitStack() as stack:
            stage: _Stage | None = None
            for case in group:
                why = why_not(case, scene.facts)
                if why is not None:
                    yield CaseOutcome(case.name, "left out", why)
                    continue
                started = clock.process_time()
                try:
                    stage = stage or _Stage.open(scene, case, stack)
                    outcome = _ended(case, scene, stage, stack)
                except _FAULTS as error:
                    if interrupted(error):
                        raise KeyboardInterrupt from error
                    outcome = CaseOutcome(case.name, "failed", f"{type(error).__name__}: {error}")
                    stack.close()
                    stage = None
                yield replace(outcome, cpu=round(clock.process_time() - started, 2))


@dataclass(frozen=True, slots=True, eq=False)
class _Stage:
    """A shot in the renderer, for all cases that need the same."""

    production: Production
    session: Session

    @classmethod
    def open(cls, scene: _UserScene, case: Case, stack: ExitStack) -> _Stage:
        """Build a case's shot and open the renderer until the stack is closed."""
        production = _production(scene, case)
        session = stack.enter_context(opened(production))
        return cls(production, session)


def _ended(case: Case, scene: _UserScene, stage: _Stage, stack: ExitStack) -> CaseOutcome:
    """Render a case and judge it."""
    evidence, tally = _seen(case, stage)
    if case.stored:
        evidence = replace(evidence, stored=_stored(evidence.radiance, stage.production))
    if case.twice:
        stack.close()
        again, _ = _seen(case, _Stage.open(scene, case, stack))
        evidence = replace(evidence, again=again.radiance)
    problems = judge(case, evidence)
    return CaseOutcome(
        case.name,
        "failed" if problems else "ok",
        "; ".join(problems),
        nonfinite=tally.nonfinite,
        negative=tally.negative,
        capped=round(tally.capped_share, 5),
    )


def _seen(case: Case, stage: _Stage) -> tuple[CaseEvidence, Any]:
    """Return what a case looks like, and what the renderer counted."""
    production, session = stage.production, stage.session
    quality = _quality(case)
    session.retune(quality, seed=production.job.seed)
    frame = production.frame_at(float(production.times[0]))
    samples = session.samples(frame)
    limit = np.inf if quality.cap is None else quality.cap * 2.0**-production.exposure
    # By day lamps add nothing to the air that could be told from the sky's own light.
    misty = session.loaded.misty and production.shot.dark
    evidence = CaseEvidence(
        radiance=session.finish(samples, frame),
        open_sky=~np.isfinite(samples.distance),
        light=light_of(session.sky, session.data.lamps, frame, session.data, misty=misty),
        limit=float(limit),
        exposure=production.exposure + case.exposure,
        tone=production.job.output.tone,
    )
    return evidence, samples.tally


def _stored(radiance: Image, production: Production) -> Image:
    """Return a picture after it went through an EXR."""
    from sumo3dviz_pt.image.exr import read_exr, write_exr

    with TemporaryDirectory() as folder:
        path = Path(folder) / "frame.exr"
        write_exr(path, {"radiance": radiance}, half=production.job.output.half)
        return read_exr(path)[0]
