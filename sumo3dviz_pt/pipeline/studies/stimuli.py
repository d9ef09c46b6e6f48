"""Stimuli: the films of a study, each once by what it shows, with names for their files."""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.trials import Profile
from sumo3dviz_pt.job.settings import Job, LagrangianCamera, ScenarioSettings, ShotSettings
from sumo3dviz_pt.job.study import Patch
from sumo3dviz_pt.pipeline.accounts.provenance import (
    by_role,
    contents,
    package_hashes,
    versions,
    with_files,
)
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.pipeline.studies.file import StudyFile
from sumo3dviz_pt.pipeline.studies.patches import job_of, told_only

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
        view = camera.view if isinstance(camera, LagrangianCamera) else ""
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
        found = "no shot" if not job.shots else f"{len(job.shots)} shots"
        with study.blamed("clip" if study.settings.clip else "scene"):
            raise ConfigError(
                f"the scene has {found}, and a stimulus is one; say in the study file which, such"
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
