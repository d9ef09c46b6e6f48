"""Versions of the kinds of files that are read back: older ones are understood, newer ones refused.

A file says its version as `schema_version`; one that does not is of version 1. A kind has a new
version when what older code reads would mean something else. What makes the next version of an
older one stands beside the kind's reader, and every reader asks it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sumo3dviz_pt.errors import ConfigError, cut

log = logging.getLogger(__name__)

SCHEMA_VERSION = "schema_version"
"""Key of a file's version."""

Content = Mapping[str, Any]

Upgrade = Callable[[Content], tuple[Content, str]]
"""Makes the next version of what a file holds, and says in words what was changed; if nothing had
to be, it returns what it got and nothing."""

UPDATE = (
    "update the package: git pull in a checkout, or pip install --upgrade FILE.whl with a newer"
    " wheel"
)
"""What to type to read files of newer versions."""


@dataclass(frozen=True, slots=True)
class Form:
    """A kind of file.

    Attributes:
        name: What messages call it.
        version: That this code writes.
        upgrades: By older version, what makes the next of it.
    """

    name: str
    version: int = 1
    upgrades: Mapping[int, Upgrade] = field(default_factory=dict)

    @property
    def stamp(self) -> dict[str, int]:
        """What a file of this version says of it."""
        return {SCHEMA_VERSION: self.version}

    def problem(self, content: Content) -> str:
        """Return why this code cannot read a version; empty if it can."""
        version = content.get(SCHEMA_VERSION, 1)
        if type(version) is not int or version < 1:
            return f"this should be a whole number from 1, not {cut(repr(version))}"
        if version > self.version:
            return (
                f"a {self.name} of version {version} is newer than this code, which reads up to"
                f" {self.version}; {UPDATE}"
            )
        return ""

    def current(self, content: Content, file: Path | None) -> Content:
        """Return what a file of this version or an older one means, as this version says it.

        What was changed is noted, once for all files of a kind.

        Args:
            content: What the file holds.
            file: For messages.

        Raises:
            ConfigError: If a newer version wrote it.
        """
        if problem := self.problem(content):
            raise ConfigError(problem, key=SCHEMA_VERSION, file=file)
        for version in range(content.get(SCHEMA_VERSION, 1), self.version):
            content, changed = self.upgrades[version](content)
            if changed:
                once = f"{self.name}: {changed}"
                log.warning(
                    "%s: an older version wrote it: %s", file, changed, extra={"once": once}
                )
                content = {**content, SCHEMA_VERSION: version + 1}
        return content
