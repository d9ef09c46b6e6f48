"""Levels as patches of a scene file: what each changes, and that no two factors share a key."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

from sumo3dviz_pt.experiments.trials import Profile
from sumo3dviz_pt.job.errors import located
from sumo3dviz_pt.job.settings import Job, LayerName
from sumo3dviz_pt.job.study import Patch, StudySettings
from sumo3dviz_pt.job.yaml12 import KeyPath
from sumo3dviz_pt.pipeline.certificate.evidence import COUNTED, LAYERS
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.pipeline.studies.file import StudyFile

_FULL_MODELS = 6
"""Models in full detail in every film of a study, unless the scene file says another number."""

_OBJECT_TRIANGLES = 200_000
"""Of each kind of object in every film of a study, unless the scene file says another number."""


def leaves(patch: Patch) -> Iterator[KeyPath]:
    """Yield the keys of the scene file that a patch sets.

    Only keys at the top are dotted: ids of road users may hold dots themselves.
    """
    for key, value in patch.items():
        yield from _below(tuple(key.split(".")), value)


def _below(path: KeyPath, value: Any) -> Iterator[KeyPath]:
    """Yield the keys of values within a value."""
    if isinstance(value, Mapping) and value:
        for key, inner in value.items():
            yield from _below((*path, str(key)), inner)
    else:
        yield path


def told_only(study: StudyFile, factor: str) -> bool:
    """Return whether a factor changes no picture: all of its patches are empty."""
    return not any(study.settings.factors[factor].levels.values())


def job_of(study: StudyFile, profile: Profile | None, overrides: Patch | None = None) -> Job:
    """Return the scene of a profile.

    The scene file comes first, then the clip, what is common to all, the levels in the order of
    the factors, and what the command line says.

    Args:
        study: The study file.
        profile: A level of each factor; None is the scene without any.
        overrides: Values by dotted key that win over all others.

    Raises:
        ConfigError: If the scene that comes out is wrong.
    """
    settings = study.settings
    clip = {} if settings.clip is None else {"shots": [settings.clip.model_dump(by_alias=True)]}
    chosen = zip(settings.factors.values(), profile or (), strict=False)
    patches = [factor.levels[level] for factor, level in chosen]
    content = study.scene.patched(
        clip, settings.common, *patches, settings.overrides, overrides or {}
    )
    job = make_job(content, folder=study.scene.folder, source=study.scene.source)
    job = _with_one_detail(job)
    return _with_layers(job, measured_layers(settings))


def _with_one_detail(job: Job) -> Job:
    """Return a scene in which things are drawn alike whatever else stands there.

    By default a shot draws road users and objects in as much detail as its other triangles leave,
    so that a street without trees would show better cars and houses.
    """
    vehicles, objects = job.vehicles, job.objects
    if vehicles.full_models is None:
        vehicles = vehicles.model_copy(update={"full_models": _FULL_MODELS})
    if objects.triangles is None:
        objects = objects.model_copy(update={"triangles": _OBJECT_TRIANGLES})
    return job.model_copy(update={"vehicles": vehicles, "objects": objects})


def measured_layers(settings: StudySettings) -> tuple[LayerName, ...]:
    """Return the layers that a study's own measurements need of every film.

    A certificate compares several; a report counts the pixels that show each thing.
    """
    if settings.certificate.write:
        return LAYERS
    return (COUNTED,) if settings.report.write else ()


def _with_layers(job: Job, measured: Sequence[LayerName]) -> Job:
    """Return a scene whose films have the layers that are measured, too."""
    layers = tuple(dict.fromkeys((*job.output.layers, *measured)))
    return job.model_copy(update={"output": job.output.model_copy(update={"layers": layers})})


def check_patches(study: StudyFile, overrides: Patch | None = None) -> None:
    """Refuse levels that are no scene, change nothing, or change what another factor does.

    Raises:
        ConfigError: Names the level's place in the study file.
    """
    base = _base(study, overrides)
    for name, factor in study.settings.factors.items():
        if told_only(study, name):
            continue
        jobs: dict[str, Job] = {}
        for level in factor.levels:
            with study.blamed("factors", name, "levels", level):
                jobs[level] = _with_level(study, name, level, overrides)
        _check_different(study, name, jobs, base)
    for one, other in combinations(study.settings.factors, 2):
        _check_apart(study, one, other)


def _base(study: StudyFile, overrides: Patch | None) -> Job:
    """Return the scene without any level; what is wrong is the scene file's or `common`'s fault."""
    content = study.scene.patched()
    make_job(content, folder=study.scene.folder, source=study.scene.source)
    where = "common" if study.settings.common else "scene"
    with study.blamed(where):
        plain = replace(study, settings=study.settings.model_copy(update={"overrides": {}}))
        job = job_of(plain, None, overrides)
    if not study.settings.overrides:
        return job
    with study.blamed("overrides"):
        return job_of(study, None, overrides)


def _with_level(study: StudyFile, factor: str, level: str, overrides: Patch | None) -> Job:
    """Return the scene with a single level."""
    settings = study.settings
    clip = {} if settings.clip is None else {"shots": [settings.clip.model_dump(by_alias=True)]}
    patch = settings.factors[factor].levels[level]
    content = study.scene.patched(clip, settings.common, patch, settings.overrides, overrides or {})
    return make_job(content, folder=study.scene.folder)


def _check_different(study: StudyFile, name: str, jobs: Mapping[str, Job], base: Job) -> None:
    """Refuse two levels of a factor that are the same scene."""
    seen: list[tuple[str, Job]] = []
    for level, job in jobs.items():
        plain = job.model_copy(update={"template": base.template})
        twin = next((other for other, before in seen if before == plain), None)
        if twin is not None:
            raise located(
                f"the levels {twin!r} and {level!r} are the same scene; what the scene file says"
                " wins over a template",
                ("factors", name, "levels", level),
                study.source,
            )
        seen.append((level, plain))


def _check_apart(study: StudyFile, one: str, other: str) -> None:
    """Refuse two factors that set the same key: the later one would hide the earlier."""
    first = _keys(study, one)
    for level, patch in study.settings.factors[other].levels.items():
        for path in leaves(patch):
            shared = next((mine for mine in first if _overlap(mine, path)), None)
            if shared is not None:
                raise located(
                    f"the factors {one} and {other} both set {'.'.join(map(str, shared))}; make"
                    " one factor of them, or let each set its own",
                    ("factors", other, "levels", level),
                    study.source,
                )


def _keys(study: StudyFile, factor: str) -> list[KeyPath]:
    """Return all keys that a factor sets."""
    patches: Sequence[Patch] = tuple(study.settings.factors[factor].levels.values())
    return list(dict.fromkeys(path for patch in patches for path in leaves(patch)))


def _overlap(one: KeyPath, other: KeyPath) -> bool:
    """Return whether setting one key also sets the other."""
    shared = min(len(one), len(other))
    return one[:shared] == other[:shared]
