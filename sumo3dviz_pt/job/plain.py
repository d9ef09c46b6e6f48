"""Turns Python's values into what a scene file can hold: text, numbers, lists and mappings."""

from __future__ import annotations

import datetime as dt
import os
from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.job.yaml12 import MOST_DEPTH, MOST_VALUES


def plain(value: Any, *, key: str | None = None) -> Any:
    """Return a value that may hold tuples, paths, dates, numbers of NumPy and settings.

    Args:
        value: Of any depth.
        key: Where it stands, for messages.

    Raises:
        ConfigError: If it holds what no scene file can hold, or holds itself.
    """
    return _Copy().of(value, () if key is None else (key,))


def as_path(value: Any, *, key: str) -> Path:
    """Return a file's name.

    Raises:
        ConfigError: If it is none.
    """
    if isinstance(value, str | os.PathLike):
        text = os.fspath(value)
        if isinstance(text, str) and text and "\0" not in text:
            return Path(text)
    raise ConfigError(f"this should be a file's name, not {cut(repr(value))}", key=key)


class _Copy:
    """Copies a value, and counts what it holds."""

    def __init__(self) -> None:
        self._count = 0

    def of(self, value: Any, path: tuple[str, ...]) -> Any:
        """Return a copy of a value that stands at a path of keys."""
        self._count += 1
        if self._count > MOST_VALUES or len(path) > MOST_DEPTH:
            raise ConfigError("this holds too much, or itself", key=".".join(path[:3]))
        if isinstance(value, BaseModel):
            value = value.model_dump(by_alias=True, exclude_unset=True)
        if isinstance(value, Mapping):
            return {self._key(k, path): self.of(v, (*path, str(k))) for k, v in value.items()}
        if hasattr(value, "dtype") and hasattr(value, "tolist"):
            value = value.tolist()
        if isinstance(value, Sequence) and not isinstance(value, str | bytes | bytearray):
            return [self.of(item, (*path, str(n))) for n, item in enumerate(value)]
        return self._single(value, path)

    def _key(self, key: Any, path: tuple[str, ...]) -> str:
        """Return a key, which is text; numbers are taken for it."""
        if isinstance(key, int) and not isinstance(key, bool):
            return str(int(key))
        if not isinstance(key, str):
            raise ConfigError(f"a key should be text, not {cut(repr(key))}", key=".".join(path))
        return self._text(key, path)

    def _single(self, value: Any, path: tuple[str, ...]) -> Any:
        """Return a single value."""
        if value is None or isinstance(value, bool | dt.date | dt.time):
            return value
        if isinstance(value, str | os.PathLike):
            return self._text(os.fspath(value), path)
        if isinstance(value, Integral):
            return int(value)
        if isinstance(value, Fraction):
            return value
        if isinstance(value, Real | Decimal):
            return float(value)
        raise self._odd(value, path)

    def _text(self, text: Any, path: tuple[str, ...]) -> str:
        """Return text without halves of characters, which nothing can print or open."""
        if not isinstance(text, str) or any("\ud800" <= char <= "\udfff" for char in text):
            raise self._odd(text, path)
        return str(text)

    def _odd(self, value: Any, path: tuple[str, ...]) -> ConfigError:
        """Return what no scene file can hold."""
        return ConfigError(
            f"no setting can be {cut(ascii(value))} ({type(value).__name__})",
            key=".".join(path) or None,
        )
