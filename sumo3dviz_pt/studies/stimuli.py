"""Stimuli: what levels change, which films there are, and which pairs of them are compared.

A level is a patch of a scene file, and no two factors share a key. A study has each film once, by
what it shows, with names for its files.

A pair says in which factors its films should differ. Where films differ in one factor alone, all
such pairs are compared. A fraction, a Latin square or a choice table may have none: then pairs that
differ in as few factors as can be tie all films together, and every factor is judged twice at
least, where the design allows.
"""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.errors import located
from sumo3dviz_pt.job.settings import (
    Job,
    ScenarioSettings,
    ShotSettings,
)
from sumo3dviz_pt.job.study import Patch, StudySettings
from sumo3dviz_pt.job.yaml12 import KeyPath
from sumo3dviz_pt.model.numbers import LayerName
from sumo3dviz_pt.pipeline.provenance import (
    by_role,
    contents,
    differences,
    package_hashes,
    short_names,
    versions,
    with_files,
)
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.pipeline.scene_file import make_job, quality_preset
from sumo3dviz_pt.pipeline.traffic import as_moved
from sumo3dviz_pt.studies.certificate.evidence import COUNTED, LAYERS
from sumo3dviz_pt.studies.designs.trials import Levels, Profile
from sumo3dviz_pt.studies.file import StudyFile

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


_LONGEST_NAME = 100
_NO_NAME = re.compile(r"[^A-Za-z0-9.]+")
_RESERVED = re.compile(r"(?:con|prn|aux|nul|com\d|lpt\d)(?:\..*)?", re.I)
"""Names that Windows keeps for devices."""

_APART = frozenset({"scenario", "template", "shots", "quality"})
"""Keys of a scene that count by content: of files, of presets, of the clip."""


@dataclass(frozen=True, slots=True)
class Stimulus:
    """One film.

    Attributes:
        name: Of its files, without an ending.
        code: The same in twelve letters and digits that tell people nothing.
        job: The scene.
        shot: Camera and times.
        digest: Of all that the film is made from; equal digests are the same film.
        profiles: What it stands for: several where factors are only told.
    """

    name: str
    code: str
    job: Job = field(repr=False)
    shot: ShotSettings
    digest: str
    profiles: tuple[Profile, ...]


def build_stimuli(
    study: StudyFile, profiles: Sequence[Profile], overrides: Patch | None = None
) -> tuple[Stimulus, ...]:
    """Return the films that profiles need, each once, in the order of their first profile.

    Args:
        study: Its patches were checked.
        profiles: Of the design.
        overrides: Values of the scene file that win over all others.

    Raises:
        ConfigError: If a profile is no scene, or has not exactly one shot.
        InputError: If the simulation's files are not there.
    """
    together: dict[str, list[Profile]] = {}
    jobs: dict[str, Job] = {}
    codes: dict[str, str] = {}
    digests = _Digests()
    for profile in profiles:
        with study.blamed("factors"):
            job = job_of(study, profile, overrides)
        digest, code = digests.of(job, _only_shot(study, job))
        codes[digest] = code
        together.setdefault(digest, []).append(profile)
        jobs.setdefault(digest, job)
    names = _names(study, {digest: own[0] for digest, own in together.items()}, codes)
    return tuple(
        Stimulus(
            names[digest],
            codes[digest],
            jobs[digest],
            jobs[digest].shots[0],
            digest,
            tuple(own),
        )
        for digest, own in together.items()
    )


class _Digests:
    """Hashes what films are made from; what many films share is looked up once."""

    def __init__(self) -> None:
        self._files: dict[ScenarioSettings, dict[str, list[list[str]]]] = {}
        self._versions = {"versions": versions(), "package": package_hashes()}

    def of(self, job: Job, shot: ShotSettings) -> tuple[str, str]:
        """Return a hash of all that a film is made from, and a code; files count by content.

        No simulation is read for it: it says which films have to be rendered at all. Whether
        stored frames fit is said by their own keys. Layers lie beside a film and are no part of it.
        The code does not hang on our versions, so that it stays when the program gets better; it
        begins with a letter, as some tools want.
        """
        settings = {key: value for key, value in job.model_dump().items() if key not in _APART}
        settings["output"] = {k: v for k, v in settings["output"].items() if k != "layers"}
        camera = job.cameras.get(shot.camera)
        view = "" if camera is None else camera.preset
        content = {
            "settings": with_files(settings, contents),
            "files": self._scenario(job),
            "choices": [job.scenario.allow_truncated, job.scenario.allow_misfit, view],
            "shot": with_files(shot.model_dump(), str) | {"speed": str(shot.speed)},
            "rate": str(job.output.fps),
            "quality": quality_preset(job.quality, together=True).model_dump(exclude={"purpose"}),
        }
        return _hashed({**content, **self._versions}), f"s{_hashed(content)[:11]}"

    def _scenario(self, job: Job) -> dict[str, list[list[str]]]:
        """Return the hashes of a simulation's files, by what they are."""
        if job.scenario not in self._files:
            self._files[job.scenario] = {
                role: [contents(path) for path in paths]
                for role, paths in by_role(scenario_files(job)).items()
            }
        return self._files[job.scenario]


