"""Lists what a report measures: rungs of a ladder of spp, presets, path depths."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.report.convergence.scores import CAP
from sumo3dviz_pt.report.convergence.table import DEPTH, LADDER, TableRow

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
    found = [SeedGroup(name, quality, (quality.denoise,), seeds=FILM_SEEDS)]
    if still.spp <= top:
        found.append(SeedGroup(f"{name} {STILL}", still, (quality.denoise,)))
    return found


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
