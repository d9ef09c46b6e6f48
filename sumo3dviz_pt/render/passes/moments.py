"""Shares a picture's samples out among the moments of an exposure, and sums what they see.

Every row of a picture is seen at equally many moments, and gets its share of the samples at each,
so that a moving shutter costs what the scene's own changes cost, and no further samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import Moment
from sumo3dviz_pt.render.passes.build import pass_seed
from sumo3dviz_pt.render.settings import RenderSettings

WHOLE_HEIGHT = (0.0, 1.0)


@dataclass(frozen=True, slots=True)
class PassOrder:
    """What is traced of a picture at one moment.

    Attributes:
        seed: Of its first pass.
        spp: Samples of a pass.
        passes: How many there are.
        glow_spp: Samples of lamps that are seen directly.
        band: First and last row, shares of the picture's height.
    """

    seed: int
    spp: int
    passes: int
    glow_spp: int
    band: tuple[float, float] = WHOLE_HEIGHT

    def of_moment(self, number: int, moment: Moment) -> PassOrder:
        """Return the order of one of many moments; each has seeds of its own."""
        seed = pass_seed(self.seed, number * self.passes)
        return replace(self, seed=seed, band=moment.rows)

    def rows(self, height: int) -> slice:
        """Return the rows that are traced of a picture so high [px]."""
        first, last = (round(share * height) for share in self.band)
        return slice(first, last)


def whole_order(settings: RenderSettings, seed: int, *, glow_spp: int) -> PassOrder:
    """Return what is traced of a picture that is seen at one moment."""
    return PassOrder(seed, settings.pass_spp, settings.passes, glow_spp)


def shared_order(
    settings: RenderSettings, seed: int, *, glow_spp: int, moments: Sequence[Moment]
) -> PassOrder:
    """Return what is traced of a picture at each moment of an exposure.

    The samples of all moments are as many as the quality has, or one more for each moment where
    they cannot be shared out evenly.
    """
    count = moments_of_a_row(moments)
    spp = -(-settings.quality.spp // count)
    of_pass = min(settings.quality.pass_spp, spp)
    return PassOrder(seed, of_pass, -(-spp // of_pass), max(1, -(-glow_spp // count)))


def moments_of_a_row(moments: Sequence[Moment]) -> int:
    """Return at how many moments each row is seen."""
    return round(sum(last - first for first, last in (moment.rows for moment in moments)))


@dataclass(slots=True)
class MeanOfRows:
    """Averages layers of bands of rows.

    Attributes:
        height: Of the whole picture [px].
    """

    height: int
    _sums: dict[str, Floats] = field(default_factory=dict)
    _counts: dict[str, Floats] = field(default_factory=dict)

    def add(self, layers: Layers, rows: slice) -> None:
        """Add what was found in some rows; the layers have only these."""
        for name, found in layers.items():
            if name not in self._sums:
                self._sums[name] = np.zeros((self.height, *found.shape[1:]))
                self._counts[name] = np.zeros(self.height)
            self._sums[name][rows] += found
            self._counts[name][rows] += 1.0

    def means(self) -> Layers:
        """Return the mean of all rows."""
        found = {}
        for name, sums in self._sums.items():
            counts = self._counts[name].reshape(-1, *(1,) * (sums.ndim - 1))
            found[name] = np.asarray(sums / np.maximum(counts, 1.0), np.float32)
        return Layers(found)