def _hashed(content: Mapping[str, object]) -> str:
    """Return the SHA-256 of plain values."""
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _only_shot(study: StudyFile, job: Job) -> ShotSettings:
    """Return the shot of a stimulus."""
    if len(job.shots) != 1:
        shots = "no shot" if not job.shots else f"{len(job.shots)} shots"
        with study.blamed("clip" if study.settings.clip else "scene"):
            raise ConfigError(
                f"the scene has {shots}, and a stimulus is one; say in the study file which, such"
                " as clip: {camera: driver, from: 10, to: 13}"
            )
    return job.shots[0]


def _names(
    study: StudyFile, firsts: Mapping[str, Profile], codes: Mapping[str, str]
) -> dict[str, str]:
    """Return names of films by digest: of the levels that they show, or codes."""
    shown = [not told_only(study, factor) for factor in study.settings.factors]
    names = {}
    for digest, profile in firsts.items():
        words = [_slug(level) for level, seen in zip(profile, shown, strict=True) if seen]
        name = "_".join(words)
        coded = study.settings.names == "codes" or not name or len(name) > _LONGEST_NAME
        coded = coded or _RESERVED.fullmatch(name) is not None
        names[digest] = codes[digest] if coded else name
    lowered = Counter(name.lower() for name in names.values())
    return {
        digest: codes[digest] if lowered[name.lower()] > 1 else name
        for digest, name in names.items()
    }


def _slug(level: str) -> str:
    """Return a level as part of a file's name, in letters, digits, dots and hyphens."""
    plain = unicodedata.normalize("NFKD", level).encode("ascii", "ignore").decode()
    return _NO_NAME.sub("-", plain).strip("-.") or hashlib.sha256(level.encode()).hexdigest()[:6]


Places = Mapping[str, int]
"""Where factors stand in profiles, of those that change a picture."""

_TIMES = 2
"""How often each factor is judged at least, where the design has so many pairs."""


@dataclass(frozen=True, slots=True)
class StimulusPair:
    """Two films that should differ in their factors only.

    Attributes:
        factor: Name of the factor in which they differ; of several, with `and` between them.
        levels: Of the first and the second.
        one: The first film's name.
        other: The second's.
        changed: What differs in their scenes, key by key.
        acting: The same, rides under the id of the one that is moved for them.
        factors: Names of the factors in which they differ, one by one.
    """

    factor: str
    levels: tuple[str, str]
    one: str
    other: str
    changed: tuple[str, ...]
    acting: tuple[str, ...]
    factors: tuple[str, ...]


def pairs_of(
    levels: Levels, stimuli: Sequence[Stimulus], *, worded: Collection[str] = ()
) -> tuple[StimulusPair, ...]:
    """Return the pairs of films that are compared, by factor and levels.

    Args:
        levels: Of each factor, in the order of the profiles.
        stimuli: All films.
        worded: Factors that change no picture.
    """
    places = {name: n for n, name in enumerate(levels) if name not in worded}
    film = {profile: stimulus for stimulus in stimuli for profile in stimulus.profiles}
    pairs: dict[tuple[str, str, str], StimulusPair] = {}
    for factor, place in places.items():
        order = {level: n for n, level in enumerate(levels[factor])}
        for pair in _neighbours(list(film), place):
            one, other = _in_order(pair, place, order)
            key = (factor, film[one].name, film[other].name)
            if film[one] is not film[other] and key not in pairs:
                pairs[key] = _pair(places, film, one, other)
    alone = tuple(pairs.values())
    return alone + tuple(_pair(places, film, *pair) for pair in _tying(places, film, alone))


