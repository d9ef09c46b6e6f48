"""What single values of a scene file may be: numbers with units, ranges, dates, colours, files.

The base of all settings is here, too. Quantities have units, as people write them: `200 m`,
`10 mm/h`, `3 cm`. Mitsuba's variants go by the names that users choose; importing them loads
nothing.
"""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.model.numbers import (
    ANGLE,
    COORDINATE,
    HEIGHT,
    SECONDS,
    SOLAR,
    Ratio,
    in_short,
    ratio_of,
    zone_named,
)

MOST_TEXT = 1000
"""Most characters that a word, an id or a path may have."""

_COLOUR = re.compile(r"#[0-9a-fA-F]{6}")


class Settings(BaseModel):
    """Base of all settings: unknown keys are errors, and values do not change."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, populate_by_name=True, str_max_length=MOST_TEXT
    )


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """Return all models inside a type, or inside a tuple of types."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    parts = annotation if isinstance(annotation, tuple) else get_args(annotation)
    return [model for part in parts for model in models_in(part)]


def mode_of(model: type[BaseModel]) -> str | None:
    """Return the word of the key `mode` that chooses a model out of a union."""
    field = model.model_fields.get("mode")
    words = get_args(field.annotation) if field is not None else ()
    return words[0] if words else None


def _listed(value: Any) -> Any:
    """Let a single word stand for a list of one."""
    return value if isinstance(value, list | tuple) or value is None else [value]


ONE_OR_MORE = BeforeValidator(_listed)
"""Marks lists whose single entry may stand without brackets."""


def all_models(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """Yield a model and all that its fields lead to; a model may come again."""
    yield model
    for field in model.model_fields.values():
        for inner in models_in(field.annotation):
            yield from all_models(inner)


def _colour(text: str) -> str:
    """Refuse what is no colour."""
    if not _COLOUR.fullmatch(text):
        raise ValueError(f"a colour is written #rrggbb, not {text!r}")
    return text


HexColour = Annotated[str, AfterValidator(_colour)]
"""A colour as `#rrggbb`, sRGB."""


def _zone(name: str) -> str:
    """Refuse what is no time zone."""
    if name != SOLAR:
        zone_named(name)
    return name


Zone = Annotated[str, AfterValidator(_zone)]
"""A time zone, or `solar`."""


def _within(low: Fraction, high: Fraction) -> Callable[[Any], Fraction]:
    """Return a check of ratios between two bounds."""

    def checked(value: Any) -> Fraction:
        ratio = ratio_of(value)
        if not low <= ratio <= high:
            bounds = f"{in_short(low)} to {in_short(high)}"
            raise ValueError(f"this should lie in {bounds}, not {in_short(ratio)}")
        return ratio

    return checked


def _schema(low: Fraction, high: Fraction) -> WithJsonSchema:
    """Return how a ratio is written."""
    number = {"type": "number", "minimum": float(low), "maximum": float(high)}
    return WithJsonSchema({"anyOf": [number, {"type": "string", "pattern": r"^[\d./ ]+$"}]})


_RATES = (Fraction(1, 100), Fraction(240))
_SPEEDS = (Fraction(1, 100), Fraction(100))
_SHORT = PlainSerializer(in_short, return_type=int | float | str)

Rate = Annotated[Fraction, PlainValidator(_within(*_RATES)), _SHORT, _schema(*_RATES)]
"""Frames per second."""

Speed = Annotated[Fraction, PlainValidator(_within(*_SPEEDS)), _SHORT, _schema(*_SPEEDS)]
"""SUMO's seconds per second of film."""


AskedRatio = Annotated[Ratio, PlainValidator(ratio_of)]
"""A ratio as a command or a program gives it; pydantic's own check of fractions falls over some."""


def asked_rate(value: Ratio) -> Fraction:
    """Return a frame rate that a command or a program asks for.

    Raises:
        ConfigError: If it is none.
    """
    return _asked(value, _RATES, "fps")


def asked_speed(value: Ratio) -> Fraction:
    """Return a speed that a command or a program asks for.

    Raises:
        ConfigError: If it is none.
    """
    return _asked(value, _SPEEDS, "speed")


def _asked(value: Ratio, bounds: tuple[Fraction, Fraction], key: str) -> Fraction:
    """Return a ratio within bounds."""
    try:
        return _within(*bounds)(value)
    except ValueError as error:
        raise ConfigError(str(error), key=key) from None


class OwnLook(Settings):
    """What single road users look like."""

    model: str | None = Field(None, description="a name from `assets/vehicles` or `assets/people`")
    colour: HexColour | None = Field(None, description="#rrggbb of its paint or coat")

    @model_validator(mode="after")
    def _says_something(self) -> OwnLook:
        """Ask for one of both at least."""
        if self.model is None and self.colour is None:
            raise ValueError("give model, colour, or both")
        return self


_UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        # what values are in    how else they may be written
        "m": {"m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001},
        "m/s": {"m/s": 1.0, "km/h": 1.0 / 3.6},
        "mm/h": {"mm/h": 1.0, "cm/h": 10.0},
        "s": {"s": 1.0, "ms": 0.001, "min": 60.0},
    }
)

