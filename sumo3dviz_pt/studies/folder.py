"""A study's folder: all that it was made from lies in it, and it can be packed into one file.

`inputs/study.yaml` and `inputs/scene.yaml` say what was carried out, with every `--set`; the files
that they name lie beside them, under paths that tell nothing of the machine. From these another
person on another machine makes the same films:

    sumo3dviz-pt study inputs/study.yaml -o again

Files that belong together (a configuration and what it names, a model and its pictures) lie to each
other as they did before, because they name each other by relative paths.

A pack is a ZIP of the files that `checksums.sha256` lists, and of that list; unpacked on another
machine it is the same folder. Names are sorted and dates fixed, so that a folder gives the same
bytes whenever it is packed.

References:
    PKWARE: APPNOTE.TXT 6.3.10, the format of ZIP files
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import stat
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import yaml

from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.files.atomic import atomic_path, open_plain, write_atomically
from sumo3dviz_pt.job.settings import Job, ScenarioSettings
from sumo3dviz_pt.job.study import TableSettings
from sumo3dviz_pt.library.vehicles.user_mesh import companions
from sumo3dviz_pt.model.traffic import ScenarioFiles
from sumo3dviz_pt.pipeline.films.reuse import LOCK
from sumo3dviz_pt.pipeline.provenance import by_role, file_hash, files_of, versions, with_files
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.records import MATERIALS, RECORD
from sumo3dviz_pt.studies.tools.datasets import CHECKSUMS, digest_of, read_digests
from sumo3dviz_pt.studies.tools.pages import COPY

FOLDER = "inputs"
STUDY, SCENE, README = "study.yaml", "scene.yaml", "README.md"

_HEAD = "# Written by sumo3dviz_pt: what was carried out. README.md says how to make it again.\n"


def write_study_inputs(folder: Path, plan: StudyPlan, *, variant: str) -> list[Path]:
    """Write the inputs of a study into its folder; files that lie there already stay.

    Args:
        folder: The study's.
        plan: What its films show.
        variant: The renderer's.

    Returns:
        All files, also those that stayed.
    """
    places = Places.of(plan)
    target = folder / FOLDER
    for source, place in places.files.items():
        _copy(source, target / place, places)
    texts = {**resolved(plan, places), README: _readme(plan, variant)}
    for name, text in texts.items():
        if not _holds(target / name, text):
            write_atomically(target / name, text)
    return [target / name for name in (*texts, *map(str, places.files.values()))]


def check_study_inputs(folder: Path, plan: StudyPlan) -> None:
    """Refuse a study that is read from its own folder and would replace what it is read from.

    Raises:
        ConfigError: Says what would be replaced.
    """
    own = {
        folder / FOLDER / STUDY: plan.file.path,
        folder / FOLDER / SCENE: plan.file.settings.scene,
    }
    own = {target: source for target, source in own.items() if target.is_file()}
    texts = resolved(plan, Places.of(plan)) if own else {}
    for target, source in own.items():
        if target.samefile(source) and not _holds(target, texts[target.name]):
            raise ConfigError(
                f"{target} is what the study is read from, and would be replaced by what is carried"
                " out now; give another folder",
                key="output",
            )


# Where files go ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Places:
    """Where the files of a study go.

    Attributes:
        files: Place within the folder of inputs, by whole path.
        folders: The same of folders that are searched.
    """

    files: Mapping[Path, PurePosixPath]
    folders: Mapping[Path, PurePosixPath]

    @classmethod
    def of(cls, plan: StudyPlan) -> Places:
        """Return where the files of a plan go."""
        groups = list(_groups(plan))
        tops = _tops(groups)
        located: dict[Path, PurePosixPath] = {}
        for group in groups:
            top = next(top for top in tops if _shelters(top, _root(group)))
            below = {path: path.relative_to(top).parts for path in group}
            located |= {path: PurePosixPath(tops[top], *parts) for path, parts in below.items()}
        for path, place in located.items():
            if _rooted(path, located):  # with relative paths it is another file
                located[path] = place.with_name(f"{place.stem}_relative{place.suffix}")
        plain = {path: place for path, place in sorted(located.items()) if path.is_file()}
        return cls(plain, {path: place for path, place in located.items() if path.is_dir()})

    def moved(self, value: Any, base: Path) -> Any:
        """Return settings in which words that name these files name them where they go.

        Args:
            value: Settings as they stand in a file.
            base: What relative paths refer to.
        """
        if isinstance(value, Mapping):
            return {key: self.moved(item, base) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [self.moved(item, base) for item in value]
        if not isinstance(value, str | Path):
            return value
        path = _full(base / value)
        place = self.files.get(path, self.folders.get(path))
        return str(value) if place is None else place.as_posix()


def _groups(plan: StudyPlan) -> Iterator[frozenset[Path]]:
    """Yield files that have to lie to each other as they do, by whole paths; a folder may be one.

    A file may be in several groups.
    """
    from sumo3dviz_pt.sumo.find import files_behind

    known: dict[ScenarioSettings, ScenarioFiles] = {}
    for job in (stimulus.job for stimulus in plan.stimuli):
        place = job.scenario.sumocfg or job.scenario.folder
        if job.scenario not in known:
            known[job.scenario] = files = scenario_files(job)
            if place is not None:
                grouped = {path for some in by_role(files).values() for path in some}
                grouped = grouped - _made(files) | {each.table for each in files.tables}
                yield _whole([place, *grouped - {*_named(job)}, *files_behind(place)])
        made = _made(known[job.scenario])
        for path in files_of(job, known[job.scenario]):
            if path.is_file() and path not in made:
                yield _whole([path, *companions(path)])
    design = plan.file.settings.design
    if isinstance(design, TableSettings):
        yield _whole([design.table])
    if plan.file.settings.session.texts is not None:
        yield _whole([plan.file.settings.session.texts])


def _made(files: ScenarioFiles) -> set[Path]:
    """Return what was made of tables, and is made again wherever these are."""
    return {file for each in files.tables for file in each.files}


def _named(job: Job) -> list[Path]:
    """Return the files that a scene names beside a configuration or a folder."""
    named, paths = job.scenario, list[Path]()
    own = named.model_copy(update={"sumocfg": None, "folder": None})
    with_files(own.model_dump(), paths.append)
    return paths


def _full(path: Path) -> Path:
    """Return a whole path; links stay what they are called."""
    return Path(os.path.normpath(path.absolute()))


def _whole(paths: Sequence[Path]) -> frozenset[Path]:
    """Return whole paths."""
    return frozenset(map(_full, paths))


def _root(group: frozenset[Path]) -> Path:
    """Return the folder below which all of a group lies."""
    return Path(os.path.commonpath([path if path.is_dir() else path.parent for path in group]))


def _tops(groups: Sequence[frozenset[Path]]) -> dict[Path, str]:
    """Return folders that hold all groups, and what they are called among the inputs.

    A single one has no name: its files lie beside the study file.
    """
    tops: list[Path] = []
    for folder in sorted(
        {_root(group) for group in groups}, key=lambda path: (len(path.parts), path)
    ):
        if not any(_shelters(top, folder) for top in tops):
            tops.append(folder)
    own = {tops[0] / name for name in (STUDY, SCENE, README)} if tops else set()
    if len(tops) == 1 and not (own | {tops[0]}) & frozenset().union(*groups):
        return {tops[0]: ""}
    names: dict[Path, str] = {}
    for top in tops:
        stem = re.sub(r"[^A-Za-z0-9._-]+", "_", top.name).strip(".")
        stem = stem if stem and top.name != Path.home().name else "files"
        taken = {name.lower() for name in names.values()}
        alike = (stem if n == 1 else f"{stem}_{n}" for n in range(1, len(tops) + 1))
        names[top] = next(name for name in alike if name.lower() not in taken)
    return names


def _shelters(top: Path, folder: Path) -> bool:
    """Return whether a folder can go with another: below it, by a way that tells of no machine."""
    home = _full(Path.home())
    tells = home != top and home.is_relative_to(top)
    return folder == top or (folder.is_relative_to(top) and not tells)


# What is written ---------------------------------------------------------------------------


def resolved(plan: StudyPlan, places: Places) -> dict[str, str]:
    """Return the study file and the scene file as they were carried out, by their names."""
    study, base = plan.file, plan.file.scene.folder
    settings = study.settings
    content = settings.model_dump(mode="json", by_alias=True, exclude_unset=True)
    content["scene"] = SCENE
    for name, factor in content["factors"].items():
        factor["levels"] = places.moved(settings.factors[name].levels, base)
    for key in ("common", "overrides"):
        if key in content:
            content[key] = places.moved(content[key], base)
    more = places.moved({**settings.overrides, **plan.overrides}, base)
    if more:
        content["overrides"] = more
    if isinstance(settings.design, TableSettings):
        content["design"]["table"] = places.moved(settings.design.table, Path())
    if settings.session.texts is not None:
        content["session"]["texts"] = places.moved(settings.session.texts, Path())
    if settings.tools.offline:
        content["tools"]["jspsych"] = f"../{COPY}"
    scene = places.moved(study.scene.settings, base)
    return {STUDY: _HEAD + _yaml(content), SCENE: _HEAD + _yaml(scene)}


class _Dumper(yaml.SafeDumper):
    """Writes YAML that means the same to readers of YAML 1.1 and 1.2."""

    def ignore_aliases(self, data: Any) -> bool:
        """Write everything out."""
        del data
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    """Write a word as it is, and all that might be taken for something else in quotes."""
    plain = re.fullmatch(r"[A-Za-z_][A-Za-z0-9_ ./-]*[A-Za-z0-9_/]|[A-Za-z_]", text)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if plain else '"')


_Dumper.add_representer(str, _text)


def _yaml(content: Any) -> str:
    """Return values as YAML."""
    return yaml.dump(
        content,
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        width=100,
        default_flow_style=None,
    )


def _readme(plan: StudyPlan, variant: str) -> str:
    """Return how films are made again, and how they are verified."""
    made = "".join(f"| {name} | {number} |\n" for name, number in versions().items())
    chosen = "" if variant == "llvm" else f" --variant {variant}"
    return f"""# What these films were made from

