"""Turns passes of samples into one picture: counted, capped, averaged.

Measured: one NaN or Inf spoils a quarter of a denoised picture, and a few paths that meet a
glint of the sun make up most of a picture's mean. A cap of samples at 40 x white that keeps
their hues costs 0.2 % of the energy by day.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Bools, Floats, Image
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
        return self.capped / self.energy if self.energy > 0 else 0.0

    @property
    def dimmed_share(self) -> float:
        """Share of the light of pixels darker than white that the cap took, in [0, 1]."""
        return self.dimmed / self.dark if self.dark > 0 else 0.0


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
        kept = radiance * np.minimum(1.0, limit / np.maximum(peak, 1e-30))
        return kept, radiance - kept


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
    _kept: Floats | None = None
    _lost: Floats | None = None

    def add(self, radiance: Image, lost: Image | None = None) -> None:
        """Add one pass and what the cap took from it, (h, w, 3) each."""
        kept = np.array(radiance, dtype=np.float64)
        gone = np.zeros_like(kept) if lost is None else np.array(lost, dtype=np.float64)
        broken = ~(np.isfinite(kept) & np.isfinite(gone)).all(axis=-1)
        self.tally.nonfinite += int(broken.sum())
        self.tally.negative += int(((kept < 0).any(axis=-1) & ~broken).sum())
        kept[broken] = gone[broken] = 0.0
        np.maximum(kept, 0.0, out=kept)
        self.tally.energy += float(kept.sum() + gone.sum())
        self.tally.passes += 1
        self._kept = kept if self._kept is None else self._kept + kept
        self._lost = gone if self._lost is None else self._lost + gone
        self._count_lost(self._kept / self.tally.passes, self._lost)

    def _count_lost(self, mean: Floats, lost: Floats) -> None:
        """Bring the tally's account of the cap up to date."""
        counts = np.ones(mean.shape[:2], bool) if self.exempt is None else ~self.exempt
        dark = counts & (mean.max(axis=-1) < self.white)
        self.tally.capped = float(lost[counts].sum())
        self.tally.dimmed = float(lost[dark].sum())
        self.tally.dark = float(mean[dark].sum() * self.tally.passes) + self.tally.dimmed

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
        kept, lost = self._kept / passes, self._lost / passes
        return kept.astype(np.float32), lost.astype(np.float32)

    def mean(self) -> Image:
        """Return the mean of all passes, uncapped where exempt; errors as in `means`."""
        kept, lost = self.means()
        return kept if self.exempt is None else np.where(self.exempt[..., None], kept + lost, kept)


def pass_seed(seed: int, number: int) -> int:
    """Return the seed of a frame's n-th pass; the golden ratio keeps those of two frames apart."""
    return seed + 0x9E3779B9 * number


def report(tally: Tally, time: float) -> None:
    """Log what was counted, as a warning where the cap makes the picture too dark."""
    alarming = tally.dimmed_share > MOST_DIMMED or tally.nonfinite > 0
    log.log(
        logging.WARNING if alarming else logging.DEBUG,
        "at %g s the firefly cap took %.2f %% of the light of pixels darker than white and"
        " %.2f %% of all; %d pixel values were not finite, %d negative",
        time,
        100 * tally.dimmed_share,
        100 * tally.capped_share,
        tally.nonfinite,
        tally.negative,
    )
