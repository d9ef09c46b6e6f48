"""Reads scene files, and knows the names that their keys take.

YAML, template, overrides -> a validated `Job`. Names are listed for help, completion and editors;
names that nothing has are found: presets, surfaces, codecs, tone curves, cameras.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.files.atomic import open_plain
from sumo3dviz_pt.files.forms import SCHEMA_VERSION
from sumo3dviz_pt.job.errors import Source, explained, located, reason
from sumo3dviz_pt.job.renamed import with_present_names
from sumo3dviz_pt.job.settings import SCENE_FILE, CameraSettings, Job, Quality
from sumo3dviz_pt.job.yaml12 import MOST_TEXT, KeyPath, as_path, parse_yaml, plain

FILE = "scene.schema.json"
"""What the schema is called beside a scene file."""

LINE = f"# yaml-language-server: $schema={FILE}"
"""A line of a scene file by which editors find the schema."""


def _codecs() -> Sequence[str]:
    from sumo3dviz_pt.video.codecs import AUTO, CODECS

    return (AUTO, *CODECS)


def _tones() -> Sequence[str]:
    from sumo3dviz_pt.image.tonemap import tone_names

    return tone_names()


def _responses() -> Sequence[str]:
    from sumo3dviz_pt.image.response import response_names

    return response_names()


def _smoothers() -> Sequence[str]:
    from sumo3dviz_pt.motion import smoother_names

    return smoother_names()


def _vehicles(vclass: str = "") -> Sequence[str]:
    """Return the vehicles that can be drawn, of one vClass if given; no parts of vehicles."""
    names = []
    for name in catalog.names("vehicles"):
        classes = catalog.find("vehicles", name).meta.get("vclass", "passenger")
        classes = [classes] if isinstance(classes, str) else classes
        if vclass in classes or (classes and not vclass):
            names.append(name)
    return names


def _models() -> Sequence[str]:
    return (*_vehicles(), *catalog.names("people"))


def _vclasses() -> Sequence[str]:
    from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS

    return tuple(CLASS_DEFAULTS)


NAMES: Mapping[str, Callable[[], Sequence[str]]] = MappingProxyType(
    {
        "quality": partial(catalog.template_names, "quality"),
        "template": partial(catalog.template_names, "scene"),
        "sky.preset": partial(catalog.template_names, "sky"),
        "weather.preset": partial(catalog.template_names, "weather"),
        "cameras.NAME.view": partial(catalog.template_names, "camera"),
        "output.codec": _codecs,
        "output.tone": _tones,
        "output.response": _responses,
        "motion.smoother": _smoothers,
        "ground.texture": partial(catalog.names, "surfaces"),
        "vehicles.types.NAME": _vclasses,
        "vehicles.passenger": partial(_vehicles, "passenger"),
        "vehicles.by_id.NAME.model": _models,
    }
)
"""Names by the key of the scene file that takes them."""


def names_for(key: str) -> tuple[str, ...]:
    """Return what a key of the scene file can be set to; nothing where that is no list of names."""
    return tuple(NAMES[key]()) if key in NAMES else ()


Unknown = tuple[KeyPath, str]
"""Where a name stands, and what is wrong with it."""


@dataclass(frozen=True, slots=True)
class _Named:
    """A name that a setting refers to.

    Attributes:
        path: Where it stands.
        name: The name itself.
        what: What it should be the name of.
        known: All names of such things.
    """

    path: KeyPath
    name: str
    what: str
    known: Collection[str]


def unknown_names(job: Job) -> Iterator[Unknown]:
    """Yield every name of a job that nothing has; nothing heavy is loaded for it."""
    for named in _named(job):
        if named.name not in named.known:
            hint = catalog.did_you_mean(named.name, named.known)
            yield named.path, f"no {named.what} is called {named.name!r}{hint}"
    yield from _unknown_looks(job)


def _named(job: Job) -> Iterator[_Named]:
    """Yield all names but those of vehicles and people."""
    yield _Named(("quality",), job.quality, "quality preset", names_for("quality"))
    yield _Named(("output", "codec"), job.output.codec, "codec", names_for("output.codec"))
    yield _Named(("output", "tone"), job.output.tone, "tone curve", names_for("output.tone"))
    yield from _presets(job)
    classes = names_for("vehicles.types.NAME") if job.vehicles.types else ()
    for type_id, vclass in job.vehicles.types.items():
        yield _Named(("vehicles", "types", type_id), vclass, "vClass of SUMO", classes)
    for name, camera in job.cameras.items():
        if camera.preset:
            views = names_for("cameras.NAME.view")
            yield _Named(("cameras", name, "view"), camera.preset, "camera preset", views)
    for index, shot in enumerate(job.shots):
        yield _Named(("shots", index, "camera"), shot.camera, "camera", tuple(job.cameras))
    for path, surface in _surfaces(job):
        if not (surface.startswith("#") or Path(surface).suffix):
            yield _Named(path, surface, "surface", names_for("ground.texture"))


def _presets(job: Job) -> Iterator[_Named]:
    """Yield the names of presets of sky and weather."""
    for what, settings in (("sky", job.sky), ("weather", job.weather)):
        if settings is not None and settings.preset is not None:
            known = names_for(f"{what}.preset")
            yield _Named((what, "preset"), settings.preset, f"{what} preset", known)


def _unknown_looks(job: Job) -> Iterator[Unknown]:
    """Yield the models that are given to single road users and do not exist."""
    vehicles, people = catalog.names("vehicles"), catalog.names("people")
    for pattern, look in job.vehicles.by_id.items():
        place, name = ("vehicles", "by_id", pattern, "model"), look.model
        if name is not None and name not in (*vehicles, *people):
            hint = catalog.did_you_mean(name, (*vehicles, *people))
            yield place, f"no model of a vehicle or person is called {name!r}{hint}"
        if name in vehicles and not catalog.find("vehicles", name).meta.get("vclass", True):
            yield place, f"{name!r} is only a part of other vehicles"


def _surfaces(job: Job) -> Iterator[tuple[KeyPath, str]]:
    """Yield where surfaces are named, and which."""
    yield ("ground", "texture"), job.ground.texture
    yield ("roads", "surface"), job.roads.surface
    for pattern, style in job.roads.per_edge.items():
        if style.surface is not None:
            yield ("roads", "per_edge", pattern, "surface"), style.surface


@dataclass(frozen=True, slots=True)
class SceneText:
    """A scene file as it stands: without its template, unchecked.

    Attributes:
        settings: As written.
        source: Where they stand.
    """

    settings: Mapping[str, Any]
    source: Source

    @property
    def folder(self) -> Path:
        """What relative paths refer to."""
        return self.source.file.parent if self.source.file else Path()

    def patched(self, *patches: Mapping[str, Any]) -> dict[str, Any]:
        """Return the settings with values laid over them, by dotted key, the last on top.

        Args:
            patches: A mapping changes the keys that it holds and leaves the others, but for a sky
                and a camera with its mode, which it replaces.

        Raises:
            ConfigError: If a key cannot stand where it is.
        """
        settings = copy.deepcopy(dict(self.settings))
        for patch in patches:
            for key, value in patch.items():
                _set(settings, key, value)
        return settings


def read_scene(path: Path) -> SceneText:
    """Read a scene file as it stands.

    Raises:
        ConfigError: If the file is missing, no YAML or no mapping.
    """
    path = as_path(path, key="scene")
    content, places = parse_yaml(_text_of(path), file=path)
    if not isinstance(content, dict):
        raise ConfigError("a scene file is a mapping of keys to values; this is not", file=path)
    if "factors" in content and "scenario" not in content:
        raise ConfigError(
            f"is a study file, not a scene file; render it with: sumo3dviz-pt study {path}"
            f" -o {path.stem}",
            file=path,
        )
    source = Source(path, places)
    return SceneText(_understood(content, source), source)


def load_job(path: Path, overrides: Mapping[str, Any] | None = None) -> Job:
    """Read a scene file.

    Args:
        path: The YAML file.
        overrides: Values by dotted key; they win over the file. Text is YAML, everything else
            is taken as it is. A mapping changes the keys that it holds and leaves the others,
            but for a sky and a camera with its mode, which it replaces.

    Raises:
        ConfigError: If the file is missing, no YAML, or holds a wrong setting.
    """
    scene = read_scene(path)
    patch = override_values(overrides)
    return make_job(scene.patched(patch), folder=scene.folder, source=scene.source)


def override_values(overrides: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return what overrides mean, by dotted key: text is YAML, all else is taken as it is.

    Raises:
        ConfigError: If they are no overrides, or a text is no YAML.
    """
    values = {key: _value_of(key, value) for key, value in checked_overrides(overrides).items()}
    return with_present_names(values)


