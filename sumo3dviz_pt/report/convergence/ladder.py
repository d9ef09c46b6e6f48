"""Renders groups of pictures and turns them into rows."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.image.metrics import flip
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.pipeline.films.traced import helped, new_averager, traced_by
from sumo3dviz_pt.pipeline.production import Production
from sumo3dviz_pt.report.convergence.plan import PictureLook, Reference, SeedGroup, score
from sumo3dviz_pt.report.convergence.table import DEPTH, TableRow
from sumo3dviz_pt.report.films.flicker import SeenFrame, body_bounds, flicker, flow_between
from sumo3dviz_pt.report.machine import peak_memory

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.films.traced import Averager
    from sumo3dviz_pt.pipeline.production import Samples, Session


FLICKER = 1
"""Frames before and after the measured one to which its changes are measured."""

RECORDING = 3
"""First pictures of a group, in which the renderer may still record its kernels."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredSubject:
    """What is measured.

    Attributes:
        name: Of the scene.
        production: The shot.
        states: Successive frames around the one whose error is measured, an odd number.
        made_with: Machine, versions, variant and compiler, by column.
    """

    name: str
    production: Production
    states: tuple[FrameState, ...]
    made_with: Mapping[str, str | int]

    @property
    def state(self) -> FrameState:
        """The frame whose error is measured."""
        return self.states[len(self.states) // 2]

    def around(self, reach: int) -> tuple[FrameState, ...]:
        """Return that frame and as many before it and after it."""
        middle = len(self.states) // 2
        return self.states[max(middle - reach, 0) : middle + reach + 1]

    @property
    def look(self) -> PictureLook:
        """Exposure and tone curve of its pictures."""
        return PictureLook(self.production.exposure, self.production.job.output.tone)


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPicture:
    """One measured picture.

    Attributes:
        seed: Its seed.
        denoiser: What it was finished with.
        radiance: With haze, (h, w, 3).
        capped: See `score`; None if not plain.
        costs: By column.
        counts: By column.
    """

    seed: int
    denoiser: str
    radiance: Image
    capped: Image | None
    costs: dict[str, float]
    counts: dict[str, float | int]


def pictures(
    session: Session,
    subject: MeasuredSubject,
    group: SeedGroup,
    *,
    on_picture: Callable[[int], None],
) -> list[MeasuredPicture]:
    """Render a group's pictures.

    Costs are those of later frames of a film: what the first pictures cost more
    than the others is recording, and goes to `t_compile`.

    Args:
        session: An open session.
        subject: What to render.
        group: How.
        on_picture: Called with the samples per pixel after every picture.
    """
    shown: list[MeasuredPicture] = []
    for seed in range(1, group.seeds + 1):
        session.retune(group.quality, seed=seed)
        frames = []
        for state in subject.around(group.quality.accumulate):
            started = time.perf_counter()
            samples = session.samples(state)
            frames.append(_TracedFrame(state, samples, dict(session.clock.seconds), started))
            on_picture(group.quality.spp)
        shown += _finished(session, subject, group, frames)
    return _steady(shown, group)


class _TracedFrame:
    """A frame that was just traced.

    Args:
        state: What it shows.
        samples: What was traced.
        phases: CPU-seconds.
        started: When, by the wall clock [s].
    """

    def __init__(
        self, state: FrameState, samples: Samples, phases: Mapping[str, float], started: float
    ) -> None:
        self.state, self.samples = state, samples
        self.load = phases["load"]
        self.cpu = phases["render"]
        self.guides = phases.get("guides", 0.0)
        self.wall = time.perf_counter() - started
        self._traced: TracedFrame | None = None

    def traced(self, session: Session) -> TracedFrame:
        """Return it as its neighbours need it; the session's samples are what they were."""
        if self._traced is None:
            self._traced = traced_by(session, self.samples, self.state)
        return self._traced


def _costs(frames: Sequence[_TracedFrame], group: SeedGroup) -> dict[str, float]:
    """Return what tracing one of the frames cost, by column."""
    count = len(frames)
    cpu = sum(frame.cpu + (0.0 if group.plain else frame.guides) for frame in frames)
    return {
        "t_build": sum(frame.load for frame in frames),
        "t_render_wall": sum(frame.wall for frame in frames) / count,
        "t_compile": 0.0,
        "t_render_cpu": cpu / count,
    }


def _finished(
    session: Session, subject: MeasuredSubject, group: SeedGroup, frames: Sequence[_TracedFrame]
) -> Iterator[MeasuredPicture]:
    """Yield one picture for each denoiser: the middle frame, helped by the others."""
    costs, middle = _costs(frames, group), frames[len(frames) // 2]
    samples = middle.samples
    tally, layers = samples.tally, samples.layers
    counts: dict[str, float | int] = {
        "passes": tally.passes,
        "capped_energy_frac": tally.capped_share,
        "nonfinite_px": tally.nonfinite,
        "neg_px": tally.negative,
    }
    for denoiser in group.denoisers:
        started = time.process_time()
        if group.plain:
            plain = layers | {"radiance": layers["capped"] + layers["lost"]}
            radiance = session.hazed(plain, subject.state.view)
        elif group.quality.accumulate:
            radiance = _helped(session, frames, frames.index(middle), new_averager())
        else:
            radiance = session.finish(samples, subject.state, denoiser=denoiser)
        spent = 0.0 if denoiser == "none" else time.process_time() - started
        yield MeasuredPicture(
            session.settings.seed,
            denoiser,
            radiance,
            layers["capped"] if group.plain else None,
            {**costs, "t_denoise_cpu": spent},
            counts,
        )


def _helped(
    session: Session, frames: Sequence[_TracedFrame], number: int, averager: Averager
) -> Image:
    """Return a frame's finished radiance, helped by those around it, as a film's is."""
    window = session.settings.quality.accumulate
    around = frames[max(number - window, 0) : number + window + 1]
    others = [frame.traced(session) for frame in around if frame is not frames[number]]
    how = session.finishing_of(frames[number].state)
    return helped(frames[number].traced(session), others, how, averager=averager).finished()


def _steady(shown: list[MeasuredPicture], group: SeedGroup) -> list[MeasuredPicture]:
    """Take recording out of the first pictures' costs."""
    later = [item for item in shown if item.seed > RECORDING]
    if not later:
        return shown
    usual = {
        key: float(np.median([item.costs[key] for item in later]))
        for key in ("t_render_cpu", "t_render_wall")
    }
    for item in shown:
        if item.seed <= RECORDING:
            extra = item.costs["t_render_cpu"] - usual["t_render_cpu"]
            item.costs.update(usual, t_compile=max(0.0, extra))
    return shown


def rows_of(
    shown: list[MeasuredPicture], subject: MeasuredSubject, group: SeedGroup, reference: Reference
) -> Iterator[TableRow]:
    """Score pictures against a reference.

    Args:
        shown: Pictures of a group.
        subject: What they show.
        group: How they were rendered.
        reference: What they should be.
    """
    halves = halves_flip(reference, subject.look)
    # The key hashes all input files, which may be large.
    key = subject.production.key[:8]
    for item in shown:
        scores = score(
            item.radiance,
            reference,
            subject.look,
            capped=item.capped,
            exposures=item.seed == 1 and group.label != DEPTH,
        )
        yield {
            **_description(subject, group),
            "ref_id": key,
            "ref_spp": reference.spp,
            "ref_halves_flip": halves,
            "seed": item.seed,
            "denoise": "none" if item.denoiser == "none" else "oidn",
            "quality": "" if item.denoiser == "none" else item.denoiser,
            "aux": _guides(group, item.denoiser),
            "peak_rss_mb": round(peak_memory()),
            **{key: round(value, 4) for key, value in item.costs.items()},
            **item.counts,
            **scores,
        }


def _guides(group: SeedGroup, denoiser: str) -> str:
    """Return what the denoiser was given beside the picture."""
    if denoiser == "none":
        return ""
    return "albedo+normal" if group.quality.guides else "none"


def _description(subject: MeasuredSubject, group: SeedGroup) -> TableRow:
    """Return what is the same for all pictures of a group."""
    quality, job = group.quality, subject.production.job
    return {
        **subject.made_with,
        "scene": subject.name,
        "W": job.output.size[0],
        "H": job.output.size[1],
        "preset": group.label,
        "spp": quality.spp,
        "sampler": quality.sampler,
        "max_depth": quality.max_depth,
        "rr_depth": quality.rr_depth,
        "rfilter": "box",
        "frame": 0,
        "temporal": f"{quality.accumulate} frames" if quality.accumulate else "none",
        "cap_x_white": np.inf if quality.cap is None else quality.cap,
    }


def halves_flip(reference: Reference, look: PictureLook) -> float:
    """Return the FLIP of the reference's halves against each other."""
    return flip(*(look.develop(half) for half in reference.halves))


def film_flicker(session: Session, subject: MeasuredSubject, group: SeedGroup) -> float:
    """Return the mean motion-compensated change between successive frames [8-bit codes].

    Args:
        session: The scene in the renderer.
        subject: Its frames and how they are shown.
        group: How they are rendered.
    """
    bodies = body_bounds(subject.production.shot.data.prototypes)
    before: tuple[Image, SeenFrame] | None = None
    changes = []
    session.retune(group.quality, seed=1)
    window = group.quality.accumulate
    averager, frames = new_averager(), []
    for state in subject.around(window + FLICKER):
        started = time.perf_counter()
        frames.append(_TracedFrame(state, session.samples(state), session.clock.seconds, started))
    for number in range(window, len(frames) - window):
        picture = subject.look.develop(_helped(session, frames, number, averager))
        seen = SeenFrame(frames[number].state, frames[number].samples.distance)
        if before is not None:
            flow = flow_between(seen, before[1], bodies)
            changes.append(flicker(picture, before[0], flow).codes)
        before = (picture, seen)
    return float(np.mean(changes))
