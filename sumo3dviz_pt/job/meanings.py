"""What settings say about themselves, for `--help` and the manual.

A setting's meaning, unit, range and default stand once, in its `Field`; here they are read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from sumo3dviz_pt.job.settings import Job, Quality
from sumo3dviz_pt.job.values import models_in

_KINDS = ("gt", "ge", "lt", "le")

_VAST = 1e6
"""Ranges that reach this far only keep out nonsense; `--help` leaves them out."""


@dataclass(frozen=True, slots=True)
class Bound:
    """One end of a range.

    Attributes:
        kind: `gt`, `ge`, `lt` or `le`, as pydantic calls them.
        value: The end itself.
    """

    kind: str
    value: float


def meaning(key: str) -> str:
    """Return a setting's meaning and range, such as `samples per pixel; 1 to 65536`.

    Args:
        key: Dotted, as `output.fps`; `quality.spp` is a key of quality presets.
    """
    field = _field_of(key)
    ends = {bound.kind: bound.value for bound in bounds(field.annotation, field.metadata)}
    text = field.description or ""
    if {"ge", "le"} <= ends.keys() and ends["le"] < _VAST:
        text += f"; {ends['ge']:g} to {ends['le']:g}"
    return text


def default(key: str) -> Any:
    """Return a setting's default, by its dotted key."""
    return _field_of(key).get_default(call_default_factory=True)


def bounds(annotation: Any, metadata: Sequence[Any]) -> list[Bound]:
    """Return the ends of a field's range, each once; of lists and unions those of all parts.

    Args:
        annotation: The field's type.
        metadata: What stands beside the type, as in `FieldInfo.metadata`.
    """
    return list(dict.fromkeys(_bounds(annotation, metadata)))


def _field_of(key: str) -> FieldInfo:
    """Find a field by its dotted key."""
    *parents, last = key.split(".")
    model: type[BaseModel] = Job
    for parent in parents:
        # A scene file only names its preset; the preset's own keys stand in a file of its own.
        inner = (
            [Quality] if parent == "quality" else models_in(model.model_fields[parent].annotation)
        )
        model = inner[0]
    return model.model_fields[last]


def _bounds(annotation: Any, metadata: Sequence[Any]) -> Iterator[Bound]:
    """Find all ends of a range."""
    for kind in _KINDS:
        for limit in metadata:
            if isinstance(value := getattr(limit, kind, None), int | float):
                yield Bound(kind, _short(value))
    yield from _of_ratios(metadata)
    for part in get_args(annotation):
        around = getattr(part, "__metadata__", ())
        inner = [item for info in around for item in getattr(info, "metadata", [info])]
        yield from _bounds(part, inner)


def _of_ratios(metadata: Sequence[Any]) -> Iterator[Bound]:
    """Find the range of a ratio: a function checks it, and its JSON schema tells it."""
    schemas = [getattr(extra, "json_schema", None) or {} for extra in metadata]
    for part in [part for schema in schemas for part in schema.get("anyOf", ())]:
        for kind, word in (("ge", "minimum"), ("le", "maximum")):
            if word in part:
                yield Bound(kind, _short(part[word]))


def _short(value: float) -> float:
    """Return a number without needless decimals: 240, not 240.0."""
    return int(value) if value == int(value) else value