_WRITTEN = re.compile(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([a-z/]+)")


class Quantity:
    """Marks a number with a unit: text such as `200 m`, or a plain number in the first unit.

    Attributes:
        unit: What values are in inside.
        low, high: Bounds, in that unit.
    """

    def __init__(self, unit: str, low: float, high: float) -> None:
        self.unit, self.low, self.high = unit, low, high

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return how values are read."""
        return PlainValidator(self._read).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        """Return how values are written."""
        number = {"type": "number", "minimum": self.low, "maximum": self.high}
        text = {"type": "string", "pattern": rf"^[-+0-9.eE]+ ?({'|'.join(_UNITS[self.unit])})$"}
        written = WithJsonSchema({"anyOf": [number, text]})
        return written.__get_pydantic_json_schema__(schema, handler)

    def _read(self, value: Any) -> float:
        """Return a value in the unit, within bounds."""
        number = self._number(value)
        if not self.low <= number <= self.high:
            bounds = f"{self.low:g} to {self.high:g} {self.unit}"
            raise ValueError(f"this should lie in {bounds}, not {number:g} {self.unit}")
        return number

    def _number(self, value: Any) -> float:
        """Return a value in the unit."""
        if isinstance(value, int | float) and not isinstance(value, bool):
            if math.isfinite(value):
                return float(value)
        elif isinstance(value, str):
            written = _WRITTEN.fullmatch(value.strip())
            factor = _UNITS[self.unit].get(written[2]) if written else None
            if written and factor is not None:
                try:
                    return float(written[1]) * factor
                except ValueError:
                    factor = None
        units = ", ".join(_UNITS[self.unit])
        raise ValueError(f"this should be a number with one of the units {units}, not {value!r}")


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
    date: dt.date | None
    if isinstance(value, dt.date):
        date = dt.date(value.year, value.month, value.day)
    else:
        match = _DATE.fullmatch(value) if isinstance(value, str) else None
        try:
            date = dt.date(*map(int, match.groups())) if match else None
        except ValueError:
            date = None
    if date is None:
        raise ValueError(f"a date is written like 2026-06-21, not {value!r}")
    if not _YEARS[0] <= date.year < _YEARS[1]:
        raise ValueError(f"the year must lie from {_YEARS[0]} to {_YEARS[1] - 1}")
    return date


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


VARIANTS: Mapping[str, str] = MappingProxyType(
    {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb", "scalar": "scalar_rgb"}
)

VARIANT = "llvm"
"""The variant that is used unless another is chosen."""


def check_variant(name: str) -> None:
    """Refuse a name that no variant has.

    Raises:
        ConfigError: Suggests one.
    """
    if name not in VARIANTS:
        from sumo3dviz_pt.catalog import did_you_mean

        raise ConfigError(
            f"no variant is called {name!r}{did_you_mean(name, VARIANTS)}", key="variant"
        )
