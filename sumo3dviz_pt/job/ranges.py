"""What single values of a scene file may be: ranges, dates, colours, files."""

from __future__ import annotations

import datetime as dt
import math
import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.job.values import MOST_TEXT, ONE_OR_MORE, HexColour
from sumo3dviz_pt.model.bounds import ANGLE, COORDINATE, HEIGHT, SECONDS

MOST_ENTRIES = 10_000
"""Most entries that a list or a mapping may have."""

WIDEST = 16_384
"""Largest width and height of a picture [px]."""

LONGEST_PART = 60
"""Most characters of a name that becomes part of a file's name."""

_NOT_IN_FILES = frozenset('/\\:*?"<>|')
_RESERVED = re.compile(r"(?i)(?:con|prn|aux|nul|com\d|lpt\d)(?:\..*)?")
_LONGEST_NAME = 255  # bytes of a file's name, on all usual file systems
_DATE = re.compile(r"(\d{4})-(\d\d)-(\d\d)")
_TIME = re.compile(r"(\d{1,2}):(\d\d)(?::(\d\d))?")
_YEARS = (1900, 2100)  # in which the formula of the sun's place holds


# Numbers -----------------------------------------------------------------------------------


def _number(value: Any) -> Any:
    """Refuse true, false, infinity and NaN, which are no numbers here."""
    if isinstance(value, bool):
        raise ValueError(f"this should be a number, not {str(value).lower()}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"this should be a finite number, not {value}")
    return value


Finite = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
Whole = Annotated[int, BeforeValidator(_number)]
Seed = Annotated[Whole, Field(ge=0, le=2**31 - 1)]
Metres = Annotated[Finite, Field(ge=COORDINATE.low, le=COORDINATE.high)]
Up = Annotated[Finite, Field(ge=HEIGHT.low, le=HEIGHT.high)]
Point = tuple[Metres, Metres, Up]
Seconds = Annotated[Finite, Field(ge=SECONDS.low, le=SECONDS.high)]
Turn = Annotated[Finite, Field(ge=ANGLE.low, le=ANGLE.high)]
Latitude = Annotated[Finite, Field(ge=-90, le=90)]
Longitude = Annotated[Finite, Field(ge=-180, le=180)]


def _pixels(size: tuple[int, int]) -> tuple[int, int]:
    """Refuse pictures without pixels, or with too many."""
    if not all(1 <= side <= WIDEST for side in size):
        raise ValueError(f"must lie in 1..{WIDEST}, not {size[0]}x{size[1]}")
    return size


Size = Annotated[tuple[Whole, Whole], AfterValidator(_pixels)]


# Dates, colours, names ---------------------------------------------------------------------


def _date(value: Any) -> Any:
    """Return a date as people write it in all countries; plain numbers are none."""
    found: dt.date | None
    if isinstance(value, dt.date):
        found = dt.date(value.year, value.month, value.day)
    else:
        match = _DATE.fullmatch(value) if isinstance(value, str) else None
        try:
            found = dt.date(*map(int, match.groups())) if match else None
        except ValueError:
            found = None
    if found is None:
        raise ValueError(f"a date is written like 2026-06-21, not {value!r}")
    if not _YEARS[0] <= found.year < _YEARS[1]:
        raise ValueError(f"the year must lie from {_YEARS[0]} to {_YEARS[1] - 1}")
    return found


def _time(value: Any) -> Any:
    """Return a time of day; plain numbers are none."""
    if isinstance(value, dt.time):
        return value.replace(tzinfo=None)
    match = _TIME.fullmatch(value) if isinstance(value, str) else None
    try:
        hour, minute, second = (
            (int(part or 0) for part in match.groups()) if match else _no_time(value)
        )
        return dt.time(hour, minute, second)
    except ValueError:
        return _no_time(value)


def _no_time(value: Any) -> Any:
    raise ValueError(f'a time is written like "17:30", not {value!r}')


Date = Annotated[dt.date, BeforeValidator(_date)]
TimeOfDay = Annotated[dt.time, BeforeValidator(_time)]


Colours = Annotated[tuple[HexColour, ...], Field(max_length=MOST_ENTRIES)]
Names = Annotated[tuple[str, ...], Field(max_length=MOST_ENTRIES)]
OneOrMoreNames = Annotated[Names, ONE_OR_MORE]


def _file_part(name: str) -> str:
    """Refuse a name that could not be part of a file's name on every system."""
    if not 1 <= len(name) <= LONGEST_PART or name != name.strip():
        raise ValueError(
            f"a name has 1 to {LONGEST_PART} characters and no blanks at its ends, for films are"
            f" called by it; shorten {cut(name)!r}"
        )
    odd = next((char for char in name if not char.isprintable() or char in _NOT_IN_FILES), None)
    if odd is not None:
        raise ValueError(f"no name holds {odd!r}, for films are called by it; rename {name!r}")
    if _RESERVED.fullmatch(name):
        raise ValueError(f"Windows keeps the name {name!r} for a device; choose another")
    return name


FilePart = Annotated[str, AfterValidator(_file_part)]
"""A name that becomes part of a file's name."""


# Files -------------------------------------------------------------------------------------


def _from_scene_file(path: Path, info: ValidationInfo) -> Path:
    """Read relative paths from the scene file's folder."""
    folder = (info.context or {}).get("folder", Path())
    return path if path.is_absolute() else Path(folder) / path


def _openable(path: Path) -> Path:
    """Refuse paths that no system could open."""
    parts = [part.encode("utf-8", errors="replace") for part in path.parts]
    if b"\0" in b"".join(parts) or sum(map(len, parts)) > 4 * MOST_TEXT:
        raise ValueError("this is no name of a file")
    if max(map(len, parts), default=0) > _LONGEST_NAME:
        raise ValueError(f"a file's name has at most {_LONGEST_NAME} bytes")
    return path


def _named(path: Path) -> Path:
    """Refuse a path without a name: a file that is to be written needs one."""
    if not path.name:
        raise ValueError(f"this should be a file's name, not {str(path)!r}")
    return path


Target = Annotated[Path, AfterValidator(_openable), AfterValidator(_named)]
File = Annotated[Path, AfterValidator(_openable), AfterValidator(_from_scene_file)]
Files = Annotated[tuple[File, ...], Field(max_length=MOST_ENTRIES)]
OneOrMoreFiles = Annotated[Files, ONE_OR_MORE]


def _surface(name: str, info: ValidationInfo) -> str:
    """Read image files, too, from the scene file's folder."""
    return str(_from_scene_file(_openable(Path(name)), info)) if Path(name).suffix else name


Surface = Annotated[str, AfterValidator(_surface)]
