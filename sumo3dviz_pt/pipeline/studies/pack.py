"""Packs a finished study into one file, and unpacks it: the same folder on another machine.

A pack is a ZIP of the files that `checksums.sha256` lists, and of that list. Names are sorted and
dates fixed, so that a folder gives the same bytes whenever it is packed.

References:
    PKWARE: APPNOTE.TXT 6.3.10, the format of ZIP files
"""

from __future__ import annotations

import hashlib
import shutil
import stat
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.experiments.tools.papers import CHECKSUMS, digest_of, read_digests
from sumo3dviz_pt.files.whole import open_plain, whole
from sumo3dviz_pt.pipeline.films.locks import LOCK
from sumo3dviz_pt.pipeline.studies.inputs import FOLDER, STUDY
from sumo3dviz_pt.pipeline.studies.records import MATERIALS, RECORD

SUFFIX = ".zip"

_BESIDE = (".frames", ".layers", ".final")
"""Endings of the folders beside a film whose files are in no list."""

_PACKED = frozenset({".mp4", ".webm", ".mov", ".png", ".jpg", ".exr", ".gz", ".parquet", ".xlsx"})
"""Endings of files that packing makes no smaller."""

_DATE = (1980, 1, 1, 0, 0, 0)
_MOST_FILES = 1_000_000
_MOST_LIST = 200_000_000
"""Bytes that a list of digests may have."""


@dataclass(frozen=True, slots=True)
class Packed:
    """What was packed.

    Attributes:
        file: The pack.
        files: How many files are in it.
        size: Of the pack [bytes].
        beside: Of frames and layers that lie beside the films [bytes].
    """

    file: Path
    files: int
    size: int
    beside: int


def pack_study(folder: Path, target: Path, *, frames: bool, overwrite: bool = False) -> Packed:
    """Write a study's folder into one file.

    Args:
        folder: Of a finished study.
        target: The .zip to write.
        frames: Whether stored frames and layers go in, too.
        overwrite: Whether a file that exists is replaced.

    Raises:
        ConfigError: If the target exists or is no .zip.
        InputError: If the folder is no finished study's, or files in it are not what they were.
    """
    if target.suffix.lower() != SUFFIX:
        raise ConfigError(f"a pack is a {SUFFIX}, not {target.name}", key="output")
    if target.exists() and not overwrite:
        raise ConfigError(f"{target} exists already; --overwrite replaces it", key="output")
    listed = _finished(folder)
    beside = {name: path for name, path in _frames(folder) if name not in listed}
    names = sorted({*listed, CHECKSUMS, *(beside if frames else ())})
    with whole(target) as part, zipfile.ZipFile(part, "w") as archive:
        for name in names:
            _add(archive, folder / name, name)
    size = sum(path.stat().st_size for path in beside.values())
    return Packed(target, len(names), target.stat().st_size, size)


def _finished(folder: Path) -> Mapping[str, str]:
    """Return the digests of a finished study's files, by name.

    Raises:
        InputError: If it is none, or files are missing or others by now.
    """
    if not folder.is_dir() or not (folder / RECORD).is_file():
        raise InputError(f"is no study's folder: it has no {RECORD}", file=folder)
    listed = read_digests(folder / CHECKSUMS)
    if f"{FOLDER}/{STUDY}" not in listed:
        raise InputError(
            "is no finished study, or an older version made it: make it by study ... --resume",
            file=folder,
        )
    changed = [name for name, digest in sorted(listed.items()) if not _is(folder / name, digest)]
    if changed:
        inputs = [name for name in changed if name.startswith(f"{FOLDER}/")]
        what = f"{len(inputs)} of them inputs" if inputs else "none of them an input"
        shown = ", ".join([*inputs, *(name for name in changed if name not in inputs)][:5])
        raise InputError(
            f"{len(changed)} files are missing or not what they were when the study was finished"
            f" ({what}): {shown}; make it again by study ... --resume",
            file=folder,
        )
    return listed


def _is(path: Path, digest: str) -> bool:
    """Return whether a file is there and what it was."""
    return path.is_file() and digest_of(path) == digest


