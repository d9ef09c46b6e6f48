"""Writes files that are whole or not there."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


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
