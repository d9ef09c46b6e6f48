"""Records of a study's films in `study.json`, and why films would be made anew.

`study.json` is what a study's folder says of itself, with every film that is finished.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.forms import Form
from sumo3dviz_pt.pipeline.films.encoding import DIGEST, digest_in, sealed
from sumo3dviz_pt.pipeline.films.frames import account_file, frames_folder, write_json
from sumo3dviz_pt.pipeline.films.layers import beside
from sumo3dviz_pt.pipeline.provenance import (
    FILM_RECORD,
    differences,
    file_hash,
    inputs_of,
    package_hashes,
    versions,
    with_files,
)
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.studies.designs.profiles import associations
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.stimuli import Stimulus

RECORD = "study.json"
STUDY_RECORD = Form("study's record")
"""The version of that file, and what makes it of older ones."""

PARTS = "study.films"
"""Folder of the records of films that were made one by one, until `study.json` holds them."""

MATERIALS = "materials"
"""Folder of the films, as Psych-DS calls it."""


@dataclass(frozen=True, slots=True)
class FilmRecord:
    """A finished film.

    Attributes:
        digest: Of all that it was made from.
        variant: The renderer's.
        sha256: Of the film's file.
        account: Digest of its account.
        frames: How many it has.
        rate: Frames per second, such as 25 or 30000/1001.
        duration: Of the film [s].
        size: Width, height [px].
        fov: Horizontal opening angle of its lens [deg]; None if it zooms.
        layers: What was traced beside it.
    """

    digest: str
    variant: str
    sha256: str
    account: str
    frames: int
    rate: str
    duration: float
    size: tuple[int, int]
    fov: float | None = None
    layers: tuple[str, ...] = ()


def film_path(folder: Path, plan: StudyPlan, stimulus: Stimulus) -> Path:
    """Return where a film goes."""
    return folder / MATERIALS / f"{stimulus.name}{plan.file.settings.film}"


def finished_films(
    folder: Path, plan: StudyPlan, *, variant: str, hashed: bool = True
) -> dict[str, FilmRecord]:
    """Return the films that need not be rendered: whole, and made from what they would be now.

    A film that lacks a layer that is asked for now has to be rendered; one that has more has not.

    Args:
        folder: The study's; it need not exist.
        plan: What is wanted.
        variant: The renderer's.
        hashed: Whether films and accounts are compared with their digests; else they only are
            there.
    """
    known = noted_films(folder)
    finished = {}
    for stimulus in plan.stimuli:
        record = known.get(stimulus.name)
        if record is None or (record.digest, record.variant) != (stimulus.digest, variant):
            continue
        path = film_path(folder, plan, stimulus)
        if _lacking(path, record, stimulus):
            continue
        if path.is_file() and (not hashed or _is_whole(path, record)):
            finished[stimulus.name] = record
    return finished


def _is_whole(path: Path, record: FilmRecord) -> bool:
    """Return whether a film and its account are those of a record."""
    try:
        account = _account_beside(path)
    except InputError:
        return False
    return digest_in(account) == record.account and file_hash(path) == record.sha256


def _lacking(path: Path, record: FilmRecord, stimulus: Stimulus) -> tuple[str, ...]:
    """Return the layers that are asked for now and do not lie beside a film."""
    wanted = stimulus.job.output.layers
    there = record.layers if beside(frames_folder(path)).is_dir() else ()
    return tuple(name for name in wanted if name not in there)


def lacking_layers(folder: Path, plan: StudyPlan, *, variant: str) -> dict[str, tuple[str, ...]]:
    """Return what films lack that would have to be rendered for nothing but their layers.

    Args:
        folder: The study's.
        plan: What is wanted.
        variant: The renderer's.
    """
    known, missing = noted_films(folder), dict[str, tuple[str, ...]]()
    for stimulus in plan.stimuli:
        record = known.get(stimulus.name)
        if record is None or (record.digest, record.variant) != (stimulus.digest, variant):
            continue
        lacking = _lacking(film_path(folder, plan, stimulus), record, stimulus)
        missing |= {stimulus.name: lacking} if lacking else {}
    return missing


def record_of(path: Path, stimulus: Stimulus, *, variant: str) -> FilmRecord:
    """Return what there is to know of a film that was just rendered.

    Args:
        path: The film, beside which its account lies.
        stimulus: What it shows.
        variant: The renderer's.
    """
    account = read_film_account(path)
    overlays = account.get("overlays", {})
    more = (int(overlays.get(f"frames_{side}", 0)) for side in ("before", "after"))
    frames, fps = len(account["frames"]) + sum(more), float(account["fps"])
    return FilmRecord(
        digest=stimulus.digest,
        variant=variant,
        sha256=file_hash(path),
        account=str(account[DIGEST]),
        frames=frames,
        rate=str(account["frame_rate"]),
        duration=round(frames / fps, 6),
        size=stimulus.job.output.size,
        fov=_fov(account),
        layers=tuple(stimulus.job.output.layers),
    )


def _fov(account: Mapping[str, Any]) -> float | None:
    """Return the opening angle that all frames of a film share [deg], or None."""
    fovs = {float(frame["camera"]["fov"]) for frame in account["frames"]}
    return fovs.pop() if len(fovs) == 1 else None


def read_film_account(path: Path) -> Mapping[str, Any]:
    """Return the account beside a film, as this version tells it.

    Raises:
        InputError: If it is missing or damaged.
        ConfigError: If a newer version wrote it.
    """
    return FILM_RECORD.current(_account_beside(path), account_file(path))


def _account_beside(path: Path) -> Mapping[str, Any]:
    """Return the account beside a film as it stands there, which its digest is of.

    Raises:
        InputError: If it is missing or damaged.
    """
    place = account_file(path)
    try:
        account: Mapping[str, Any] = json.loads(place.read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(
            f"the film's account is missing or damaged ({error})", file=place
        ) from error
    return account


def write_record(folder: Path, plan: StudyPlan, films: Mapping[str, FilmRecord]) -> Path:
    """Write `study.json`: the design, the films that are finished, and the pairs to compare."""
    settings = plan.file.settings
    content = {
        **STUDY_RECORD.stamp,
        "title": settings.about.title,
        "design": settings.design if isinstance(settings.design, str) else settings.design.form,
        "seed": settings.seed,
        "factors": {
            name: {"about": factor.about, "levels": _without_places(factor.levels)}
            for name, factor in settings.factors.items()
        },
        "films": {
            stimulus.name: {
                "code": stimulus.code,
                "file": film_path(Path(), plan, stimulus).as_posix(),
                "profiles": [dict(zip(plan.factors, p, strict=True)) for p in stimulus.profiles],
                **asdict(films[stimulus.name]),
            }
            for stimulus in plan.stimuli
            if stimulus.name in films
        },
        "pairs": [asdict(pair) for pair in plan.pairs],
        "associations": associations(plan.file.levels, plan.designed).round(4).tolist(),
        "notes": list(plan.notes),
        "versions": versions(),
    }
    path = folder / RECORD
    write_json(path, sealed(content), indent=1)
    _drop_parts(folder, films)
    return path


def _without_places(value: Any) -> Any:
    """Return settings in which files that are named by whole paths stand by their names."""
    if isinstance(value, Mapping):
        return {key: _without_places(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_places(item) for item in value]
    return Path(value).name if isinstance(value, str) and Path(value).is_absolute() else value


def write_part(folder: Path, name: str, film: FilmRecord) -> None:
    """Note one film on its own: machines that make films of one study share no file.

    Args:
        folder: The study's.
        name: The film's.
        film: What there is to know of it.
    """
    (folder / PARTS).mkdir(parents=True, exist_ok=True)
    write_json(folder / PARTS / f"{name}.json", asdict(film))


def _drop_parts(folder: Path, films: Mapping[str, FilmRecord]) -> None:
    """Remove the records of films that `study.json` holds now."""
    for name in films:
        (folder / PARTS / f"{name}.json").unlink(missing_ok=True)
    with suppress(OSError):  # others are there, or none ever was
        (folder / PARTS).rmdir()


def noted_films(folder: Path) -> dict[str, FilmRecord]:
    """Return the films that a folder's records name; none where they are missing or damaged."""
    films = {}
    try:
        record = json.loads((folder / RECORD).read_bytes())
        known = STUDY_RECORD.current(record, folder / RECORD)["films"]
        films = {name: _film(values) for name, values in known.items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        pass
    for path in sorted((folder / PARTS).glob("*.json")):
        with suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
            films[path.stem] = _film(json.loads(path.read_bytes()))
    return films


def _film(values: Mapping[str, Any]) -> FilmRecord:
    """Return a film as a record names it."""
    width, height = values["size"]
    own = {name: values[name] for name in FilmRecord.__slots__ if name not in ("size", "layers")}
    layers = tuple(map(str, values["layers"]))
    return FilmRecord(**own, size=(int(width), int(height)), layers=layers)


_MOST = 3
"""More reasons are counted."""

_COMPARED = ("scene", "inputs", "versions", "package")


def why_anew(folder: Path, plan: StudyPlan, *, variant: str) -> dict[str, str]:
    """Return why films that are there do not count, by their names.

    Args:
        folder: The study's; it need not exist.
        plan: What is wanted.
        variant: The renderer's.
    """
    done = finished_films(folder, plan, variant=variant)
    known, lacking = noted_films(folder), lacking_layers(folder, plan, variant=variant)
    reasons = {}
    for stimulus in plan.stimuli:
        path, record = film_path(folder, plan, stimulus), known.get(stimulus.name)
        if stimulus.name in done or not (path.is_file() or record):
            continue
        if not path.is_file():
            reasons[stimulus.name] = f"{path} is gone"
        elif record is None:
            reasons[stimulus.name] = "no record says what it was made from"
        elif record.variant != variant:
            reasons[stimulus.name] = f"it was made with the variant {record.variant}"
        elif record.digest != stimulus.digest:
            reasons[stimulus.name] = _changes(path, stimulus)
        elif stimulus.name in lacking:
            reasons[stimulus.name] = f"it lacks the layers {', '.join(lacking[stimulus.name])}"
        else:
            reasons[stimulus.name] = "the film or its account was changed since"
    return reasons


def _changes(path: Path, stimulus: Stimulus) -> str:
    """Return what a film was made from otherwise than it would be now."""
    try:
        account = read_film_account(path)
    except InputError as error:
        return str(error)
    job = stimulus.job
    inputs = inputs_of(job, scenario_files(job), camera=stimulus.shot.camera)
    now = {
        "scene": with_files(job.model_dump(by_alias=True), inputs.name),
        "inputs": dict(inputs.hashes),
        "versions": versions(),
        "package": package_hashes(),
    }
    changes = differences({key: account.get(key) for key in _COMPARED}, now)
    more = f" and {len(changes) - _MOST} more" if len(changes) > _MOST else ""
    return ", ".join(changes[:_MOST]) + more or "it is made from something else now"
