"""Reads scene files: YAML, template, overrides -> a validated `Job`."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job import CameraSettings, Job, Quality
from sumo3dviz_pt.yaml12 import KeyPath, Places, parse_yaml


@dataclass(frozen=True, slots=True)
class _Source:
    """Where settings came from, for messages."""

    file: Path | None
    places: Places


def load_job(path: Path, overrides: Mapping[str, str] | None = None) -> Job:
    """Read a scene file.

    Args:
        path: The YAML file.
        overrides: YAML values by dotted key; they win over the file.

    Raises:
        ConfigError: If the file is missing, no YAML, or holds a wrong setting.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ConfigError("there is no such scene file", file=path) from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"the scene file cannot be read: {error}", file=path) from error
    content, places = parse_yaml(text, file=path)
    if not isinstance(content, dict):
        raise ConfigError("a scene file is a mapping of keys to values; this is not", file=path)
    for key, value in (overrides or {}).items():
        _set(content, key, parse_yaml(value)[0])
    return make_job(content, folder=path.parent, source=_Source(path, places))


def make_job(
    settings: Mapping[str, Any], *, folder: Path | None = None, source: _Source | None = None
) -> Job:
    """Validate settings laid over their template.

    Args:
        settings: As in a scene file.
        folder: What relative paths refer to; default the working directory.
        source: Where the settings stand, for messages.

    Raises:
        ConfigError: If a setting is wrong; names the key, and the line if known.
    """
    source = source or _Source(None, {})
    name = settings.get("template", Job.model_fields["template"].default)
    try:
        template = catalog.template("scene", str(name))
    except ConfigError as error:
        raise _located(str(error), ("template",), source) from error
    merged = _merged(template, settings)
    try:
        job = Job.model_validate(merged, context={"folder": folder or Path()})
    except ValidationError as error:
        raise _explained(error, source) from error
    _check_names(job, source)
    return job


def quality_preset(name: str, *, spp: int | None = None) -> Quality:
    """A quality preset, with another number of samples if asked.

    Raises:
        ConfigError: If there is no such preset, or the number is out of range.
    """
    values = dict(catalog.template("quality", name))
    if spp is not None:
        values["spp"] = spp
    try:
        return Quality.model_validate(values)
    except ValidationError as error:
        raise ConfigError(_reason(error.errors()[0]), key="spp") from error


def _check_names(job: Job, source: _Source) -> None:
    """Names that settings refer to must exist."""
    if job.quality not in catalog.template_names("quality"):
        hint = catalog.did_you_mean(job.quality, catalog.template_names("quality"))
        raise _located(f"no quality preset is called {job.quality!r}{hint}", ("quality",), source)
    for index, shot in enumerate(job.shots):
        if shot.camera not in job.cameras:
            hint = catalog.did_you_mean(shot.camera, job.cameras)
            message = f"no camera is called {shot.camera!r}{hint}"
            raise _located(message, ("shots", index, "camera"), source)


