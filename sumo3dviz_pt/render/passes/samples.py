"""Turns passes of samples into one picture: counted, capped, averaged.

Measured: one NaN or Inf spoils a quarter of a denoised picture, and a few paths that meet a
glint of the sun make up most of a picture's mean. A cap of samples at 40 x white that keeps
their hues costs 0.2 % of the energy by day.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.random import frame_seed as frame_seed

log = logging.getLogger(__name__)

MOST_DIMMED = 0.02
"""Share of the light of pixels darker than white above which the cap is worth a warning."""

BAD_SHARE = 1e-5
"""Share of pixels that may be NaN or Inf before a frame counts as failed."""


@dataclass(slots=True)
class Tally:
    """What was found while rendering one frame.

    Attributes:
        nonfinite: Pixels x passes that were NaN or Inf.
        negative: Pixels x passes below zero.
        energy: Sum of all pixel values before the cap.
        capped: Sum of what the cap took away.
        dimmed: That part of `capped` which pixels darker than white lost: only there can it
            be seen. The rest is mostly the sun's image in glass and chrome.
        dark: Sum of those pixels' values before the cap.
        passes: How many passes were added.
    """

    nonfinite: int = 0
    negative: int = 0
    energy: float = 0.0
    capped: float = 0.0
    dimmed: float = 0.0
    dark: float = 0.0
    passes: int = 0

    @property
    def capped_share(self) -> float:
        """Share of the energy that the cap took, in [0, 1]."""
        return _share(self.capped, self.energy)

    @property
    def dimmed_share(self) -> float:
        """Share of the light of pixels darker than white that the cap took, in [0, 1]."""
        return _share(self.dimmed, self.dark)


def _share(part: float, whole: float) -> float:
    """Return a part's share, in [0, 1]; sums of single precision may say a little more."""
    return min(part / whole, 1.0) if whole > 0 else 0.0


def capped(radiance: Image, limit: float) -> tuple[Image, Image]:
    """Cut a pass to a limit without changing its hues.

    Args:
        radiance: (h, w, 3).
        limit: Highest channel value that may stay; inf for no cap.

    Returns:
        What stays and what is lost, (h, w, 3) each.
    """
    peak = radiance.max(axis=-1, keepdims=True)
    # NaN and Inf come out as NaN and are counted later.
    with np.errstate(invalid="ignore"):
        within = radiance * np.minimum(1.0, limit / np.maximum(peak, 1e-30))
        return within, radiance - within


@dataclass(slots=True)
class Accumulator:
    """Averages passes of one frame.

    Attributes:
        exempt: Pixels that see an emitter directly, (h, w), where the cap does not count.
        white: Radiance that is shown as white, scene units.
        tally: What was found in the passes that were added.
    """

    exempt: Bools | None = None
    white: float = 1.0
    tally: Tally = field(default_factory=Tally)
    _kept: Image | None = None
    _lost: Image | None = None

    def add(self, radiance: Image, lost: Image | None = None) -> None:
        """Add one pass and what the cap took from it, (h, w, 3) each."""
        light = np.array(radiance, np.float32)
        gone = np.zeros_like(light) if lost is None else np.array(lost, np.float32)
        # A sum that is finite has finite parts; it costs a third of looking at each of them.
        with np.errstate(invalid="ignore", over="ignore"):
            broken = ~np.isfinite(_over(np.add, light + gone))
        if broken.any():
            self.tally.nonfinite += int(broken.sum())
            light[broken] = gone[broken] = 0.0
        if light.min(initial=0.0) < 0.0:
            self.tally.negative += int(_over(np.logical_or, light < 0).sum())
            np.maximum(light, 0.0, out=light)
        self.tally.energy += _sum(light) + _sum(gone)
        self.tally.passes += 1
        self._kept = light if self._kept is None else self._kept + light
        self._lost = gone if self._lost is None else self._lost + gone
        self._count_lost(self._kept, self._lost)

    def _count_lost(self, within: Image, lost: Image) -> None:
        """Bring the tally's account of the cap up to date."""
        counts = np.ones(within.shape[:2], bool) if self.exempt is None else ~self.exempt
        dark = counts & (_over(np.maximum, within) < self.white * self.tally.passes)
        light, gone = _over(np.add, within), _over(np.add, lost)
        self.tally.capped = _sum(gone[counts])
        self.tally.dimmed = _sum(gone[dark])
        self.tally.dark = _sum(light[dark]) + self.tally.dimmed

    def means(self) -> tuple[Image, Image]:
        """Return the mean of the capped passes and of what the cap took, (h, w, 3) each.

        Raises:
            RenderError: If there was no pass, or too many pixels were NaN or Inf.
        """
        if self._kept is None or self._lost is None:
            raise RenderError("no pass was rendered")
        pixels, passes = self._kept.shape[0] * self._kept.shape[1], self.tally.passes
        if self.tally.nonfinite > BAD_SHARE * pixels * passes:
            raise RenderError(
                f"{self.tally.nonfinite} pixel values of {passes} passes are NaN or"
                " infinite; this is a fault of the scene's materials or of the renderer"
            )
        return self._kept / np.float32(passes), self._lost / np.float32(passes)

    def mean(self) -> Image:
        """Return the mean of all passes, uncapped where exempt; errors as in `means`."""
        within, lost = self.means()
        if self.exempt is not None:
            within[self.exempt] += lost[self.exempt]
        return within


def _over(how: np.ufunc, picture: Image | Bools) -> Any:
    """Join a picture's channels by an operation, (h, w); numpy's own reduction is slow there."""
    red, green, blue = (picture[..., channel] for channel in range(3))
    return np.asarray(how(how(red, green), blue))


def _sum(values: Image) -> float:
    """Return a sum of single numbers in double precision."""
    return float(values.sum(dtype=np.float64))


def pass_seed(seed: int, number: int) -> int:
    """Return the seed of a frame's n-th pass; the golden ratio keeps those of two frames apart."""
    return seed + 0x9E3779B9 * number


def report(tally: Tally, time: float) -> None:
    """Log what was counted, as a warning where the cap makes the picture too dark."""
    alarming = tally.dimmed_share > MOST_DIMMED or tally.nonfinite > 0
    log.log(
        logging.WARNING if alarming else logging.DEBUG,
        "at %.12g s the firefly cap took %.2f %% of the light of pixels darker than white and"
        " %.2f %% of all; %d pixel values were not finite, %d negative",
        time,
        100 * tally.dimmed_share,
        100 * tally.capped_share,
        tally.nonfinite,
        tally.negative,
    )
