"""How a session renders, what its tracers find, and what a frame costs by phase."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.layers import Layers, MovingPart
from sumo3dviz_pt.render.passes.samples import Accumulator
from sumo3dviz_pt.render.textures import PIXEL


@dataclass(slots=True)
class Clock:
    """Adds up CPU-seconds by phase."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Charge a block of work to a phase."""
        start = time.process_time()
        yield
        spent = time.process_time() - start
        self.seconds[name] = self.seconds.get(name, 0.0) + spent


AfterPass = Callable[[int, int], None]
"""Called with passes done and passes in all."""


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """How to render.

    Attributes:
        size: Width, height [px].
        quality: Samples, depth, denoiser, cap.
        seed: The film's seed.
        white: Radiance that the film shows as white, scene units.
        pixel: Angle of a pixel, by which textures are filtered [rad].
        layers: What `Session.render` returns; see `model/layers.py`. Those that the quality does
            not need are traced, too.
    """

    size: tuple[int, int]
    quality: Quality
    seed: int
    white: float = 1.0
    pixel: float = PIXEL
    layers: tuple[str, ...] = ("radiance",)

    @property
    def limit(self) -> float:
        """Highest channel value of a sample; inf for no cap."""
        cap = self.quality.cap
        return np.inf if cap is None else cap * self.white

    @property
    def pass_spp(self) -> int:
        """Samples per pass: the preset's, but never more than in all."""
        return min(self.quality.pass_spp, self.quality.spp)

    @property
    def passes(self) -> int:
        """How many passes a frame has."""
        return -(-self.quality.spp // self.pass_spp)


class Traced(NamedTuple):
    """What a tracer finds of a frame.

    Attributes:
        layers: As in `session.Samples`, but without the picture.
        passes: The picture, and what the cap took.
        movers: What the numbers of the layer `ids` stand for, if that was traced.
    """

    layers: Layers
    passes: Accumulator
    movers: tuple[MovingPart, ...] = ()


class Tracer(Protocol):
    """Traces frames of a loaded scene."""

    @property
    def finds(self) -> Collection[str]:
        """Layers that it can find besides the picture's."""

    def trace(self, seed: int, after_pass: AfterPass | None) -> Traced:
        """Trace what the scene shows, in all passes of a frame."""
