"""Reads study files, and says where in them something is wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from sumo3dviz_pt.catalog import did_you_mean, file_meant
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.trials import Levels, Ranks
from sumo3dviz_pt.files.whole import open_plain
from sumo3dviz_pt.job.errors import Source, explained, located
from sumo3dviz_pt.job.plain import as_path
from sumo3dviz_pt.job.study import StudySettings
from sumo3dviz_pt.job.yaml12 import MOST_TEXT, KeyPath, parse_yaml
from sumo3dviz_pt.pipeline.scene_file import SceneText, read_scene
from sumo3dviz_pt.pipeline.studies.sessions import session_of


@dataclass(frozen=True, slots=True)
class StudyFile:
    """A study file that was read, and its scene file as it stands.

    Attributes:
        settings: Checked.
        source: Where they stand.
        scene: What all stimuli are patches of.
    """

    settings: StudySettings
    source: Source
    scene: SceneText

    @property
    def path(self) -> Path:
        """The study file."""
        assert self.source.file is not None
        return self.source.file

    @property
    def levels(self) -> Levels:
        """The levels of each factor, by its name."""
        return {name: tuple(each.levels) for name, each in self.settings.factors.items()}

    @property
    def ranks(self) -> Ranks:
        """How good the levels of each factor are; empty where the study says nothing of it."""
        found = [
            None if each.better is None else _ranked(tuple(each.levels), each.better)
            for each in self.settings.factors.values()
        ]
        return found if any(found) else ()

    @contextmanager
    def blamed(self, *path: str | int) -> Iterator[None]:
        """Give errors within the `with` statement their place in the study file.

        Args:
            path: The key at fault; default the one that an error names.
        """
        try:
            yield
        except ConfigError as error:
            if error.file is not None and not path:
                raise
            raise _placed(error, path, self.source) from error


def _ranked(levels: Sequence[str], better: str) -> dict[str, int]:
    """Return how good levels are, the best with the highest number."""
    ordered = levels if better == "last" else reversed(levels)
    return {level: rank for rank, level in enumerate(ordered)}


def load_study(path: Path) -> StudyFile:
    """Read a study file and the scene file that it names.

    Args:
        path: The YAML file.

    Raises:
        ConfigError: If one is missing, no YAML, or a setting is wrong; names file, line and key.
    """
    path = as_path(path, key="study")
    content, places = parse_yaml(_text_of(path), file=path)
    source = Source(path, places)
    if not isinstance(content, dict):
        raise ConfigError("a study file is a mapping of keys to values; this is not", file=path)
    if "scenario" in content and "factors" not in content:
        raise ConfigError(
            "is a scene file, not a study file; name it in one under the key scene", file=path
        )
    settings = _settings(content, source)
    _check_exclusions(settings, source)
    if not settings.scene.is_file():
        hint = file_meant(settings.scene)
        raise located(f"there is no scene file {settings.scene}{hint}", ("scene",), source)
    study = StudyFile(settings, source, read_scene(settings.scene))
    with study.blamed():
        session_of(settings, path.parent)
    return study


def _text_of(path: Path) -> str:
    """Return what a study file holds."""
    try:
        with open_plain(path) as stream:
            # A character is four bytes at most.
            return stream.read(4 * MOST_TEXT + 1).decode("utf-8")
    except FileNotFoundError as error:
        hint = file_meant(path)
        raise ConfigError(f"there is no such study file{hint}", file=path) from error
    except OSError as error:
        why = error.strerror or error
        raise ConfigError(f"the study file cannot be read: {why}", file=path) from error
    except UnicodeDecodeError as error:
        raise ConfigError(
            "the study file cannot be read: it is no text in UTF-8; save it as that", file=path
        ) from error


def _settings(content: Mapping[str, Any], source: Source) -> StudySettings:
    """Return checked settings."""
    assert source.file is not None
    try:
        return StudySettings.model_validate(content, context={"folder": source.file.parent})
    except ValidationError as error:
        raise explained(error, StudySettings, source) from error


def _check_exclusions(settings: StudySettings, source: Source) -> None:
    """Refuse exclusions of factors and levels that there are not."""
    for number, combination in enumerate(settings.exclude):
        if not combination:
            raise located("an exclusion names one factor at least", ("exclude", number), source)
        for name, some in combination.items():
            where: KeyPath = ("exclude", number, name)
            if name not in settings.factors:
                hint = did_you_mean(name, settings.factors)
                raise located(f"no factor is called {name!r}{hint}", where, source)
            for level in some:
                if level not in settings.factors[name].levels:
                    hint = did_you_mean(level, settings.factors[name].levels)
                    raise located(f"{name} has no level {level!r}{hint}", where, source)


def _placed(error: ConfigError, path: KeyPath, source: Source) -> ConfigError:
    """Return an error with its place in a study file."""
    own = ":".join(str(part) for part in (error.file, error.line, error.column) if part is not None)
    message = str(error)
    for part in (own, error.key):
        message = message.removeprefix(f"{part}: ") if part else message
    if not path:
        return located(message, _path_of(error.key or "", source), source)
    return located(f"{error.key}: {message}" if error.key else message, path, source)


def _path_of(key: str, source: Source) -> KeyPath:
    """Return the keys that a dotted key means; names in it may hold dots themselves."""
    if not key:
        return ()
    named = (path for path in source.places if ".".join(map(str, path)) == key)
    return next(named, tuple(key.split(".")))
