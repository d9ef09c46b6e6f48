"""Writes files that are whole or not there, and reads no others than plain ones."""

from __future__ import annotations

import os
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from sumo3dviz_pt.errors import InputError

_SPECIAL = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def special(path: Path) -> str:
    """Return what a path is that is no plain file, such as a pipe; empty if it is nothing such.

    Links are followed. What does not exist, or is a folder, is nothing such.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return ""
    return next((what for is_one, what in _SPECIAL if is_one(mode)), "")


def refuse_special(path: Path) -> None:
    """Refuse what no reader may open: a pipe can wait for ever, and a device need not end.

    Links are followed. What does not exist, or is a folder, is left to the reader.

    Raises:
        InputError: If it is a pipe, a device or a socket.
    """
    what = special(path)
    if what:
        message = f"is {what} and no plain file; copy what comes out of it to one, and name that"
        raise InputError(message, file=path)


def open_plain(path: Path) -> BinaryIO:
    """Open a plain file for reading.

    Raises:
        InputError: If it is a pipe, a device or a socket.
        OSError: If it cannot be opened.
    """
    refuse_special(path)
    return path.open("rb")


def read_plain(path: Path, *, most: int) -> bytes:
    """Read a plain file that may hold so many bytes.

    Args:
        path: The file.
        most: Bytes.

    Raises:
        InputError: If it is a pipe, a device, a socket or a folder, or larger.
        OSError: If it cannot be read.
    """
    if path.is_dir():
        raise InputError("is a folder; name a file in it", file=path)
    with open_plain(path) as stream:
        # So much is set aside at once; files of the system say that they have no size.
        data = stream.read(min(most, max(path.stat().st_size, 1 << 20)) + 1)
    if len(data) > most:
        message = f"has more than {most:,} bytes, the most that is read; is it the right file?"
        raise InputError(message, file=path)
    return data


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a path to write to; what lies there replaces `path` when the `with` statement ends.

    Nobody ever reads a half of the file. If writing fails, nothing stays of it, and a file that
    existed before stays as it was.

    Raises:
        OSError: If it cannot be written.
    """
    # Machines that share a folder may write the same file at the same time.
    part = path.with_name(f"{path.name}.{socket.gethostname()}-{os.getpid()}.part")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def write_whole(path: Path, text: str) -> None:
    """Write text in UTF-8, as a whole or not at all.

    Raises:
        OSError: If it cannot be written.
    """
    with whole(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")
