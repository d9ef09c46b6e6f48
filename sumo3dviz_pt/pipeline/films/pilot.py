"""Chooses samples per pixel by what people want of a film: its cost, or its error.

A pilot renders the middle frame of the shot a few times. What it finds holds for all frames, so
that no frame looks better than its neighbours. A film that is resumed keeps what its first pilot
chose, because a second one would measure other seconds.

References:
    Andersson et al., "FLIP: a difference evaluator for alternating images", HPG 2020,
    doi:10.1145/3406183 (the error).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.costs import rates_of
from sumo3dviz_pt.pipeline.films.frames import NOTE, film_of
from sumo3dviz_pt.pipeline.production import Production, Request, opened

if TYPE_CHECKING:
    from sumo3dviz_pt.model.scene import FrameState
    from sumo3dviz_pt.render.session import Session


MOST_SAMPLES = 4096
"""More than these are a reference's."""

_FULL_PASS = 64
"""Samples of a pass; more at once take more memory."""

_COSTS = (2, 9)
"""Samples of the pictures whose costs are measured."""

_FIRST, _REPEATS = 2, 3
"""Pictures that compile and do not count, and pictures whose median cost does."""

_ERRORS = (2, 6, 20, 64)
"""Samples of the pictures whose errors are measured."""

_TRUTH = 512
"""Samples of the picture that they are compared with."""

_SIDE = 480
"""Longest side of the pictures whose errors are measured [px]."""


@dataclass(frozen=True, slots=True)
class PilotChoice:
    """What a pilot chose.

    Attributes:
        spp: Samples per pixel.
        wish: `time_budget` or `target_error`, with what was asked for.
        expected: What a frame should then cost [CPU-s], or its error (FLIP).
    """

    spp: int
    wish: Mapping[str, float]
    expected: float

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"spp": self.spp, **self.wish, "expected": float(f"{self.expected:.3g}")}


def piloted(production: Production, request: Request, *, folder: Path | None = None) -> Production:
    """Return a production with the samples that its pilot chose, if the request asks for one.

    Args:
        production: The shot.
        request: What is wanted of it.
        folder: Of the film's frames; what was chosen for those that lie there holds for others.

    Raises:
        ConfigError: If not even one sample is cheap enough, or no pilot can judge the error.
        MissingExtraError: If an error is wanted, and the package that measures it is missing.
    """
    wish = request.wish
    if not wish:
        return production
    before = None if folder is None else _chosen_before(production, wish, folder)
    # A film's frames also help each other when it is developed; a picture alone has no help.
    frames = 1 if folder is None else len(production.times)
    rates = rates_of(production.variant)
    helped = rates.help_of(production.quality, size=production.job.output.size, frames=frames)
    choice = before or _measured(production, wish, helped)
    quality = with_samples(production.quality, choice.spp)
    return replace(production, quality=quality, pilot=choice.as_dict())


def with_samples(quality: Quality, spp: int) -> Quality:
    """Return a quality with other samples, in passes that take no more than these."""
    return quality.model_copy(update={"spp": spp, "pass_spp": min(spp, _FULL_PASS)})


def counts(most: int = MOST_SAMPLES) -> list[int]:
    """Return the numbers of samples that can be chosen, rising.

    These are k x k and k x (k + 1), because the sampler's pattern rounds all others up; and
    beyond a full pass, whole passes.
    """
    numbers: list[int] = []
    for k in count(1):
        if k * k > _FULL_PASS:
            break
        numbers += [k * k, k * (k + 1)]
    small = [number for number in numbers if number <= _FULL_PASS]
    return [n for n in (*small, *range(2 * _FULL_PASS, most + 1, _FULL_PASS)) if n <= most]


def affordable(costs: Mapping[int, float], budget: float) -> tuple[int, float]:
    """Return the most samples that a budget pays for, and what a frame with them costs.

    Args:
        costs: CPU-seconds of a frame by its samples; at least two.
        budget: CPU-seconds of a frame.

    Raises:
        ConfigError: If it pays for none.
    """
    slope, always = np.polyfit([*costs], [*costs.values()], 1)
    # Noise of the measurement may not make samples free.
    slope = max(float(slope), 1e-6)
    paid = [number for number in counts() if always + slope * number <= budget]
    if not paid:
        raise ConfigError(
            f"{budget:g} CPU-seconds a frame are too few: a single sample per pixel takes about"
            f" {always + slope:.2g} here; give more, or a smaller --size",
            key="time_budget",
        )
    return paid[-1], float(always + slope * paid[-1])


