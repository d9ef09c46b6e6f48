"""Keeps what takes long to make in folders of the user's cache, and checks it when it is read.

A folder is whole if its list, written last, names every file with the digest of its content.
It gets its name only when it is whole, so that no process reads an unfinished one.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

_LIST = "files.json"

Files = Mapping[str, bytes]
"""Content by name, such as `full/paint.ply`."""


def read_whole(folder: Path) -> Files | None:
    """Return the files of a folder; None if it does not exist, lacks one or holds a damaged one."""
    try:
        listed = json.loads((folder / _LIST).read_bytes())
        files = {name: (folder / name).read_bytes() for name in listed}
    except (OSError, ValueError, TypeError):
        return None
    return files if listed == _digests(files) else None


def keep(folder: Path, files: Files) -> None:
    """Write a folder; one that is whole stays, one that is not is replaced.

    Args:
        folder: Named after all that its files depend on: whoever fills it writes the same.
        files: Content by name.

    Raises:
        OSError: If nothing can be written there.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".building-"))
    try:
        for name, content in {**files, _LIST: _listing(files)}.items():
            (work / name).parent.mkdir(exist_ok=True)
            (work / name).write_bytes(content)
        _put(work, folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def make_room(newest: Path, most: int) -> None:
    """Remove the oldest folders beside one while all together are too large; that one stays.

    Args:
        newest: The folder.
        most: How large all may be [bytes].
    """
    kept: list[tuple[float, int, Path]] = []
    for folder in newest.parent.iterdir():
        # Another process may remove it at the same time.
        with contextlib.suppress(OSError):
            size = sum(file.stat().st_size for file in folder.iterdir())
            kept.append((folder.stat().st_mtime, size, folder))
    room = most
    for _, size, folder in sorted(kept, reverse=True):
        room -= size
        if room < 0 and folder != newest:
            shutil.rmtree(folder, ignore_errors=True)


def _put(work: Path, folder: Path) -> None:
    """Name a whole folder, unless another process was faster."""
    try:
        work.rename(folder)
    except OSError:
        if not folder.exists():
            raise
        if read_whole(folder) is None:
            aside = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".broken-"))
            folder.rename(aside / folder.name)
            work.rename(folder)
            shutil.rmtree(aside, ignore_errors=True)


def _listing(files: Files) -> bytes:
    """Return the list of a folder's files."""
    return json.dumps(_digests(files), sort_keys=True).encode()


def _digests(files: Files) -> dict[str, str]:
    """Return the digest of every file's content."""
    return {
        name: hashlib.blake2b(content, digest_size=16).hexdigest()
        for name, content in files.items()
    }
