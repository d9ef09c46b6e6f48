"""Reads assets that are numbers alone: plants, buildings, their colours, materials.

Our generators make what they describe when a scene needs it, so no mesh or map lies beside
the `asset.yaml`. For every family a dataclass names all keys; a key that is unknown, that is
missing or that holds something else than a value of its type is an error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError

_Asset = TypeVar("_Asset", bound="AssetFile")

_WORDS: Mapping[str, str] = {
    "unexpected_keyword_argument": "this key is unknown",
    "missing": "this key is missing",
}


class RecipeValue:
    """Base of the dataclasses that recipes are read as; a key that is no field is an error."""

    __slots__ = ()
    __pydantic_config__ = ConfigDict(extra="forbid")


@dataclass(frozen=True, slots=True, kw_only=True)
class AssetFile(RecipeValue):
    """What the `asset.yaml` of every such asset says; each family adds its `recipe`.

    Attributes:
        kind: What the asset is, such as `tree`.
        order: Its place among the assets of its family. Choices by chance count in this order,
            so that a scene looks the same whatever the order of the files.
        about: A few words for lists.
        licence: Under which it may be passed on.
        base: Name of the asset that this one varies, if any.
    """

    kind: str
    order: int
    about: str
    licence: str
    base: str | None = None


def read_family(family: str, kind: type[_Asset]) -> dict[str, _Asset]:
    """Read all assets of a family, by name and in their `order`.

    Args:
        family: A folder in `assets/`, such as `plants`.
        kind: What the content of each `asset.yaml` becomes; all dataclasses in it are
            `RecipeValue`.

    Raises:
        ConfigError: If a key is unknown or missing, or holds something of another type.
    """
    reader = TypeAdapter(kind)
    assets = {name: _read(reader, family, name) for name in catalog.names(family)}
    return dict(sorted(assets.items(), key=lambda item: item[1].order))


def read_asset(family: str, name: str, kind: type[_Asset]) -> _Asset:
    """Read one asset; arguments and errors as for `read_family`."""
    return _read(TypeAdapter(kind), family, name)


def _read(reader: TypeAdapter[_Asset], family: str, name: str) -> _Asset:
    """Check the content of one `asset.yaml`."""
    entry = catalog.find(family, name)
    try:
        return reader.validate_python(dict(entry.meta))
    except ValidationError as error:
        raise _explained(error, entry.folder / "asset.yaml") from None


def _explained(error: ValidationError, file: Path) -> ConfigError:
    """Say what is wrong first in a file; a misspelt key comes before the one that it should be."""
    problems = sorted(error.errors(), key=lambda each: each["type"] == "missing")
    first = problems[0]
    words = _WORDS.get(first["type"], first["msg"].replace("Input should be", "this should be"))
    return ConfigError(words, key=".".join(map(str, first["loc"])), file=file)
