"""Compares what a film needs with the memory and the disk that there are."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.pipeline.doctor import physical_memory
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.progress.costs import (
    TYPICAL_TRIANGLES,
    Cost,
    memory_forecast,
    space_in_words,
)

_HOPELESS = 1.5
"""A film that needs so many times the memory of this machine is not begun: forecasts may be off."""


def lacking(cost: Cost, path: Path) -> Iterator[str]:
    """Yield a sentence for each of memory and disk of which there is too little.

    Args:
        cost: Of the film.
        path: Where it will lie.
    """
    memory, disk = physical_memory() / 1e6, _free_disk(path)
    if memory and cost.memory_mb > memory:
        yield (
            f"needs about {space_in_words(cost.memory_mb)} of memory, and this machine has"
            f" {space_in_words(memory)}: ask for a smaller --size"
        )
    stored = cost.frames_mb + cost.film_mb
    if disk < stored:
        yield (
            f"needs about {space_in_words(stored)} of disk, and {space_in_words(disk)} are free"
            f" where {path.name} will lie: take another folder, or --discard-frames"
        )


def check_memory(job: Job, request: Request) -> None:
    """Refuse pictures that need far more memory than there is, before any work is done.

    Args:
        job: The scene file.
        request: The command's choices.

    Raises:
        ConfigError: If they do.
    """
    width, height = request.applied(job).output.size
    needed, memory = memory_forecast(width * height / 1e6, TYPICAL_TRIANGLES), physical_memory()
    if memory and needed > _HOPELESS * memory / 1e6:
        raise ConfigError(
            f"pictures of {width}x{height} need about {space_in_words(needed)} of memory, and this"
            f" machine has {space_in_words(memory / 1e6)}; ask for a smaller --size",
            key="output.size",
        )


def _free_disk(path: Path) -> float:
    """Return what is free where a file will lie [MB]."""
    whole = path.absolute()
    there = next(place for place in (whole, *whole.parents) if place.exists())
    return shutil.disk_usage(there).free / 1e6
