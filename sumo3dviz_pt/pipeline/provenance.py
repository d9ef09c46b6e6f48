"""Hashes what pixels depend on, and says in words what differs between two accounts.

Pixels depend on input files (by content), on our own code and library, and on versions.
"""

from __future__ import annotations

import datetime as dt
import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sumo3dviz_pt.catalog import data_root, template_file
from sumo3dviz_pt.files.forms import Form
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.surroundings import TrafficSettings, WeatherSettings
from sumo3dviz_pt.library.vehicles.user_mesh import companions
from sumo3dviz_pt.model.traffic import ScenarioFiles

ROLES = ("network", "trajectories", "signals", "additional", "vehicle_types")
"""What a simulation's files are, as in `ScenarioFiles`."""

_PACKAGES = (
    *("sumo3dviz_pt", "mitsuba", "drjit", "mitsuba-oidn", "numpy", "scipy", "shapely"),
    *("trimesh", "mapbox-earcut", "colour-science", "OpenEXR"),
)
_NO_PIXELS = frozenset(
    {
        "_data",
        "cli",
        "farm",
        "inspection",
        "overlays",
        "proposals",
        "recording",
        "report",
        "studies",
        "video",
        "viewer",
    }
)
"""Parts of the package that no stored frame depends on."""

_TEXT = frozenset({".py", ".yaml"})
_PICTURES = frozenset({".png", ".jpg", ".jpeg", ".exr", ".hdr", ".tga", ".bmp"})


@dataclass(frozen=True, slots=True)
class Inputs:
    """The files that a scene is made from.

    Attributes:
        names: The shortest end of each path that tells the files apart, by path.
        hashes: SHA-256 of the content by that name; empty for a file that does not exist.
    """

    names: Mapping[Path, str]
    hashes: Mapping[str, str]

    def name(self, path: Path) -> str:
        """Return what a file, or a folder, is called."""
        return self.names.get(path, path.name)

    @property
    def companions(self) -> dict[str, list[str]]:
        """What the files are called that others refer to, by what these are called."""
        beside = {name: map(self.name, companions(path)) for path, name in self.names.items()}
        return {name: sorted(some) for name, each in beside.items() if (some := list(each))}

    def content(self, path: Path) -> list[str]:
        """Return the hashes of a file and of all that it refers to."""
        return [self.hashes.get(self.name(each), "") for each in (path, *companions(path))]


def inputs_of(job: Job, files: ScenarioFiles, *, camera: str) -> Inputs:
    """Hash all files that a scene is made from, those behind other files and presets too.

    Args:
        job: The scene file.
        files: The simulation's.
        camera: The camera's name.
    """
    paths = files_of(job, files)
    names = short_names(path for path in paths if not path.is_dir())
    presets = _presets(job, camera)
    hashes = {name: file_hash(path) for path, name in names.items()}
    return Inputs(names, hashes | {name: file_hash(path) for name, path in presets.items()})


def files_of(job: Job, files: ScenarioFiles) -> list[Path]:
    """Return all files that a scene is made from, those behind other files, too."""
    paths: dict[Path, None] = dict.fromkeys(path for role in ROLES for path in by_role(files)[role])
    with_files(job.model_dump(), paths.setdefault)
    for path in tuple(paths):
        paths |= dict.fromkeys(companions(path))
    return list(paths)


def by_role(files: ScenarioFiles) -> dict[str, tuple[Path, ...]]:
    """Return a simulation's files by what they are, in the order in which they are read."""
    return {role: (files.network,) if role == "network" else getattr(files, role) for role in ROLES}


