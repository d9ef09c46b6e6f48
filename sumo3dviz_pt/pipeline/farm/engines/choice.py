"""What engines can be told."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.asked import settle
from sumo3dviz_pt.job.ranges import Whole

_ONE_WORD = re.compile(r"[^\s\x00-\x1f\"'`$\\]{1,200}")
"""What may stand in a line of a batch script."""

Workers = Annotated[Whole, Field(ge=1, le=100_000)]


@dataclass(frozen=True, slots=True)
class EngineChoice:
    """An engine, and what it is told.

    Attributes:
        name: A key of `ENGINES`.
        workers: How many work at once; None is the engine's own choice.
        threads: Of each worker; None is all of its machine's.
        scheduler: Of a Dask cluster: an address, or a scheduler file.
        partition: Slurm's.
        account: Slurm's.
        time: Slurm's limit for each job, such as 2:00:00.
        memory: Slurm's, such as 6G.
        detach: Whether Slurm's jobs are submitted and not followed.
    """

    name: str = "local"
    workers: Workers | None = None
    threads: Workers | None = None
    scheduler: str | None = None
    partition: str | None = None
    account: str | None = None
    time: str | None = None
    memory: str | None = None
    detach: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)
        for key in ("scheduler", "partition", "account", "time", "memory"):
            value = getattr(self, key)
            if value is not None and not _ONE_WORD.fullmatch(value):
                raise ConfigError(f"this should be one word, not {value!r}", key=key)