def _understood(settings: Mapping[str, Any], source: Source) -> dict[str, Any]:
    """Return settings in the form of this version, by which older ones meant the same.

    Raises:
        ConfigError: If they are of a newer version.
    """
    if problem := SCENE_FILE.problem(settings):
        raise located(problem, (SCHEMA_VERSION,), source)
    return with_present_names(SCENE_FILE.current(settings, source.file))


def make_job(
    settings: Mapping[str, Any], *, folder: Path | None = None, source: Source | None = None
) -> Job:
    """Validate settings laid over their template.

    Args:
        settings: As in a scene file.
        folder: What relative paths refer to; default the working directory.
        source: Where the settings stand, for messages.

    Raises:
        ConfigError: If a setting is wrong; names the key, and the line if known.
    """
    source = source or Source(None, {})
    settings = _understood(plain(settings), source)
    name = settings.get("template", Job.model_fields["template"].default)
    try:
        template = catalog.template("scene", str(name))
    except ConfigError as error:
        raise located(str(error), ("template",), source) from error
    merged = _on_weather_preset(_merged(template, settings))
    try:
        job = Job.model_validate(merged, context={"folder": folder or Path()})
    except ValidationError as error:
        raise explained(error, Job, source) from error
    unknown = list(unknown_names(job))
    if unknown:
        where, message = unknown[0]
        more = f" (and {len(unknown) - 1} more)" if len(unknown) > 1 else ""
        raise located(message + more, where, source)
    return job


