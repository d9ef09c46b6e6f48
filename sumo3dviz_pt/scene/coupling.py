"""How many units of a kind make a train, a tram or a ship of a length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]
"""A unit as `asset.yaml` lists it: `model`, `at`, and `repeat` with `pitch`."""


def pitch_of(rows: Sequence[Row]) -> float:
    """What one more of the repeated units adds [m]; 0 where none are repeated."""
    return sum(float(row["pitch"]) for row in rows if row.get("repeat"))


def spare_units(length: float, pitch: float, *, wanted: float) -> int:
    """How many more of the repeated units there are to be than the asset lists.

    Args:
        length: Of the asset as it is listed [m].
        pitch: What one more adds [m]; 0 where none are repeated.
        wanted: Length to fill [m].

    Returns:
        The number that needs the least stretching; -1 leaves out those that are listed.
    """
    if not pitch:
        return 0
    near = int((wanted - length) // pitch)
    return min(
        (max(-1, near), max(-1, near + 1)),
        key=lambda more: max(wanted / (length + more * pitch), (length + more * pitch) / wanted),
    )


def coupled(rows: Sequence[Row], more: int) -> list[tuple[str, float]]:
    """Models of a whole and where their fronts are, from front to rear.

    Args:
        rows: As the asset lists them; the repeated ones follow one another.
        more: From `spare_units`.

    Returns:
        Name of the model and x of its front in the whole's frame [m].
    """
    again = [row for row in rows if row.get("repeat")]
    if not again:
        return [(str(row["model"]), float(row["at"])) for row in rows]
    pitch = pitch_of(rows)
    first = rows.index(again[0])
    tail = [row for row in rows[first:] if not row.get("repeat")]
    copies = [(row, k * pitch) for k in range(more + 1) for row in again]
    placed = [(row, 0.0) for row in rows[:first]] + copies + [(row, more * pitch) for row in tail]
    return [(str(row["model"]), float(row["at"]) - back) for row, back in placed]
