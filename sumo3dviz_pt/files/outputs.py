"""Refuses places where nothing can or should be written, before any work is done."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.files.whole import special


def check_place(path: Path) -> None:
    """Refuse a file or folder that cannot be made; nothing stays of the trial.

    Raises:
        ConfigError: If something in its path is no folder, or cannot be written to, or if it is a
            pipe, a device or a socket, which the output would replace.
    """
    shown, what = cut(str(path)), special(path)
    if what:
        raise ConfigError(f"{shown} is {what} and no plain file; give another name", key="output")
    try:
        there = next(each for each in (path, *path.absolute().parents) if each.exists())
        if there != path and not there.is_dir():
            raise ConfigError(f"{shown} cannot be made: {there} is a file", key="output")
        folder = there if there.is_dir() else there.parent
        with tempfile.TemporaryFile(dir=folder):
            return
    except OSError as error:
        why = error.strerror or str(error)
        raise ConfigError(
            f"{shown} cannot be written to ({why}); give another place", key="output"
        ) from error


def check_spared(path: Path, read: Iterable[Path]) -> None:
    """Refuse to replace a file that the same command reads.

    Raises:
        ConfigError: If it is one of them, by whatever name.
    """
    for other in read:
        if other.is_file() and _is_written(path, other):
            raise ConfigError(
                f"{other} is read for this, and would be lost; give another name", key="output"
            )


def can_replace(path: Path) -> bool:
    """Return whether there may be a file by an output's name, which may hold `{shot}` or so."""
    return path.is_file() or "{" in path.name


def _is_written(path: Path, other: Path) -> bool:
    """Return whether an output is a file, or one of its numbered ones may be."""
    if path.is_file():
        return path.samefile(other)
    names = re.sub(r"\\\{\w+\\\}", ".+", re.escape(path.name))
    beside = path.parent.resolve() == other.parent.resolve()
    return can_replace(path) and beside and re.fullmatch(names, other.name) is not None
