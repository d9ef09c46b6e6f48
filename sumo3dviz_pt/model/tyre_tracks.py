"""Where wheels have passed: what the log says of tracks in snow."""

from __future__ import annotations

from dataclasses import dataclass

from sumo3dviz_pt.model.geometry import Floats, frozen


@dataclass(frozen=True, slots=True, eq=False)
class TyreTracks:
    """Paths of wheels on the ground.

    Attributes:
        begins: Where a straight piece begins, (n, 2) [m].
        ends: Where it ends, (n, 2) [m].
    """

    begins: Floats
    ends: Floats

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("begins", "ends"):
            object.__setattr__(self, name, frozen(getattr(self, name)).reshape(-1, 2))
        if len(self.begins) != len(self.ends):
            raise ValueError(f"{len(self.begins)} begins for {len(self.ends)} ends of tracks")
