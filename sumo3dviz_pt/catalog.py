"""Finds what users can choose by name: assets and presets, and where their data lies.

Data travels in the wheel as `sumo3dviz_pt/_data`; in an editable installation it
lies at the repository root. Nothing else in the package knows these places.
"""

from __future__ import annotations

import contextlib
import difflib
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import platformdirs
import yaml

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import read_folder, write_folder
from sumo3dviz_pt.library.vehicles.recipe import varied

_PACKAGE = Path(__file__).resolve().parent
_DATA_ROOTS = (_PACKAGE / "_data", _PACKAGE.parent)
_JSON = "content.json"


@dataclass(frozen=True, slots=True)
class Entry:
    """One catalogue entry.

    Attributes:
        family: Such as `vehicles` or `surfaces`.
        name: The name that users choose.
        folder: Where its files lie.
        meta: The content of its `asset.yaml`, and of `baked.yaml` where there is one.
    """

    family: str
    name: str
    folder: Path
    meta: Mapping[str, Any]


def data_root(name: str) -> Path:
    """Return the folder of `assets`, `scene_templates` or `examples`, wherever it is installed."""
    for root in _DATA_ROOTS:
        if (root / name).is_dir():
            return root / name
    raise ConfigError(f"the installation is incomplete: no folder {name!r} in {_DATA_ROOTS[0]}")


@cache
def _load_yaml(path: Path) -> Mapping[str, Any]:
    """Read one of our own YAML files, or what the user's cache keeps of it as JSON.

    All vehicles together take half a CPU-second as YAML and a fiftieth of that as JSON.
    """
    text = path.read_bytes()
    folder = cache_root() / "catalogue" / hashlib.blake2b(text, digest_size=16).hexdigest()
    cached = read_folder(folder)
    if cached is not None:
        content: Mapping[str, Any] = json.loads(cached[_JSON])
        return content
    # The loader in C gives the same in a sixth of the time.
    content = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    _cache_json(folder, content)
    return content


def _cache_json(folder: Path, content: Mapping[str, Any]) -> None:
    """Keep a value as JSON, if that says the same and there is room."""
    try:
        text = json.dumps(content)
    except TypeError:
        return
    if json.loads(text) == content:
        with contextlib.suppress(OSError):
            write_folder(folder, {_JSON: text.encode()})


@cache
def names(family: str) -> tuple[str, ...]:
    """Return the names of all assets of a family, sorted."""
    folder = data_root("assets") / family
    return tuple(sorted(path.parent.name for path in folder.glob("*/asset.yaml")))


@cache
def find(family: str, name: str) -> Entry:
    """Look an asset up by name.

    Raises:
        ConfigError: If the family has no such asset; the message suggests one.
    """
    if name not in names(family):
        raise ConfigError(
            f"no {family} asset is called {name!r}{did_you_mean(name, names(family))}"
        )
    folder = data_root("assets") / family / name
    baked = folder / "baked.yaml"
    own = _load_yaml(folder / "asset.yaml")
    if "base" in own:
        own = varied(_load_yaml(folder.parent / str(own["base"]) / "asset.yaml"), own)
    meta = {**own, **(_load_yaml(baked) if baked.is_file() else {})}
    return Entry(family, name, folder, meta)


def digest_of(content: Mapping[str, Any]) -> str:
    """Return the digest of an asset's content; where it differs, the content was changed."""
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def recipe_files(entry: Entry) -> tuple[Path, ...]:
    """Return the files that an asset is made from: its own, and that of the asset it varies."""
    own = entry.folder / "asset.yaml"
    base = entry.meta.get("base")
    return (own,) if base is None else (own, entry.folder.parent / str(base) / "asset.yaml")


def package_folder(name: str) -> Path:
    """Return the folder of one of our own subpackages, such as `library`."""
    return _PACKAGE / name


@cache
def code_digest(name: str) -> bytes:
    """Return a digest of the code of one of our own subpackages, such as `library`.

    It hangs on neither where the package lies nor how its files are called.
    """
    files = package_folder(name).rglob("*.py")
    digests = sorted(hashlib.blake2b(path.read_bytes()).digest() for path in files)
    return hashlib.blake2b(b"".join(digests)).digest()


def cache_root() -> Path:
    """Return where what takes long to build is kept for this user.

    The environment variable `SUMO3DVIZ_PT_CACHE` names another folder.
    """
    own = os.environ.get("SUMO3DVIZ_PT_CACHE")
    return Path(own) if own else platformdirs.user_cache_path("sumo3dviz_pt")


@cache
def template_names(kind: str) -> tuple[str, ...]:
    """Return the names of all presets of a kind: `scene`, `sky`, `weather`, `camera`, `quality`."""
    return tuple(sorted(path.stem for path in (data_root("scene_templates") / kind).glob("*.yaml")))


@cache
def template(kind: str, name: str) -> Mapping[str, Any]:
    """Return the content of a preset.

    Raises:
        ConfigError: If there is no such preset; the message suggests one.
    """
    known = template_names(kind)
    if name not in known:
        raise ConfigError(f"no {kind} preset is called {name!r}{did_you_mean(name, known)}")
    return _load_yaml(template_file(kind, name))


def template_file(kind: str, name: str) -> Path:
    """Return where a preset lies, or would lie."""
    return data_root("scene_templates") / kind / f"{name}.yaml"


def file_meant(path: Path) -> str:
    """End of a sentence that names the file beside a missing one that is called almost like it."""
    try:
        there = sorted(each.name for each in path.parent.iterdir() if each.is_file())
    except OSError:
        return ""
    same_stem = [name for name in there if Path(name).stem == path.stem]
    near = same_stem or difflib.get_close_matches(path.name, there, n=1, cutoff=0.7)
    return f"; did you mean {near[0]!r}?" if near else ""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """End of a sentence that names the nearest known word, or all of them."""
    known = sorted(known)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    if near:
        return f"; did you mean {near[0]!r}?"
    return f"; known: {', '.join(known)}" if known else ""