def quality_preset(name: str, *, spp: int | None = None, together: bool = False) -> Quality:
    """Return a quality preset, with another number of samples if asked.

    Args:
        name: The preset's.
        spp: Samples per pixel instead of the preset's.
        together: Whether it is for frames of a film, which may help each other; only what our own
            kernel traces can.

    Raises:
        ConfigError: If there is no such preset, or the number is out of range.
    """
    if name not in catalog.template_names("quality"):
        hint = catalog.did_you_mean(name, catalog.template_names("quality"))
        raise ConfigError(f"no quality preset is called {name!r}{hint}", key="quality")
    values = dict(catalog.template("quality", name))
    if spp is not None:
        values |= {"spp": spp, "alone": None}
    try:
        quality = Quality.model_validate(values)
    except ValidationError as error:
        raise ConfigError(reason(error.errors()[0]), key="spp") from error
    return quality if together and quality.tracer == "kernel" else quality.by_itself


def camera_settings(job: Job, name: str | None) -> tuple[str, CameraSettings]:
    """Return a camera by name; the first shot's or the first camera when no name is given.

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


# The file ----------------------------------------------------------------------------------

_SIMULATION = {
    "net": "a network of SUMO",
    "fcd-export": "a vehicle log of SUMO",
    "tlsStates": "a signal log of SUMO",
    "configuration": "a configuration of SUMO",
    "sumoConfiguration": "a configuration of SUMO",
}
"""Files of a simulation that users mistake for scene files, by their root element."""


def _text_of(path: Path) -> str:
    """Return what a scene file holds.

    Raises:
        ConfigError: If it is missing, no text, or something of the simulation.
    """
    try:
        if path.is_dir():
            raise _no_scene(path, "a folder", path)
        with open_plain(path) as stream:
            # A character is four bytes at most; whole vehicle logs are not read.
            data = stream.read(4 * MOST_TEXT + 1)
    except FileNotFoundError as error:
        hint = catalog.file_meant(path)
        raise ConfigError(f"there is no such scene file{hint}", file=path) from error
    except OSError as error:
        why = error.strerror or error
        raise ConfigError(f"the scene file cannot be read: {why}", file=path) from error
    if data[:2] == b"\x1f\x8b" or data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<":
        from sumo3dviz_pt.sumo.stream import root_of

        what = _SIMULATION.get(root_of(path) or "", "a file of a simulation")
        own = "configuration" in what
        raise _no_scene(path, what, path if own else path.parent)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ConfigError(
            "the scene file cannot be read: it is no text in UTF-8; save it as that", file=path
        ) from error


def _no_scene(path: Path, what: str, place: Path) -> ConfigError:
    """Say how to get a scene file, or that one lies in the folder that was named."""
    if len(scenes := sorted(path.glob("scene*.yaml"))) == 1:
        return ConfigError(f"is {what}; its scene file is {scenes[0]}", file=path)
    return ConfigError(
        f"is {what}, not a scene file; write one with: sumo3dviz-pt init {place}", file=path
    )


# Laying one over the other -----------------------------------------------------------------


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Lay one mapping over another, key by key."""
    result = copy.deepcopy(dict(base))
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, Mapping) and isinstance(value, Mapping) and _adds(key, value):
            result[key] = _merged(below, value)
        else:
            result[key] = copy.deepcopy(value)
    return result


