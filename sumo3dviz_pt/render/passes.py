"""Turns passes of samples into one picture: counted, capped, averaged.

References:
    facts/denoising.md, section 5: one NaN or Inf spoils a quarter of a denoised
    picture, and a few sun-glint paths own its mean; a colour-preserving cap of 40 x
    white on passes of few samples costs 0.2 % of the energy by day.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Bools, Floats, Image

log = logging.getLogger(__name__)

MOST_CAPPED = 0.02
"""Share of the energy above which the firefly cap is worth a warning."""

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
        passes: How many passes were added.
    """

    nonfinite: int = 0
    negative: int = 0
    energy: float = 0.0
    capped: float = 0.0
    passes: int = 0

    @property
    def capped_share(self) -> float:
        """Share of the energy that the cap took, in [0, 1]."""
        return self.capped / self.energy if self.energy > 0 else 0.0


@dataclass(slots=True)
class Accumulator:
    """Averages passes of one frame.

    Attributes:
        limit: Highest channel value that a pass may hold; inf for no cap.
        exempt: Pixels that see an emitter directly, (h, w); never capped.
        tally: What was found so far.
    """

    limit: float
    exempt: Bools | None = None
    tally: Tally = field(default_factory=Tally)
    _total: Floats | None = None

    def add(self, radiance: Image) -> None:
        """Add one pass, (h, w, 3)."""
        values = np.array(radiance, dtype=np.float64)
        broken = ~np.isfinite(values).all(axis=-1)
        self.tally.nonfinite += int(broken.sum())
        self.tally.negative += int(((values < 0).any(axis=-1) & ~broken).sum())
        values[broken] = 0.0
        np.maximum(values, 0.0, out=values)
        peak = values.max(axis=-1)
        over = peak > self.limit
        if self.exempt is not None:
            over &= ~self.exempt
        self.tally.energy += float(values.sum())
        before = float(values[over].sum())
        values[over] *= (self.limit / peak[over])[:, None]
        self.tally.capped += before - float(values[over].sum())
        self.tally.passes += 1
        self._total = values if self._total is None else self._total + values

    def mean(self) -> Image:
        """The picture so far, (h, w, 3).

        Raises:
            RenderError: If too many pixels were NaN or Inf.
        """
        if self._total is None:
            raise RenderError("no pass was rendered")
        pixels = self._total.shape[0] * self._total.shape[1]
        if self.tally.nonfinite > BAD_SHARE * pixels * self.tally.passes:
            raise RenderError(
                f"{self.tally.nonfinite} pixel values of {self.tally.passes} passes are NaN or"
                " infinite; this is a fault of the scene's materials or of the renderer"
            )
        return np.asarray(self._total / self.tally.passes, dtype=np.float32)


def frame_seed(seed: int, time: float) -> int:
    """A frame's own seed from the film's seed and its time [s], in [0, 2^32)."""
    microseconds = round(time * 1e6)
    words = [seed, microseconds % 2**32, abs(microseconds) // 2**32, int(microseconds < 0)]
    return int(np.random.SeedSequence(words).generate_state(1)[0])


def report(tally: Tally, time: float) -> None:
    """Log what was counted; a cap that takes much makes the picture too dark."""
    alarming = tally.capped_share > MOST_CAPPED or tally.nonfinite > 0
    level = logging.WARNING if alarming else logging.DEBUG
    log.log(
        level,
        "at %g s the firefly cap took %.2f %% of the energy; %d pixel values were not finite,"
        " %d negative",
        time,
        100 * tally.capped_share,
        tally.nonfinite,
        tally.negative,
    )