def with_files(value: Any, change: Callable[[Path], Any]) -> Any:
    """Return settings as plain values for JSON, with something else in the place of every file.

    Args:
        value: As `model_dump` gives it. Words that end like a picture's name are files, too.
        change: What to put there.
    """
    if isinstance(value, Mapping):
        return {str(key): with_files(item, change) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [with_files(item, change) for item in value]
    if isinstance(value, str) and Path(value).suffix.lower() in _PICTURES:
        return change(Path(value))
    if isinstance(value, dt.date | dt.time):
        return value.isoformat()
    return change(value) if isinstance(value, Path) else value


def versions() -> dict[str, str]:
    """Return the versions of what pixels depend on."""
    known = {}
    for name in _PACKAGES:
        try:
            known[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            known[name] = "source"
    return known


@cache
def package_hashes() -> dict[str, str]:
    """Hash our own code and the library's files: a checkout changes within a version."""
    own = Path(__file__).resolve().parents[1]
    code = (path for path in own.rglob("*.py") if path.relative_to(own).parts[0] not in _NO_PIXELS)
    assets, templates = data_root("assets"), data_root("scene_templates")
    library = (path for root in (assets, templates) for path in root.rglob("*") if path.is_file())
    return {"code": _hash_all(code, own), "library": _hash_all(library, assets.parent)}


@cache
def code_of(part: str) -> str:
    """Hash the code of a part of the package, such as `studies`: it words what that part writes."""
    own = Path(__file__).resolve().parents[1]
    return _hash_all((own / part).rglob("*.py"), own)


def _hash_all(paths: Iterable[Path], root: Path) -> str:
    """Return one hash of many files; ends of lines do not count in text."""
    whole = hashlib.blake2b(digest_size=16)
    for name, path in sorted((path.relative_to(root).as_posix(), path) for path in paths):
        content = path.read_bytes()
        if path.suffix in _TEXT:
            content = content.replace(b"\r\n", b"\n")
        whole.update(f"{name}\0{len(content)}\0".encode() + content)
    return whole.hexdigest()


def contents(path: Path) -> list[str]:
    """Return the hashes of a file and of all that it refers to, as long as they stay the same."""
    return [_cached_hash(each, *_stamp(each)) for each in (path, *companions(path))]


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file; empty if it does not exist."""
    if not path.is_file():
        return ""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _stamp(path: Path) -> tuple[int, int]:
    """Return what changes when a file does."""
    if not path.is_file():
        return (0, 0)
    status = path.stat()
    return (status.st_mtime_ns, status.st_size)


@cache
def _cached_hash(path: Path, changed: int, size: int) -> str:
    """Return a file's hash; large files are read once."""
    del changed, size
    return file_hash(path)


def short_names(paths: Iterable[Path]) -> dict[Path, str]:
    """Return the shortest end of each path that no other path has."""
    parts = {path: path.absolute().parts for path in paths}

    def alone(own: tuple[str, ...], count: int) -> bool:
        return not any(o[-count:] == own[-count:] for o in parts.values() if o != own)

    return {
        path: "/".join(own[-next(n for n in range(1, len(own) + 1) if alone(own, n)) :])
        for path, own in parts.items()
    }


def _presets(job: Job, camera: str) -> dict[str, Path]:
    """Return the files of the presets that a scene names, by name."""
    view = job.cameras[camera]
    named = {"scene": job.template, "quality": job.quality, "sky": job.sky.preset}
    if view.preset:
        named["camera"] = view.preset
    return {
        f"scene_templates/{kind}/{name}.yaml": template_file(kind, name)
        for kind, name in named.items()
        if name is not None
    }


Account = Mapping[str, Any]


def _with_ratios(account: Account) -> tuple[Account, str]:
    """Return an account that tells its frame rate as a ratio, too: version 1 need not."""
    parts = {"": account, "shot": account.get("shot")}
    rates = {
        part: {**content, "frame_rate": str(content["fps"])}
        for part, content in parts.items()
        if isinstance(content, Mapping) and "fps" in content and "frame_rate" not in content
    }
    if not rates:
        return account, ""
    shot = {"shot": rates["shot"]} if "shot" in rates else {}
    return {**account, **rates.get("", {}), **shot}, "its frame rate is told by fps alone"


FILM_RECORD = Form("film's record", 2, MappingProxyType({1: _with_ratios}))
"""What lies beside a film, in its frames and in pictures: its version, and older ones."""

_SECTIONS: Mapping[str, str] = MappingProxyType(
    {
        "scene": "",
        "preset": "quality preset: ",
        "shot": "shot: ",
        "inputs": "input ",
        "versions": "version of ",
        "package": "our own ",
    }
)
"""Mappings in an account, and the words before their keys."""

_PLAIN = ("camera", "time", "exposure", "variant", "device")
"""Single values in an account."""

_DIGESTS: Mapping[str, str] = MappingProxyType(
    {
        "world": "roads, houses, plants, lamps or their materials are others",
        "light": "sky, sun or air are others",
        "plan": "the shot shows other bodies, or has other room for them",
    }
)
_HASHED = frozenset({"inputs", "package"})
_NOT_SEEN = ("output.layers",)
"""Keys of a scene that act on no picture."""

_ACT_ON_NO_PIXEL = ("shots", "template", "quality", "output.codec", "output.fps", "output.tone")
_NOT_STORED = (*_NOT_SEEN, *_ACT_ON_NO_PIXEL, "output.glare", "output.response", "scenario")
"""Keys of a scene that act on no stored frame, or whose effect another part of an account tells."""


def differences(one: Account, other: Account, *, stored: bool = False) -> list[str]:
    """Return what differs, from the first to the second; nothing for the same picture or film.

    Commands are not compared: another name of the output is another command.

    Args:
        one: The account of a picture, or of a film.
        other: The account of the other one.
        stored: Whether only that counts which tells frames of one film from those of another,
            and not how they are developed.
    """
    sentences = []
    for section, words in _SECTIONS.items():
        old, new = (
            dict(_leaves(_content(account, section, stored=stored))) for account in (one, other)
        )
        for key in sorted(old.keys() | new.keys()):
            left_out = section == "scene" and key.startswith(_NOT_STORED if stored else _NOT_SEEN)
            if old.get(key) != new.get(key) and not left_out:
                sentences.append(words + _changed(key, old, new, hashed=section in _HASHED))
    plain = [key for key in _PLAIN if not (stored and key == "time")]
    sentences += [_changed(key, one, other) for key in plain if one.get(key) != other.get(key)]
    sentences += [words for key, words in _DIGESTS.items() if one.get(key) != other.get(key)]
    return sentences + list(_frames(one.get("frames"), other.get("frames")))


def _content(account: Account, section: str, *, stored: bool) -> Account:
    """Return what an account says in a section.

    A scene without weather has the weather of one that leaves every key of it at its default, so
    that what a preset adds is told, and no season that both have; so it is with changed traffic.
    Stored frames are told apart by what stands in their scenes.
    """
    content: Account = account.get(section) or {}
    if section != "scene" or stored:
        return content
    plain = {"weather": WeatherSettings(), "traffic": TrafficSettings()}
    filled = {
        name: {**with_files(own.model_dump(by_alias=True), str), **(content.get(name) or {})}
        for name, own in plain.items()
    }
    return {**content, **filled}


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield values by dotted key; lists of numbers and words are values."""
    if isinstance(value, Mapping):
        pairs: Sequence[tuple[Any, Any]] = list(value.items())
    elif isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        pairs = list(enumerate(value))
    else:
        yield path, value
        return
    for key, item in pairs:
        yield from _leaves(item, f"{path}.{key}" if path else str(key))


def _changed(key: str, old: Account, new: Account, *, hashed: bool = False) -> str:
    """Return one value that differs."""
    if key not in old or key not in new:
        side = "second" if key not in old else "first"
        return f"{key}: only the {side} has it"
    if hashed:
        return f"{key}: other content"
    return f"{key}: {_shown(old[key])} -> {_shown(new[key])}"


def _shown(value: Any) -> str:
    """Return a value as people read it."""
    return value if isinstance(value, str) else json.dumps(value)


def _frames(old: Any, new: Any) -> Iterator[str]:
    """Yield what differs in the frames of two films."""
    if not (isinstance(old, list) and isinstance(new, list)):
        return
    pairs = list(zip(old, new, strict=False))
    for key, words in (
        ("time", "that show other times"),
        ("camera", "that are seen from elsewhere"),
        ("drawn", "that show others on the road"),
    ):
        unlike = [number for number, (a, b) in enumerate(pairs) if a.get(key) != b.get(key)]
        if unlike:
            yield f"frames {words}: {len(unlike)}, the first is {unlike[0]}"
