"""What `record` is asked to keep."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class RecordOrder:
    """What `record` is to keep.

    Attributes:
        folder: Where it goes.
        start: First time that a film may show [s]; None is the simulation's.
        end: Last time that a film may show [s]; None is the simulation's.
        around: East, north and radius of the place to keep [m]; None is everywhere.
        follow: Id of a vehicle around which is kept; None is everywhere.
        radius: How far around the one that is followed [m].
        seed: SUMO's, instead of the configuration's.
        overwrite: Whether a recording that is there is replaced.
    """

    folder: Path
    start: float | None = None
    end: float | None = None
    around: tuple[float, float, float] | None = None
    follow: str | None = None
    radius: float = 300.0
    seed: int | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no choice.

        Raises:
            ConfigError: If the window ends before it begins, or a radius is none.
        """
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise ConfigError(
                f"--to ({self.end:.12g}) must be later than --from ({self.start:.12g})"
            )
        if self.around is not None and self.follow is not None:
            raise ConfigError("give either --around or --follow")
        radius = self.radius if self.around is None else self.around[2]
        if not 0.0 < radius < math.inf:
            raise ConfigError(f"a radius must be above 0 m, not {radius:g}")
