"""A configuration of sumo3Dviz that is being read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sumo3dviz_pt.errors import ConfigError


@dataclass(slots=True)
class Configuration:
    """A configuration that is being read.

    Attributes:
        content: All of it.
        file: Where it stands.
        root: Folder that its paths refer to.
        read: Dotted keys that were understood.
        notes: What a user should know of its translation.
        moved: Files that lie elsewhere than it says, or are packed.
    """

    content: Mapping[str, Any]
    file: Path
    root: Path
    read: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    moved: list[Path] = field(default_factory=list)

    def at(self, key: str) -> Any:
        """Return the value at a dotted key, or None; it counts as understood."""
        self.read.add(key)
        found: Any = self.content
        for word in key.split("."):
            if not isinstance(found, Mapping) or word not in found:
                return None
            found = found[word]
        return found

    def number(self, key: str, default: float = 0.0) -> float:
        """Return a number.

        Raises:
            ConfigError: If there is something else.
        """
        value = self.at(key)
        return default if value is None else self.as_number(value, key)

    def numbers(self, key: str, default: Sequence[float]) -> list[float]:
        """Return as many numbers as the default has.

        Raises:
            ConfigError: If there is something else.
        """
        value = self.at(key)
        value = list(default) if value is None else value
        if not isinstance(value, list) or len(value) != len(default):
            raise self.error(f"{value!r} are not {len(default)} numbers", key)
        return [self.as_number(each, key) for each in value]

    def as_number(self, value: Any, key: str) -> float:
        """Return a value as a number; the key is for messages.

        Raises:
            ConfigError: If it is none.
        """
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(f"{value!r} is no number", key)
        return float(value)

    def error(self, message: str, key: str) -> ConfigError:
        """Return an error that names a key and the file."""
        return ConfigError(message, key=key, file=self.file)

    def unknown(self) -> Iterator[str]:
        """Yield the dotted keys that were not understood."""
        for key in _leaves(self.content):
            if not any(key == known or key.startswith(f"{known}.") for known in self.read):
                yield key


def _leaves(content: Any, before: str = "") -> Iterator[str]:
    """Yield the dotted keys of all values."""
    if not isinstance(content, Mapping):
        yield before
        return
    for key, value in content.items():
        yield from _leaves(value, f"{before}.{key}" if before else str(key))