def possible_pairs(stimuli: Sequence[Stimulus]) -> int:
    """Return how many pairs of films there are."""
    return len(stimuli) * (len(stimuli) - 1) // 2


def _pair(
    places: Places, film: Mapping[Profile, Stimulus], one: Profile, other: Profile
) -> StimulusPair:
    """Return the pair of two profiles' films."""
    factors = _differing(places, one, other)
    words = tuple(
        " and ".join(profile[place] for place in factors.values()) for profile in (one, other)
    )
    first, second = film[one], film[other]
    changed = changes(first, second)
    return StimulusPair(
        " and ".join(factors),
        (words[0], words[1]),
        first.name,
        second.name,
        tuple(changed),
        tuple(as_moved(change, (first.job, second.job)) for change in changed),
        tuple(factors),
    )


def _differing(places: Places, one: Profile, other: Profile) -> dict[str, int]:
    """Return in which factors two profiles differ, and their places."""
    return {name: n for name, n in places.items() if one[n] != other[n]}


def _tying(
    places: Places, film: Mapping[Profile, Stimulus], pairs: Sequence[StimulusPair]
) -> list[tuple[Profile, Profile]]:
    """Return pairs, the nearest first, that tie all films together and judge each factor twice.

    Args:
        places: Of factors in profiles.
        film: By profile.
        pairs: That are compared already.
    """
    groups = {each.name: each.name for each in film.values()}
    known, times = {frozenset((pair.one, pair.other)) for pair in pairs}, Counter[str]()
    for pair in pairs:
        times.update(pair.factors)
        groups[_root(groups, pair.one)] = _root(groups, pair.other)
    chosen = []
    for only_ties in (True, False):
        if all(times[name] >= _TIMES for name in places) and _is_one(groups):
            break
        for one, other in _by_distance(list(film), list(places.values())):
            names, own = (film[one].name, film[other].name), _differing(places, one, other)
            first, second = (_root(groups, name) for name in names)
            few = not only_ties and any(times[name] < _TIMES for name in own)
            if frozenset(names) not in known and (first != second or few):
                known.add(frozenset(names))
                times.update(list(own))
                groups[first] = second
                chosen.append((one, other))
    return chosen


def _root(groups: Mapping[str, str], name: str) -> str:
    """Return the film that stands for all that a film is tied to."""
    while groups[name] != name:
        name = groups[name]
    return name


def _is_one(groups: Mapping[str, str]) -> bool:
    """Return whether all films are tied together."""
    return len({_root(groups, name) for name in groups}) <= 1


def _by_distance(
    profiles: Sequence[Profile], places: Sequence[int]
) -> Iterator[tuple[Profile, Profile]]:
    """Yield all pairs of profiles, those that differ in the fewest factors first."""
    table = np.array(profiles)[:, places]
    far = [(table[n + 1 :] != table[n]).sum(axis=1) for n in range(len(table) - 1)]
    if not far:
        return
    ends = np.array(list(combinations(range(len(table)), 2)))
    for one, other in ends[np.argsort(np.concatenate(far), kind="stable")].tolist():
        yield profiles[one], profiles[other]


def changes(one: Stimulus, other: Stimulus) -> list[str]:
    """Return what differs in the scenes of two films, key by key."""
    files = short_names(path for each in (one, other) for path in _files(each))
    first, second = (
        {"scene": with_files(each.job.model_dump(by_alias=True), files.__getitem__)}
        for each in (one, other)
    )
    return differences(first, second)


def _files(stimulus: Stimulus) -> list[Path]:
    """Return the files that a scene names."""
    paths: dict[Path, None] = {}
    with_files(stimulus.job.model_dump(by_alias=True), lambda path: paths.setdefault(path))
    return list(paths)


def _neighbours(profiles: Sequence[Profile], place: int) -> list[tuple[Profile, Profile]]:
    """Return all pairs of profiles that differ at one place and nowhere else."""
    alike: dict[Profile, list[Profile]] = {}
    for profile in profiles:
        alike.setdefault((*profile[:place], *profile[place + 1 :]), []).append(profile)
    return [pair for some in alike.values() for pair in combinations(some, 2)]


def _in_order(
    pair: tuple[Profile, Profile], place: int, order: Mapping[str, int]
) -> tuple[Profile, Profile]:
    """Return the profile with the earlier level first."""
    one, other = pair
    return pair if order[one[place]] < order[other[place]] else (other, one)
