"""What models of the scene file are built from: their base, and values with a notation."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Annotated, Any, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    WithJsonSchema,
    model_validator,
)

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.ratios import Ratio, in_short, ratio_of
from sumo3dviz_pt.model.zones import SOLAR, zone_named

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
        found = ratio_of(value)
        if not low <= found <= high:
            bounds = f"{in_short(low)} to {in_short(high)}"
            raise ValueError(f"this should lie in {bounds}, not {in_short(found)}")
        return found

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
