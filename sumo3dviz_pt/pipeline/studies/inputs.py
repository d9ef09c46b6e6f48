"""Puts all that a study was made from into its folder, so that the folder lives alone.

`inputs/study.yaml` and `inputs/scene.yaml` say what was carried out, with every `--set`; the files
that they name lie beside them, under paths that tell nothing of the machine. From these another
person on another machine makes the same films:

    sumo3dviz-pt study inputs/study.yaml -o again

Files that belong together (a configuration and what it names, a model and its pictures) lie to each
other as they did before, because they name each other by relative paths.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import yaml

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.tools.jspsych import COPY
from sumo3dviz_pt.files.whole import whole, write_whole
from sumo3dviz_pt.job.settings import Job, ScenarioSettings
from sumo3dviz_pt.job.study import TableSettings
from sumo3dviz_pt.library.vehicles.companions import companions
from sumo3dviz_pt.model.scenario import ScenarioFiles
from sumo3dviz_pt.pipeline.accounts.provenance import (
    by_role,
    file_hash,
    files_of,
    versions,
    with_files,
)
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.pipeline.studies.plan import StudyPlan

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
            write_whole(target / name, text)
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
        found: dict[Path, PurePosixPath] = {}
        for group in groups:
            top = next(top for top in tops if _shelters(top, _root(group)))
            below = {path: path.relative_to(top).parts for path in group}
            found |= {path: PurePosixPath(tops[top], *parts) for path, parts in below.items()}
        for path, place in found.items():
            if _rooted(path, found):  # with relative paths it is another file
                found[path] = place.with_name(f"{place.stem}_relative{place.suffix}")
        plain = {path: place for path, place in sorted(found.items()) if path.is_file()}
        return cls(plain, {path: place for path, place in found.items() if path.is_dir()})

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
                found = {path for some in by_role(files).values() for path in some}
                yield _whole([place, *found - {*_named(job)}, *files_behind(place)])
        for path in files_of(job, known[job.scenario]):
            if path.is_file():
                yield _whole([path, *companions(path)])
    design = plan.file.settings.design
    if isinstance(design, TableSettings):
        yield _whole([design.table])
    if plan.file.settings.session.texts is not None:
        yield _whole([plan.file.settings.session.texts])


def _named(job: Job) -> list[Path]:
    """Return the files that a scene names beside a configuration or a folder."""
    named, found = job.scenario, list[Path]()
    own = named.model_copy(update={"sumocfg": None, "folder": None})
    with_files(own.model_dump(), found.append)
    return found


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
        write_whole(target, _unrooted(source, places))
    elif file_hash(target) != file_hash(source):
        with whole(target) as part:
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