def _on_weather_preset(settings: dict[str, Any]) -> dict[str, Any]:
    """Lay the weather over its preset; names that no preset has are told with all others."""
    weather = settings.get("weather")
    name = weather.get("preset") if isinstance(weather, Mapping) else None
    if not isinstance(name, str) or name not in catalog.template_names("weather"):
        return settings
    return {**settings, "weather": _merged(catalog.template("weather", name), weather or {})}


def _adds(key: str, value: Mapping[str, Any]) -> bool:
    """Return whether a mapping adds to what is there.

    A sky or a camera given in another way replaces the one below, it does not mix with it.
    """
    return key != "sky" and "mode" not in value


def checked_overrides(overrides: Any) -> Mapping[str, Any]:
    """Overrides, if they are some.

    Raises:
        ConfigError: If they are none.
    """
    if overrides is None:
        return {}
    if not isinstance(overrides, Mapping) or not all(isinstance(key, str) for key in overrides):
        raise ConfigError(
            f"overrides are values by dotted key, such as {{'output.fps': 30}},"
            f" not {cut(repr(overrides))}"
        )
    return overrides


def _value_of(key: str, value: Any) -> Any:
    """Return what an override means."""
    if not isinstance(value, str):
        return plain(value, key=key)
    try:
        return parse_yaml(value)[0]
    except ConfigError as error:
        # Line and column of a single value say nothing.
        raise ConfigError(str(error).lstrip("0123456789: "), key=key) from error


def _set(content: dict[str, Any], key: str, value: Any) -> None:
    """Set a value by its dotted key."""
    *parents, last = key.split(".")
    here: Any = content
    for parent in parents:
        if isinstance(here, list):
            here = here[_position(parent, here, key)]
            continue
        if here.get(parent) is None:
            here[parent] = {}
        here = here[parent]
        if not isinstance(here, dict | list):
            raise ConfigError(f"{parent!r} holds a value, not further keys", key=key)
    if isinstance(here, list):
        here[_position(last, here, key)] = value
    elif isinstance(here, dict):
        here[last] = _merged({last: here.get(last)}, {last: value})[last]
    else:
        raise ConfigError(f"{parents[-1]!r} holds a value, not further keys", key=key)


def _position(word: str, items: list[Any], key: str) -> int:
    """Return an index into a list, by its number."""
    if not (word.isdecimal() and len(word) < 6 and int(word) < len(items)):
        raise ConfigError(f"{word!r} is no place in a list of {len(items)}", key=key)
    return int(word)
