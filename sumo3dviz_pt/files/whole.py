"""Writes files that are whole or not there."""

from __future__ import annotations

import os
import socket
from pathlib import Path


def write_whole(path: Path, text: str) -> None:
    """Write text in UTF-8; nobody ever reads a half of it, and none stays if writing fails.

    Raises:
        OSError: If it cannot be written.
    """
    # Machines that share a folder may write the same file at the same time.
    part = path.with_name(f"{path.name}.{socket.gethostname()}-{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
