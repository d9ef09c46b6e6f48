"""Finds the files that a user's model is read from beside its own.

A YAML file names a mesh, an OBJ file its materials and these their pictures, a glTF file its
buffers and pictures, a PLY file its texture. A model has changed if any of these has.

References:
    Khronos glTF 2.0, section 3.6.1.1 (URIs); Wavefront OBJ and MTL (`mtllib`, `map_*`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import yaml


def companions(path: Path) -> tuple[Path, ...]:
    """Return all existing files that a model refers to, directly or not; none twice.

    Args:
        path: A mesh, or a YAML file about one. A file that cannot be read refers to nothing: what
            is wrong with it is said when it is read for a picture.
    """
    found: dict[Path, None] = {}
    waiting = [path]
    while waiting:
        here = waiting.pop()
        for name in _named_in(here):
            other = here.parent / name
            if other != path and other not in found and other.is_file():
                found[other] = None
                waiting.append(other)
    return tuple(found)


def _named_in(path: Path) -> list[str]:
    """Names of files that stand in a file, relative to it."""
    reader = _READERS.get(path.suffix.lower())
    try:
        return [] if reader is None else list(reader(path))
    except (OSError, ValueError, yaml.YAMLError):
        return []


def _of_yaml(path: Path) -> Iterator[str]:
    """The mesh that a YAML file is about."""
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    if isinstance(content, Mapping) and isinstance(content.get("mesh"), str):
        yield content["mesh"]


def _of_gltf(path: Path) -> Iterator[str]:
    """Buffers and pictures that are not part of the file."""
    content: Any = json.loads(path.read_bytes())
    for key in ("buffers", "images"):
        for item in content.get(key, ()) if isinstance(content, dict) else ():
            uri = item.get("uri") if isinstance(item, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                yield unquote(uri)


def _of_obj(path: Path) -> Iterator[str]:
    """Files of materials."""
    with path.open("rb") as lines:
        for line in lines:
            if line.startswith(b"mtllib "):
                named = line.decode("utf-8", errors="replace").partition(" ")[2].strip()
                yield from dict.fromkeys([named, *named.split()])  # one with blanks, or several


def _of_mtl(path: Path) -> Iterator[str]:
    """Pictures of materials: what a line ends with, after its options; it may have blanks."""
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        words = line.split()
        if len(words) > 1 and words[0].lower().startswith(_PICTURED):
            yield from (" ".join(words[n:]) for n in range(1, len(words)))


def _of_ply(path: Path) -> Iterator[str]:
    """The texture that a PLY's header names."""
    with path.open("rb") as lines:
        for line in lines:
            if line.startswith(b"comment TextureFile "):
                yield line.decode("utf-8", errors="replace").split(maxsplit=2)[2].strip()
            if line.startswith(b"end_header"):
                return


_PICTURED = ("map_", "bump", "disp", "norm", "refl", "decal")
"""Words of a material that a picture follows."""

_READERS: Mapping[str, Callable[[Path], Iterator[str]]] = {
    ".yaml": _of_yaml,
    ".yml": _of_yaml,
    ".gltf": _of_gltf,
    ".obj": _of_obj,
    ".mtl": _of_mtl,
    ".ply": _of_ply,
}