`{STUDY}` is the study as it was carried out, with every `--set`; `{SCENE}` is its scene. The
files that they name lie here, too. `../inputs.sha256` has the digests of all of them.

In the folder above this one:

    sumo3dviz-pt study {FOLDER}/{STUDY} -o again{chosen}
    sumo3dviz-pt study verify .

The first command makes the {len(plan.stimuli)} films again. On the same kind of processor, with
these versions, each has the bytes that `checksums.sha256` tells. The second one says whether the
folder is what it was; with `--replay 3` it renders three frames again and compares them.

| package | version |
|---|---|
{made}"""


def _copy(source: Path, target: Path, places: Places) -> None:
    """Copy a file, if it is not there already; whole paths in a configuration become relative."""
    if target.is_file() and target.samefile(source):
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    if target.name != source.name:
        write_atomically(target, _unrooted(source, places))
    elif file_hash(target) != file_hash(source):
        with atomic_path(target) as part:
            shutil.copyfile(source, part)


def _rooted(path: Path, files: Iterable[Path]) -> bool:
    """Return whether a file is a configuration that names others by their whole paths."""
    if path.suffix.lower() != ".sumocfg":
        return False
    text = _plain_text(path)
    return any(name in text for other in files for name in (str(other), other.as_posix()))


def _unrooted(source: Path, places: Places) -> str:
    """Return a configuration with relative paths in place of whole ones."""
    text, start = _plain_text(source), places.files[source].parent
    for path, place in sorted(places.files.items(), key=lambda pair: -len(str(pair[0]))):
        relative = Path(os.path.relpath(place, start)).as_posix()
        for name in (str(path), path.as_posix()):
            text = text.replace(name, relative)
    return text


def _plain_text(path: Path) -> str:
    """Return a file's text, whatever its encoding."""
    return path.read_text(encoding="utf-8", errors="replace")


def _holds(path: Path, text: str) -> bool:
    """Return whether a file holds a text already."""
    return path.is_file() and path.read_bytes() == text.encode()


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
    with atomic_path(target) as part, zipfile.ZipFile(part, "w") as archive:
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
        digests = read_digests(path)
    missing = sorted(digests.keys() - names.keys())
    if missing:
        raise InputError(f"lacks {len(missing)} files, the first is {missing[0]}", file=pack)
    return digests


def _write(
    pack: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, place: Path, digest: str | None
) -> None:
    """Write one file, no longer than the pack says; refuse it if its digest is another."""
    path, hasher, left = place / info.filename, hashlib.sha256(), info.file_size
    path.parent.mkdir(parents=True, exist_ok=True)
    with archive.open(info) as source, path.open("wb") as sink:
        while left >= 0 and (data := source.read(1 << 20)):
            hasher.update(data)
            sink.write(data)
            left -= len(data)
    if left or (digest is not None and hasher.hexdigest() != digest):
        raise InputError(f"{info.filename} in it is not what it was when it was packed", file=pack)
