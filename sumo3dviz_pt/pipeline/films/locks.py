"""A lock that one process at a time holds on a folder.

The operating system holds it for a file in the folder and lets go when the process ends,
however it ends: so a file that a killed process left is no lock, and the next process takes it
over. The file says which process holds it, for messages only.
"""

from __future__ import annotations

import json
import logging
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from sumo3dviz_pt.errors import ConfigError

log = logging.getLogger(__name__)

LOCK = "render.lock"
"""The file's name."""

_ON_WINDOWS = sys.platform == "win32"

_FAR = 1 << 30
"""Offset of the byte that Windows locks: far from the text, because locked bytes are unreadable."""


@contextmanager
def held(folder: Path, *, what: str) -> Iterator[None]:
    """Hold a folder's lock.

    Args:
        folder: It exists.
        what: What cannot be done twice at once, such as `film.mp4 is being rendered`.

    Raises:
        ConfigError: If another process holds it; the message says which.
    """
    path = folder / LOCK
    with _taken(path, what) as file:
        file.truncate(0)
        file.write(json.dumps({"pid": os.getpid(), "host": socket.gethostname()}).encode())
        file.flush()
        try:
            yield
        finally:
            if not _ON_WINDOWS:
                path.unlink(missing_ok=True)
    if _ON_WINDOWS:  # no open file can be removed there, and the next one may have it open by now
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _taken(path: Path, what: str) -> BinaryIO:
    """Return the lock's file, open and locked: the one of that name, not one just removed."""
    while True:
        file = path.open("a+b")
        if not _locked(file):
            file.close()
            raise ConfigError(f"{what} by {_holder(path)}: wait for it, or stop it", key="output")
        with suppress(FileNotFoundError):
            if _same(file, path):
                return file
        file.close()


def _same(file: BinaryIO, path: Path) -> bool:
    """Return whether a path still leads to an open file."""
    return os.path.samestat(os.fstat(file.fileno()), path.stat())


def _holder(path: Path) -> str:
    """Return the process that holds a lock, by the lock's file."""
    try:
        known = json.loads(path.read_bytes())
        return f"process {known['pid']} on {known['host']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "another process"


if sys.platform == "win32":
    import msvcrt

    def _locked(file: BinaryIO) -> bool:
        """Lock an open file, unless another process has."""
        file.seek(_FAR)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def _locked(file: BinaryIO) -> bool:
        """Lock an open file, unless another process has."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError as error:
            log.warning(
                "%s: this file system knows no locks (%s): do not render one film twice at once",
                file.name,
                error.strerror,
            )
        return True
