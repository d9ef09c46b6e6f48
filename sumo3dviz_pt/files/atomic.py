"""Files that are whole or not there, where they may be written, and those of the user's cache.

Only plain files are read. Places where nothing can or should be written are refused before any work
is done. `own_folder` gives a folder that nobody but the user can have written to.

What takes long to make is kept in folders of the user's cache, and checked when it is read. A
folder is whole if its list, written last, names every file with the digest of its content. It gets
its name only when it is whole, so that no process reads an unfinished one.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import socket
import stat
import tempfile
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from sumo3dviz_pt.errors import ConfigError, InputError, cut


def own_folder(path: Path) -> Path:
    """Make a folder that only this user reads and writes, or make sure that it is one.

    Args:
        path: In a folder that others may write to, such as the temporary one.

    Raises:
        ConfigError: If somebody else made it, or may have written to it.
        OSError: If it cannot be made.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.mkdir(mode=0o700, exist_ok=True)
    if os.name == "nt":  # temporary folders are the user's own there
        return path
    status = path.lstat()
    if not stat.S_ISDIR(status.st_mode):
        why = "it is a link"
    elif status.st_uid != os.getuid():
        why = "it belongs to somebody else"
    elif status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        why = "others may write to it"
    else:
        path.chmod(0o700)
        return path
    raise ConfigError(f"the folder {path} is not used, because {why}", key="folder")


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
def atomic_path(path: Path) -> Iterator[Path]:
    """Give a path to write to; what lies there replaces `path` when the `with` statement ends.

    Nobody ever reads a half of the file. If writing fails, nothing stays of it, and a file that
    existed before stays as it was.

    Raises:
        OSError: If it cannot be written.
    """
    part = path.with_name(_unfinished(path.name))
    try:
        yield part
        put_in_place(part, path)
    finally:
        part.unlink(missing_ok=True)


_MOST_NAME = 255 - len(".00000000-4294967295.part")
"""Bytes of a name beside which there is room for what an unfinished file adds."""


def _unfinished(name: str) -> str:
    """Return what a file is called until it is whole; no longer than it must be, for Windows.

    Machines that share a folder may write the same file at the same time.
    """
    host = zlib.crc32(socket.gethostname().encode())
    long = len(name.encode(errors="surrogateescape")) > _MOST_NAME
    own = f"{zlib.crc32(name.encode(errors='surrogateescape')):08x}" if long else name
    return f"{own}.{host:08x}-{os.getpid()}.part"


_TRIES, _WAIT = 20, 0.1
"""How often a file that is in use is tried to be replaced, and the time between tries [s]."""

_IN_USE = (5, 32)
"""What Windows says then: access denied, sharing violation."""


def put_in_place(part: Path, path: Path) -> None:
    """Give a whole file its name; one that has it is replaced.

    Windows replaces no file that another program has open, as a player has, or a search for viruses
    for a moment: that is waited for.

    Raises:
        OSError: If it cannot be replaced.
    """
    for left in reversed(range(_TRIES)):
        try:
            part.replace(path)
            return
        except PermissionError as error:
            if getattr(error, "winerror", None) not in _IN_USE:
                raise
            if not left:
                what = "another program has it open; close that, and run the command again"
                raise PermissionError(error.errno, what, str(path)) from error
        time.sleep(_WAIT)


def write_atomically(path: Path, text: str) -> None:
    """Write text in UTF-8, as a whole or not at all.

    Raises:
        OSError: If it cannot be written.
    """
    with atomic_path(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


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


_LIST = "files.json"

Files = Mapping[str, bytes]
"""Content by name, such as `full/paint.ply`."""


def read_folder(folder: Path) -> Files | None:
    """Return the files of a folder; None if it does not exist, lacks one or holds a damaged one."""
    try:
        listed = json.loads((folder / _LIST).read_bytes())
        files = {name: (folder / name).read_bytes() for name in listed}
    except (OSError, ValueError, TypeError):
        return None
    return files if listed == _digests(files) else None


def write_folder(folder: Path, files: Files) -> None:
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
    folders: list[tuple[float, int, Path]] = []
    for folder in newest.parent.iterdir():
        # Another process may remove it at the same time.
        with contextlib.suppress(OSError):
            size = sum(file.stat().st_size for file in folder.iterdir())
            folders.append((folder.stat().st_mtime, size, folder))
    room = most
    for _, size, folder in sorted(folders, reverse=True):
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
        if read_folder(folder) is None:
            aside = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".broken-"))
            folder.rename(aside / folder.name)
            work.rename(folder)
            shutil.rmtree(aside, ignore_errors=True)


def _listing(files: Files) -> bytes:
    """Return the list of a folder's files."""
    return json.dumps(_digests(files), sort_keys=True).encode()


def _digests(files: Files) -> dict[str, list[int]]:
    """Return length and checksum of every file's content.

    They show damage, which needs no cryptography: a cached town has hundreds of megabytes, and the
    folder's name already says what its content depends on.
    """
    return {name: [len(content), zlib.crc32(content)] for name, content in files.items()}
