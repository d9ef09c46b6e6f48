"""What a convergence report measures, against which reference, by which scores.

It measures rungs of a ladder of spp, presets and path depths. A picture's scores are all error
measures against the reference.

The reference grows until its own error no longer matters. Chunks with seeds of their own go to two
halves in turn. The halves against each other say how far the reference itself is from the truth,
without knowing the truth: by capped RMSE, their difference is twice the error of their mean. The
sampler is the independent one and the seeds are others than those of the pictures that are judged.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.files.atomic import atomic_path
from sumo3dviz_pt.image import metrics
from sumo3dviz_pt.image.metrics import capped_rmse
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.report.convergence.table import DEPTH, LADDER, TableRow

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
        with atomic_path(path) as part, part.open("wb") as stream:
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


CAP = 4.0
"""Cap of the capped RMSE, x white: brighter samples all look white."""

TRIM = 0.001
"""Share of the worst pixels that the trimmed relative MSE leaves out."""


@dataclass(frozen=True, slots=True)
class PictureLook:
    """How radiance becomes a picture.

    Attributes:
        exposure: Factor 2^exposure before the curve [EV].
        tone: Tone curve's name.
    """

    exposure: float
    tone: str

    @property
    def white(self) -> float:
        """Radiance that is shown as white, scene units."""
        return float(2.0**-self.exposure)

    def develop(self, radiance: Image) -> Image:
        """Return the display-encoded picture, (h, w, 3) in [0, 1]."""
        return develop_float(radiance, exposure=self.exposure, tone=self.tone)


def score(
    radiance: Image,
    reference: Reference,
    look: PictureLook,
    *,
    capped: Image | None = None,
    exposures: bool = True,
) -> dict[str, float]:
    """Return the errors of a picture by column of the report.

    Args:
        radiance: The picture, with haze, (h, w, 3).
        reference: The truth.
        look: Exposure and tone curve.
        capped: Mean of samples capped one by one at `CAP` x white, without haze; its
            error falls by 1/2 per log(spp). None, as for denoised pictures, cuts the
            pictures instead.
        exposures: Whether HDR-FLIP is worth its time, ten times that of all others.
    """
    truth, limit = reference.radiance, CAP * look.white
    shown, wanted = look.develop(radiance), look.develop(truth)
    errors = metrics.flip_map(shown, wanted)
    pair = (radiance, truth) if capped is None else (capped, reference.capped)
    # Radiance relative to white, so that errors of dim and bright scenes can be compared.
    relative, relative_truth = radiance / look.white, truth / look.white
    # Brighter than this is nothing but an emitter, or its image in glass and chrome.
    emitters = reference.sky | (relative_truth.max(axis=-1) > CAP)
    return {
        "rmse_capped": metrics.capped_rmse(*pair, cap=limit) / look.white,
        "relmse": metrics.relative_mse(relative, relative_truth),
        "relmse_trim": metrics.relative_mse(relative, relative_truth, trim=TRIM),
        "psnr": metrics.psnr(shown, wanted),
        "ssim": metrics.ssim(shown, wanted),
        "flip": float(errors.mean()),
        "flip_p99": float(np.percentile(errors, 99)),
        "hdrflip": metrics.hdr_flip(radiance, truth) if exposures else float("nan"),
        "mean_bias": metrics.mean_bias(radiance, truth, exempt=emitters),
    }


SEEDS = 5
"""Repetitions of every rung and preset."""

DEEPEST = 16
"""Path depth of reference and ladder; the presets' own depths are judged against it."""

DEPTHS = (2, 3, 4, 6, 8, 12, DEEPEST)

DEPTH_SPP = 16
"""Samples of the pictures whose depth varies; their seeds are equal, so that they share noise."""

HIGHEST_RUNG = 64
"""Highest spp that is judged without a budget."""

LONGEST_PASS = 64

FILM_SEEDS = 2
"""Repetitions of a preset whose frames help each other: each renders a whole window of frames."""

STILL = "still"
"""Ends the label of a preset's picture that no others help."""

DENOISERS = ("fast", "high")
"""With noisy guides `balanced` is the same network as `high`."""


