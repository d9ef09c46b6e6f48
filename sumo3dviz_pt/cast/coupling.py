"""How many units of a kind make a train, a tram or a ship of a length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_PARAMETERS = ("locomotiveLength", "carriageLength", "carriageGap")
_GAP = 1.0
"""SUMO's default between carriages [m]."""

CouplingRow = Mapping[str, Any]
"""A unit as `asset.yaml` lists it: `model`, `at`, and `repeat` with `pitch`; where the vehicle
bends, `pivots` and `bellows`, see `cast/fitted_models.py`."""


@dataclass(frozen=True, slots=True)
class Carriages:
    """What a vType says of its train (SUMO's parameters of the same names).

    Attributes:
        locomotive: Length of the first unit [m], > 0.
        carriage: Length of the others [m], > 0.
        gap: Between units [m].
    """

    locomotive: float
    carriage: float
    gap: float

    @classmethod
    def of(cls, params: Mapping[str, str]) -> Carriages | None:
        """Read the parameters; None where they give no length."""
        first, other, gap = (_length(params.get(name)) for name in _PARAMETERS)
        known = first or other
        if not known:
            return None
        return cls(first or known, other or known, _GAP if gap is None else gap)

    def split(self, length: float) -> tuple[tuple[float, float], ...]:
        """Return units of a train of a length [m], as SUMO's own drawing splits it.

        Returns:
            Distance of each unit's front behind the train's front, and its length [m].
        """
        pitch = self.carriage + self.gap
        more = max(0, int((length - self.locomotive) / pitch + 0.5))
        if more == 0:
            return ((0.0, length),)
        # Whole carriages share what is left, so that the train is as long as it says.
        pitch = (length - self.locomotive) / more
        own = max(pitch - self.gap, 0.5 * pitch)
        rest = [(self.locomotive + (k + 1) * pitch - own, own) for k in range(more)]
        return ((0.0, self.locomotive), *rest)


def _length(text: str | None) -> float | None:
    """A length [m], or None where there is none or it says nothing."""
    try:
        value = float(text) if text else -1.0
    except ValueError:
        return None
    return value if 0.0 <= value < 1e4 else None


def pitch_of(rows: Sequence[CouplingRow]) -> float:
    """Return what one more of the repeated units adds [m]; 0 where none are repeated."""
    return sum(float(row["pitch"]) for row in rows if row.get("repeat"))


def spare_units(length: float, pitch: float, *, wanted: float) -> int:
    """Return how many repeated units a vehicle has beyond those that the asset lists.

    Args:
        length: Of the asset as it is listed [m].
        pitch: What one more adds [m]; 0 where none are repeated.
        wanted: Length to fill [m].

    Returns:
        The number that takes the least stretching; -1 leaves out those that are listed.
    """
    if not pitch:
        return 0
    near = int((wanted - length) // pitch)
    return min(
        (max(-1, near), max(-1, near + 1)),
        key=lambda more: max(wanted / (length + more * pitch), (length + more * pitch) / wanted),
    )


def coupled(rows: Sequence[CouplingRow], more: int) -> list[tuple[CouplingRow, float]]:
    """Return units of a whole and where their fronts are, from front to rear.

    Args:
        rows: As the asset lists them; the repeated ones follow one another.
        more: From `spare_units`.

    Returns:
        Each unit's row and x of its front in the whole's frame [m].
    """
    again = [row for row in rows if row.get("repeat")]
    if not again:
        return [(row, float(row["at"])) for row in rows]
    pitch = pitch_of(rows)
    first = rows.index(again[0])
    tail = [row for row in rows[first:] if not row.get("repeat")]
    copies = [(row, k * pitch) for k in range(more + 1) for row in again]
    placed = [(row, 0.0) for row in rows[:first]] + copies + [(row, more * pitch) for row in tail]
    return [(row, float(row["at"]) - back) for row, back in placed]


def numbered(rows: Sequence[CouplingRow], count: int) -> list[CouplingRow]:
    """Return the rows of a train of some units: its first, its last, and repeated ones between."""
    again = [row for row in rows if row.get("repeat")] or list(rows[-1:])
    tail = [row for row in rows[rows.index(again[0]) :] if not row.get("repeat")][: count - 1]
    between = [again[k % len(again)] for k in range(count - 1 - len(tail))]
    return [rows[0], *between, *tail]