def camera_settings(job: Job, name: str | None) -> tuple[str, CameraSettings]:
    """A camera by name; the first shot's or the first camera when no name is given.

    Raises:
        ConfigError: If there is no such camera.
    """
    if name is None:
        name = job.shots[0].camera if job.shots else next(iter(job.cameras), None)
    if name is None:
        raise ConfigError("the scene has no cameras; add one", key="cameras")
    if name not in job.cameras:
        hint = catalog.did_you_mean(name, job.cameras)
        raise ConfigError(f"no camera is called {name!r}{hint}", key="camera")
    return name, job.cameras[name]


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Lay one mapping over another, key by key."""
    result = copy.deepcopy(dict(base))
    for key, value in over.items():
        below = result.get(key)
        # A sky given in another way replaces the template's, it does not mix with it.
        if isinstance(below, Mapping) and isinstance(value, Mapping) and key != "sky":
            result[key] = _merged(below, value)
        else:
            result[key] = copy.deepcopy(value)
    return result


def _set(content: dict[str, Any], key: str, value: Any) -> None:
    """Set a value by its dotted key."""
    *parents, last = key.split(".")
    here: Any = content
    for parent in parents:
        if isinstance(here, list):
            here = here[_position(parent, here, key)]
            continue
        here = here.setdefault(parent, {})
        if not isinstance(here, dict | list):
            raise ConfigError(f"{parent!r} holds a value, not further keys", key=key)
    if isinstance(here, list):
        here[_position(last, here, key)] = value
    else:
        here[last] = value


def _position(word: str, items: list[Any], key: str) -> int:
    """An index into a list, by its number."""
    if not word.isdigit() or int(word) >= len(items):
        raise ConfigError(f"{word!r} is no place in a list of {len(items)}", key=key)
    return int(word)


def _explained(error: ValidationError, source: _Source) -> ConfigError:
    """The first problem as one sentence, with its place and the number of others."""
    # A misspelt key that is required is also missing; its spelling explains both.
    first, *others = sorted(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    path = tuple(part for part in first["loc"] if not _is_branch(part))
    message = _reason(first)
    if first["type"] == "extra_forbidden":
        message = "this key is unknown" + catalog.did_you_mean(
            str(path[-1]), _siblings(first["loc"])
        )
    if others:
        message += f" (and {len(others)} more)"
    return _located(message, path, source)


def _is_branch(part: str | int) -> bool:
    """Whether a part of pydantic's location names a branch of a union, not a key."""
    return isinstance(part, str) and (
        part in ("eulerian", "lagrangian", "cinematic") or "[" in part or part in ("float", "tuple")
    )


def _reason(problem: Mapping[str, Any]) -> str:
    """Pydantic's message in our words."""
    text = str(problem["msg"])
    text = text.removeprefix("Value error, ")
    text = text.replace("Input should be", "this should be").replace(
        "Field required", "this key is missing"
    )
    value = problem.get("input")
    if isinstance(value, str | int | float | bool) and problem["type"] != "value_error":
        text += f", not {value!r}"
    return text


def _siblings(location: tuple[str | int, ...]) -> list[str]:
    """Keys that are known where an unknown one stands."""
    model: Any = Job
    for part in location[:-1]:
        model = _descend(model, part)
        if model is None:
            return []
    return _keys(model)


def _keys(model: Any) -> list[str]:
    """Names that a model takes."""
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        return []
    return [field.alias or name for name, field in model.model_fields.items()]


def _descend(model: Any, part: str | int) -> Any:
    """The model behind one part of a location."""
    from typing import get_args, get_origin

    if isinstance(part, int):
        return model
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        options = _models(model)
        named = [m for m in options if isinstance(part, str) and _mode(m) == part]
        return named[0] if named else (options[0] if len(options) == 1 else model)
    field = model.model_fields.get(str(part))
    if field is None:
        return None
    models = _models(field.annotation)
    if len(models) == 1 and get_origin(field.annotation) is not dict:
        return models[0]
    return get_args(field.annotation) or None


def _models(annotation: Any) -> list[Any]:
    """All models inside an annotation."""
    from typing import get_args

    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    parts = annotation if isinstance(annotation, tuple) else get_args(annotation)
    return [model for part in parts for model in _models(part)]


def _mode(model: Any) -> str | None:
    """The word that chooses a model out of a union."""
    from typing import get_args

    field = model.model_fields.get("mode")
    words = get_args(field.annotation) if field is not None else ()
    return words[0] if words else None


def _located(message: str, path: KeyPath, source: _Source) -> ConfigError:
    """An error with the nearest place that the file knows."""
    place = next(
        (source.places[path[:n]] for n in range(len(path), 0, -1) if path[:n] in source.places),
        (None, None),
    )
    key = ".".join(map(str, path)) or None
    return ConfigError(message, key=key, file=source.file, line=place[0], column=place[1])
