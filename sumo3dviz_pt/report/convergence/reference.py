"""A reference that grows until its own error no longer matters.

Chunks with seeds of their own go to two halves in turn. The halves against each other
say how far the reference itself is from the truth, without knowing the truth: by
capped RMSE, their difference is twice the error of their mean. The sampler is the
independent one and the seeds are others than those of the pictures that are judged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.files.whole import whole
from sumo3dviz_pt.image.metrics import capped_rmse
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import FrameState

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Samples, Session

CHUNK = 64
"""Samples per pixel of a chunk."""

FIRST_SEED = 1_000_001
"""Of the reference's chunks; pictures that it judges have small seeds."""

LAYERS = ("capped", "lost", "hit", "depth")
"""What is added up and stored; see `model/layers.py`."""


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A reference picture.

    Attributes:
        radiance: Uncapped, with haze, (h, w, 3).
        capped: Mean of samples capped one by one, without haze, (h, w, 3).
        sky: Pixels that see the sky or the sun directly, at least in part, (h, w).
        spp: Samples per pixel.
        halves_rmse: Capped RMSE of its halves against each other.
        halves: The halves' uncapped pictures with haze, (h, w, 3) each.
    """

    radiance: Image
    capped: Image
    sky: Bools
    spp: int
    halves_rmse: float
    halves: tuple[Image, Image]


@dataclass(slots=True)
class Halves:
    """Sums of two independent halves, as they grow.

    Attributes:
        sums: By half and layer, (h, w) or (h, w, 3).
        count: Chunks in each half.
    """

    sums: tuple[dict[str, Floats], dict[str, Floats]] = field(default_factory=lambda: ({}, {}))
    count: list[int] = field(default_factory=lambda: [0, 0])

    @property
    def chunks(self) -> int:
        """Chunks in both halves."""
        return sum(self.count)

    def add(self, samples: Samples) -> None:
        """Add a chunk to the half whose turn it is."""
        half = self.chunks % 2
        for name in LAYERS:
            layer, total = samples.layers[name], self.sums[half].get(name)
            self.sums[half][name] = layer.astype(np.float64) + (0.0 if total is None else total)
        self.count[half] += 1

    def mean(self, name: str, halves: tuple[int, ...] = (0, 1)) -> Image:
        """Return a layer's mean over one half or both."""
        total = np.sum([self.sums[half][name] for half in halves], axis=0)
        return np.asarray(total / sum(self.count[half] for half in halves), dtype=np.float32)

    def difference(self) -> float:
        """Capped RMSE of the halves against each other; infinite before both exist."""
        if min(self.count) == 0:
            return float("inf")
        # The pictures hold capped samples already.
        return capped_rmse(self.mean("capped", (0,)), self.mean("capped", (1,)), cap=np.inf)

    def save(self, path: Path) -> None:
        """Store both halves; an interruption leaves the old state."""
        arrays = {f"{name}{half}": self.sums[half][name] for half in (0, 1) for name in LAYERS}
        with whole(path) as part, part.open("wb") as stream:
            np.savez(stream, count=self.count, **arrays)  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> Halves:
        """Return what `save` stored."""
        with np.load(path, allow_pickle=False) as stored:
            sums = tuple({name: stored[f"{name}{half}"] for name in LAYERS} for half in (0, 1))
            return cls((sums[0], sums[1]), stored["count"].tolist())


def grow(
    session: Session,
    frame: FrameState,
    halves: Halves,
    *,
    target: float,
    path: Path,
    on_chunk: Callable[[int, float], bool],
) -> None:
    """Render chunks until the halves differ by less than a target.

    Args:
        session: Tuned to `chunk_quality`.
        frame: What to render.
        halves: What exists; grows in place.
        target: Capped RMSE of the halves against each other.
        path: Where the state is stored after every pair of chunks.
        on_chunk: Called with the number of chunks and the difference of the halves; False stops.
    """
    quality = session.settings.quality
    going = True
    while going and (halves.chunks < 2 or halves.difference() > target):
        for _ in range(2):
            session.retune(quality, seed=FIRST_SEED + halves.chunks)
            halves.add(session.samples(frame))
        halves.save(path)
        going = on_chunk(halves.chunks, halves.difference())


def chunk_quality(quality: Quality, *, depth: int, cap: float) -> Quality:
    """Return how chunks are rendered: independent samples, capped beside the uncapped.

    Args:
        quality: A preset.
        depth: Longest light path.
        cap: Firefly cap per sample, x white.
    """
    return quality.model_copy(
        update={
            "spp": CHUNK,
            "pass_spp": CHUNK,
            "max_depth": depth,
            "sampler": "independent",
            "cap": cap,
            "denoise": "none",
        }
    )


def finished(session: Session, frame: FrameState, halves: Halves) -> Reference:
    """Return the reference as it stands, with haze as the scene has it.

    Args:
        session: The scene in the renderer.
        frame: What was rendered.
        halves: Of its samples.
    """

    def picture(*chosen: int) -> Image:
        means = {name: halves.mean(name, chosen) for name in LAYERS}
        plain = means["capped"] + means["lost"]
        return session.hazed(Layers({**means, "radiance": plain}), frame.view)

    return Reference(
        radiance=picture(0, 1),
        capped=halves.mean("capped"),
        sky=halves.mean("hit") < 1.0,
        spp=CHUNK * halves.chunks,
        halves_rmse=halves.difference(),
        halves=(picture(0), picture(1)),
    )
