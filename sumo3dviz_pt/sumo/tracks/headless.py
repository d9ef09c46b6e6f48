"""Knows the first text files of NGSIM, which have no line that names their columns.

References:
    The data dictionaries of NGSIM: 18 columns of US-101 and I-80; Lankershim and Peachtree have
    six more, which tell origin and destination, after the lane.
"""

from __future__ import annotations

from collections.abc import Sequence

from sumo3dviz_pt.sumo.values import is_plain

_FIRST = (
    *("Vehicle_ID", "Frame_ID", "Total_Frames", "Global_Time", "Local_X", "Local_Y"),
    *("Global_X", "Global_Y", "v_Length", "v_Width", "v_Class", "v_Vel", "v_Acc", "Lane_ID"),
)
_IN_TOWNS = ("O_Zone", "D_Zone", "Int_ID", "Section_ID", "Direction", "Movement")
_LAST = ("Preceding", "Following", "Space_Headway", "Time_Headway")
_FORMS = {len(names): names for names in ((*_FIRST, *_LAST), (*_FIRST, *_IN_TOWNS, *_LAST))}

_WHOLE = ("Vehicle_ID", "Frame_ID", "Total_Frames", "Global_Time", "v_Class")
_EPOCH = 1e11
"""Smallest Global_Time [ms]; 1e11 is in 1973."""

_LONGEST = 200.0
"""Largest length of a vehicle [ft]."""

_ROWS = 50  # that are looked at


def names_without_header(lines: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the columns of a text of NGSIM; nothing for any other text.

    Args:
        lines: The first ones, whole.
    """
    rows = [line.split() for line in lines[:_ROWS] if line.strip()]
    names = _FORMS.get(len(rows[0]), ()) if rows else ()
    return names if names and all(_fits(row, names) for row in rows) else ()


def _fits(row: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a row's numbers are such as NGSIM has in these columns."""
    if len(row) != len(names) or not is_plain("".join(row)):
        return False
    try:
        of = dict(zip(names, map(float, row), strict=True))
    except ValueError:
        return False
    whole = all(of[name].is_integer() and of[name] >= 0 for name in _WHOLE)
    sized = 0.0 < of["v_Width"] < _LONGEST and 0.0 < of["v_Length"] < _LONGEST
    return whole and sized and 1 <= of["v_Class"] <= 3 and of["Global_Time"] > _EPOCH