def _frames(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield the frames and layers beside the films, by name."""
    for place in sorted((folder / MATERIALS).iterdir()):
        if place.is_dir() and place.suffix in _BESIDE:
            for path in sorted(place.rglob("*")):
                if path.is_file() and path.suffix != ".part" and path.name != LOCK:
                    yield path.relative_to(folder).as_posix(), path


def _add(archive: zipfile.ZipFile, path: Path, name: str) -> None:
    """Put a file into an archive; its bytes hang on nothing but what it holds."""
    info = zipfile.ZipInfo(name, _DATE)
    info.create_system, info.external_attr = 3, (stat.S_IFREG | 0o644) << 16
    packs = path.suffix.lower() not in _PACKED
    info.compress_type = zipfile.ZIP_DEFLATED if packs else zipfile.ZIP_STORED
    info.file_size = path.stat().st_size
    with open_plain(path) as source, archive.open(info, "w") as place:
        shutil.copyfileobj(source, place, 1 << 20)


# Unpacking ---------------------------------------------------------------------------------


def unpack_study(pack: Path, target: Path) -> int:
    """Write the files of a pack into a new folder; all of them or none.

    Args:
        pack: The .zip.
        target: A folder that does not exist yet, or is empty.

    Returns:
        How many files there are.

    Raises:
        ConfigError: If the folder holds something.
        InputError: If it is no pack, a file would lie elsewhere, or one is damaged.
    """
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise ConfigError(f"{target} holds something already; give a new folder", key="output")
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f"{target.name}.") as part:
        place = Path(part) / "study"
        count = _extract(pack, place)
        if target.exists():
            target.rmdir()
        place.rename(target)
    return count


def _extract(pack: Path, place: Path) -> int:
    """Write the files of a pack into a folder."""
    try:
        with open_plain(pack) as stream, zipfile.ZipFile(stream) as archive:
            members = archive.infolist()
            _check(pack, members)
            digests = _listed(pack, archive)
            for info in members:
                _write(pack, archive, info, place, digests.get(info.filename))
    except FileNotFoundError as error:
        raise InputError("there is no such pack", file=pack) from error
    except (zipfile.BadZipFile, EOFError, NotImplementedError, OSError) as error:
        raise InputError(f"cannot be unpacked: {cut(str(error))}", file=pack) from error
    return len(members)


def _check(pack: Path, members: list[zipfile.ZipInfo]) -> None:
    """Refuse names that lead out of the folder, or mean one file twice."""
    if len(members) > _MOST_FILES:
        raise InputError(f"holds {len(members):,} files; no study has", file=pack)
    seen = set[str]()
    for info in members:
        name = info.filename
        parts = PurePosixPath(name).parts
        plain = stat.S_IFMT(info.external_attr >> 16) in (0, stat.S_IFREG)
        odd = {"..", "."} & {*parts} or "\\" in name or "\0" in name or name[1:2] == ":"
        if not parts or not plain or odd or name.startswith("/") or name != "/".join(parts):
            raise InputError(f"holds {cut(repr(name))}, which is no plain file in it", file=pack)
        if name.lower() in seen:
            raise InputError(f"holds {cut(repr(name))} twice", file=pack)
        seen.add(name.lower())


def _listed(pack: Path, archive: zipfile.ZipFile) -> Mapping[str, str]:
    """Return the digests that a pack tells, by name."""
    names = {info.filename: info for info in archive.infolist()}
    if CHECKSUMS not in names or names[CHECKSUMS].file_size > _MOST_LIST:
        raise InputError(f"is no pack of a study: it has no {CHECKSUMS}", file=pack)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / CHECKSUMS
        path.write_bytes(archive.read(CHECKSUMS))
        found = read_digests(path)
    missing = sorted(found.keys() - names.keys())
    if missing:
        raise InputError(f"lacks {len(missing)} files, the first is {missing[0]}", file=pack)
    return found


def _write(
    pack: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, place: Path, digest: str | None
) -> None:
    """Write one file, no longer than the pack says; refuse it if its digest is another."""
    path, found, left = place / info.filename, hashlib.sha256(), info.file_size
    path.parent.mkdir(parents=True, exist_ok=True)
    with archive.open(info) as source, path.open("wb") as sink:
        while left >= 0 and (data := source.read(1 << 20)):
            found.update(data)
            sink.write(data)
            left -= len(data)
    if left or (digest is not None and found.hexdigest() != digest):
        raise InputError(f"{info.filename} in it is not what it was when it was packed", file=pack)