def sufficient(errors: Mapping[int, float], target: float) -> tuple[int, float]:
    """Return the fewest samples whose error is at most a target, and that error.

    Errors between and beyond those that were measured lie on lines in logarithms.

    Args:
        errors: By samples, rising; at least two.
        target: The error.

    Raises:
        ConfigError: If no number that may be chosen is enough.
    """
    for number in counts():
        error = _between(errors, number)
        if error <= target:
            return number, error
    least = min(errors.values())
    raise ConfigError(
        f"an error of {target:g} is less than this scene reaches: {least:.3f} was measured with"
        f" {max(errors)} samples; give a larger one, or take the preset reference",
        key="target_error",
    )


def _between(errors: Mapping[int, float], number: int) -> float:
    """Return the error of a number of samples; beyond the last two their line goes on."""
    points = [(np.log(n), np.log(max(error, 1e-9))) for n, error in errors.items()]
    at = np.log(number)
    (x0, y0), (x1, y1) = next((p for p in pairwise(points) if at <= p[1][0]), tuple(points[-2:]))
    # An error that seems to grow with the samples is noise.
    slope = min((y1 - y0) / (x1 - x0), 0.0)
    return float(np.exp(y0 + slope * (at - x0)))


def _chosen_before(
    production: Production, wish: Mapping[str, float], folder: Path
) -> PilotChoice | None:
    """Return what was chosen for the same film's frames in a folder, if there are some."""
    account = film_of(folder) if (folder / NOTE).is_file() else None
    before = (account or {}).get("pilot")
    if account is None or before is None or any(before.get(key) != wish[key] for key in wish):
        return None
    same = replace(production, quality=with_samples(production.quality, int(before["spp"])))
    if same.key != account.get("key"):
        return None
    return PilotChoice(int(before["spp"]), wish, float(before["expected"]))


def _measured(production: Production, wish: Mapping[str, float], helped: float) -> PilotChoice:
    """Run the pilot.

    Args:
        production: The shot.
        wish: What is wanted.
        helped: What a frame costs beyond its rendering [CPU-s].
    """
    state = production.frame_at(float(production.times[len(production.times) // 2]))
    if "time_budget" in wish:
        costs = {spp: cost + helped for spp, cost in _costs(production, state).items()}
        spp, expected = affordable(costs, wish["time_budget"])
    else:
        spp, expected = sufficient(_errors(production, state), wish["target_error"])
    return PilotChoice(spp, wish, expected)


def _costs(production: Production, state: FrameState) -> dict[int, float]:
    """Return the work of a later frame by its samples: CPU-seconds, or seconds of a GPU."""
    from sumo3dviz_pt.render.backend import worked

    costs: dict[int, float] = {}
    with opened(production) as session:
        for group, spp in enumerate(_COSTS):
            session.retune(with_samples(production.quality, spp), seed=0)
            seconds = []
            for number in range(_FIRST + _REPEATS):
                done = 1 + number + group * (_FIRST + _REPEATS)
                announce(Doing.MEASURE, done, len(_COSTS) * (_FIRST + _REPEATS), what="pilot")
                started = worked()
                session.render(state)
                seconds.append(worked() - started)
            costs[spp] = float(np.median(seconds[_FIRST:]))
    return costs


def _errors(production: Production, state: FrameState) -> dict[int, float]:
    """Return errors of a small picture by its samples."""
    from sumo3dviz_pt.image.metrics import flip

    size = _small(production.job.output.size)
    output = production.job.output.model_copy(update={"size": size})
    small = replace(production, job=production.job.model_copy(update={"output": output}))
    # A package that is missing is missed before the work, not after it.
    black = np.zeros((16, 16, 3), np.float32)
    flip(black, black)
    with opened(small) as session:
        truth = _picture(session, small, state, _TRUTH, 0)
        return {
            spp: flip(_picture(session, small, state, spp, number), truth)
            for number, spp in enumerate(_ERRORS, start=1)
        }


def _picture(
    session: Session, production: Production, state: FrameState, spp: int, number: int
) -> Image:
    """Return a developed picture of the pilot, (h, w, 3) in [0, 1].

    Args:
        session: Open.
        production: The shot.
        state: The frame.
        spp: Its samples.
        number: Of the picture, the first of which is compared with.
    """
    from sumo3dviz_pt.image.tonemap import develop_float

    announce(Doing.MEASURE, number, 1 + len(_ERRORS), what="pilot")
    session.retune(with_samples(production.quality, spp), seed=1 + number)
    radiance = session.render(state).radiance
    tone = production.job.output.tone
    return develop_float(radiance, exposure=production.exposure, tone=tone)


def _small(size: Sequence[int]) -> tuple[int, int]:
    """Return a size of the same shape whose longest side is no longer than the pilot's."""
    scale = min(1.0, _SIDE / max(size))
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))