@dataclass(frozen=True, slots=True)
class SeedGroup:
    """Pictures that differ in their seed only: stills, or frames that their neighbours help.

    Attributes:
        label: What the column `preset` says.
        quality: How to render.
        denoisers: What each picture is finished with; one row each.
        seeds: How many pictures.
        plain: Whether what the cap took is given back: an unbiased picture.
    """

    label: str
    quality: Quality
    denoisers: tuple[str, ...]
    seeds: int = SEEDS
    plain: bool = False

    @property
    def rows(self) -> int:
        """Rows that it makes."""
        return self.seeds * len(self.denoisers)

    @property
    def samples(self) -> int:
        """Samples per pixel of all its pictures, and of the frames that help them."""
        return self.seeds * self.quality.spp * (1 + 2 * self.quality.accumulate)

    def owns(self, row: TableRow) -> bool:
        """Return whether a row of a file is one of its own."""
        quality = self.quality
        return (
            row["preset"] == self.label
            and row["sampler"] == quality.sampler
            and row["spp"] == quality.spp
            and row["max_depth"] == quality.max_depth
            and (row["denoise"] == "none") == (self.denoisers == ("none",))
        )


def rungs(top: int) -> tuple[int, ...]:
    """Return 1, 2, 4, ... up to `top`."""
    return tuple(2**power for power in range(top.bit_length()) if 2**power <= top)


def presets_up_to(top: int, *, together: bool = True, weather: bool = False) -> dict[str, Quality]:
    """Return the presets that a ladder up to `top` spp can judge, cheapest first.

    Args:
        top: Samples per pixel.
        together: Whether frames can help each other.
        weather: Whether the scene has weather, which only our own kernel traces.
    """
    names = catalog.template_names("quality")
    known = {name: quality_preset(name, together=together) for name in names}
    fitting = {
        name: quality
        for name, quality in known.items()
        if quality.spp <= top and (quality.tracer == "kernel" or not weather)
    }
    return dict(sorted(fitting.items(), key=lambda item: item[1].spp))


def groups(top: int, *, together: bool = True, weather: bool = False) -> list[SeedGroup]:
    """Return everything to measure; presets, which matter most to users, come first.

    Args:
        top: Highest rung.
        together: Whether frames can help each other; then presets are measured as films and as
            stills.
        weather: As in `presets_up_to`.
    """
    known = presets_up_to(top, together=together, weather=weather)
    presets = [group for name, quality in known.items() for group in _as_used(name, quality, top)]
    ladder = [group for spp in rungs(top) for group in (*_raw(spp), _denoised(spp))]
    depths = [_deep(depth, spp=min(DEPTH_SPP, top)) for depth in DEPTHS]
    return [*presets, *ladder, *depths]


def _as_used(name: str, quality: Quality, top: int) -> list[SeedGroup]:
    """Return a preset's frame of a film, and its still if that is another picture."""
    if not quality.accumulate:
        return [SeedGroup(name, quality, (quality.denoise,))]
    still = quality.by_itself
    used = [SeedGroup(name, quality, (quality.denoise,), seeds=FILM_SEEDS)]
    if still.spp <= top:
        used.append(SeedGroup(f"{name} {STILL}", still, (quality.denoise,)))
    return used


def digest(wanted: list[SeedGroup]) -> str:
    """Return a hash of what is measured: another preset makes another report."""
    content = [(g.label, g.quality.model_dump(mode="json"), g.denoisers, g.seeds) for g in wanted]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def base_quality(spp: int) -> Quality:
    """Return a rung's quality, all else as in reference and presets."""
    return Quality(
        spp=spp, pass_spp=min(spp, LONGEST_PASS), max_depth=DEEPEST, denoise="none", cap=CAP
    )


def _raw(spp: int) -> tuple[SeedGroup, SeedGroup]:
    """Return a rung of plain path tracing, by sampler."""
    independent = base_quality(spp).model_copy(update={"sampler": "independent"})
    return (
        SeedGroup(LADDER, independent, ("none",), plain=True),
        SeedGroup(LADDER, base_quality(spp), ("none",), plain=True),
    )


def _denoised(spp: int) -> SeedGroup:
    """Return a rung as users get it with `--spp`: capped and denoised."""
    quality = base_quality(spp).model_copy(update={"denoise": "high", "cap": 40.0})
    return SeedGroup(LADDER, quality, DENOISERS)


def _deep(depth: int, *, spp: int) -> SeedGroup:
    """Return pictures of one path depth."""
    quality = base_quality(spp).model_copy(update={"max_depth": depth})
    return SeedGroup(DEPTH, quality, ("none",), plain=True)
