"""Reads a user's own vehicle: a mesh file, or a YAML file that says how to use one.

The YAML file holds `mesh` (a path relative to it) and may hold

    forward: +z            # the axes of the file; glTF: forward +z, up +y; others +x, +z
    up: +y
    scale: 0.01            # metres per unit, or `fit`: as long as the vType
    materials:             # by the name of a mesh or material in the file; * and ? match
      "body*": paint       # one of ours: paint takes the vehicle's colour
      rims: {colour: "#aab0b4", roughness: 0.3, metallic: 1.0}
    lamps:                 # in metres behind the front, as drawn without `fit`
      - {role: head, at: [0.0, 0.6, 0.7], size: [0.2, 0.1], yaw: 0}

Where it maps nothing, colours, roughness and metal of the mesh file are used; transparent
parts become dark glass.

A model may be read from several files: a YAML file names a mesh, an OBJ file its materials and
these their pictures, a glTF file its buffers and pictures, a PLY file its texture. A model has
changed if any of these has.

References:
    Khronos glTF 2.0, section 3.6.1.1 (URIs); Wavefront OBJ and MTL (`mtllib`, `map_*`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import yaml

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.files.atomic import read_plain
from sumo3dviz_pt.job.yaml12 import MOST_TEXT, parse_yaml
from sumo3dviz_pt.library.mesh.mesh_files import Solid, read_solids
from sumo3dviz_pt.library.mesh.solids import shaded
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh
from sumo3dviz_pt.model.scene import VehicleLamp


def companions(path: Path) -> tuple[Path, ...]:
    """Return all existing files that a model refers to, directly or not; none twice.

    Args:
        path: A mesh, or a YAML file about one. A file that cannot be read refers to nothing: what
            is wrong with it is said when it is read for a picture.
    """
    files: dict[Path, None] = {}
    waiting = [path]
    while waiting:
        here = waiting.pop()
        for name in _named_in(here):
            other = here.parent / name
            if other != path and other not in files and other.is_file():
                files[other] = None
                waiting.append(other)
    return tuple(files)


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


_KEY = "vehicles.user_models"
_KNOWN = ("mesh", "forward", "up", "scale", "materials", "lamps")
_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")
_CREASE = float(np.radians(35.0))
"""Edges sharper than this stay sharp."""

_SMOOTHEST = 0.05  # smoother materials make fireflies
_SCALES = (1e-6, 1e4)  # metres per unit: micrometres, and more than any
_LONGEST = 1000.0  # of a model as drawn [m]
_SHORTEST = 0.01
_SLIMMEST = 50.0  # times as high or wide as long; a model with its axes confused is more
_MOST_LAMPS = 200
_LARGEST_LAMP = 20.0  # [m]
LAMP_ROLES = ("head", "tail", "brake", "left", "right", "reverse", "blue", "sign")


@dataclass(frozen=True, slots=True)
class UserFinish:
    """What a part of a user's model is made of.

    Attributes:
        named: One of our materials, or empty.
        colour: Linear reflectance.
        roughness: As in `principled`.
        metallic: As in `principled`.
    """

    named: str = ""
    colour: Colour = (0.5, 0.5, 0.5)
    roughness: float = 0.35
    metallic: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class UserVehicle:
    """A user's own vehicle.

    Attributes:
        pieces: Meshes with the front at x = 0, centred in y, on the ground [m], and what
            each is made of.
        lamps: What can shine.
        fitted: Whether it is scaled to its vType's length.
    """

    pieces: tuple[tuple[Mesh, UserFinish], ...]
    lamps: tuple[VehicleLamp, ...]
    fitted: bool


def read_user_vehicle(path: Path, *, materials: Collection[str]) -> UserVehicle:
    """Read a user's vehicle.

    Args:
        path: GLB, glTF, OBJ, PLY or STL, or a YAML file about one.
        materials: Names of ours that the YAML file may use.

    Raises:
        ConfigError: If a file is missing, of an unknown kind, damaged or empty, or the
            YAML file holds what it must not.
    """
    options = _options(path)
    mesh_path = _mesh_path(path, options)
    fitted = options.get("scale") == "fit"
    body_from_file = _axes(options, gltf=mesh_path.suffix.lower() in (".glb", ".gltf"))
    chosen = _finishes(options.get("materials") or {}, materials, path)
    lamps = _lamps(options.get("lamps") or [], path)
    meshes = [
        (_turned(solid.mesh, body_from_file), _finish(solid.names, _own_finish(solid), chosen))
        for solid in read_solids(mesh_path, key=_KEY)
    ]
    corners = np.stack([mesh.bounds for mesh, _ in meshes])
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    _check_size(mesh_path, high - low, fitted=fitted)
    shift = np.array([-high[0], -(low[1] + high[1]) / 2.0, -low[2]])
    pieces = [
        (Mesh(mesh.vertices + shift, mesh.faces, mesh.normals), finish) for mesh, finish in meshes
    ]
    return UserVehicle(tuple(pieces), lamps, fitted)


def _check_size(path: Path, sides: Floats, *, fitted: bool) -> None:
    """Refuse a model as long as a town or as small as a nail, whose unit is not the metre."""
    length, longest = float(sides[0]), float(sides.max())
    if length <= 0.0 or longest > _SLIMMEST * length:
        length, width, height = sides
        raise ConfigError(
            f"{path} is {length:.3g} long, {width:.3g} wide and {height:.3g} high; say in a YAML"
            " file which way is forward and up",
            key=_KEY,
        )
    if not fitted and not _SHORTEST <= longest <= _LONGEST:
        raise ConfigError(
            f"{path} is {longest:.3g} m long; name it in a YAML file with its scale, in metres"
            " per unit, or with scale: fit",
            key=_KEY,
        )


def check_user_file(path: Path) -> None:
    """Refuse a file that is not there or of an unknown kind, without reading its mesh.

    Raises:
        ConfigError: As `read_user_vehicle`.
    """
    _mesh_path(path, _options(path))


def _mesh_path(path: Path, options: Mapping[str, Any]) -> Path:
    """Where the mesh lies."""
    mesh_path = path.parent / str(options["mesh"])
    if mesh_path.suffix.lower() not in _SUFFIXES:
        raise ConfigError(f"{mesh_path.name} is none of {', '.join(_SUFFIXES)}", key=_KEY)
    if not mesh_path.is_file():
        raise ConfigError(f"there is no file {mesh_path}", key=_KEY)
    return mesh_path


def _options(path: Path) -> Mapping[str, Any]:
    """What the YAML file says, or just the mesh."""
    if path.suffix.lower() not in (".yaml", ".yml"):
        return {"mesh": path.name}
    try:
        text = read_plain(path, most=4 * MOST_TEXT).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "it is no text in UTF-8"
        raise ConfigError(f"{path} cannot be read: {why}", key=_KEY) from error
    options, _ = parse_yaml(text, file=path)
    known = isinstance(options, dict) and not set(options) - set(_KNOWN)
    if not known or not isinstance(options.get("mesh"), str):
        raise ConfigError(f"{path} must hold mesh and may hold {', '.join(_KNOWN[1:])}", key=_KEY)
    return dict(options)


def _axes(options: Mapping[str, Any], *, gltf: bool) -> Floats:
    """Turns and scales points of the file into the body's frame, (3, 3)."""
    forward = _axis(str(options.get("forward", "+z" if gltf else "+x")))
    up = _axis(str(options.get("up", "+y" if gltf else "+z")))
    scale = options.get("scale", 1.0)
    scale = 1.0 if scale == "fit" else scale
    if not _lies(scale, *_SCALES):
        low, high = _SCALES
        message = f"scale must be a positive number from {low:g} to {high:g} or fit"
        raise ConfigError(f"{message}, not {cut(repr(scale))}", key=_KEY)
    if abs(forward @ up) > 0.5:
        raise ConfigError("forward and up must be different axes", key=_KEY)
    return np.asarray(float(scale) * np.stack([forward, np.cross(up, forward), up]))


def _lies(value: Any, low: float, high: float) -> bool:
    """Whether a value is a number between two."""
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _axis(word: str) -> Floats:
    """A unit vector from a word such as `-y`."""
    sign, letter = (word[0], word[1:]) if word[:1] in ("+", "-") else ("+", word)
    if letter not in ("x", "y", "z"):
        raise ConfigError(f"an axis is written +x, -y, ..., not {cut(repr(word))}", key=_KEY)
    axis = np.eye(3)["xyz".index(letter)]
    return np.asarray(-axis if sign == "-" else axis)


def _turned(mesh: Mesh, body_from_file: Floats) -> Mesh:
    """A mesh in the body's directions, with smooth normals up to its creases."""
    return shaded(mesh.vertices @ body_from_file.T, mesh.faces, crease=_CREASE)


NamedFinishes = tuple[tuple[str, UserFinish], ...]
"""Finishes by pattern, in the file's order."""


def _finishes(finishes: Any, known: Collection[str], path: Path) -> NamedFinishes:
    """What the YAML file says of materials."""
    if not isinstance(finishes, Mapping):
        raise ConfigError(f"{path}: materials must map names to materials", key=_KEY)
    return tuple((str(name), _wanted(value, known, path)) for name, value in finishes.items())


def _wanted(value: Any, known: Collection[str], path: Path) -> UserFinish:
    """One material of the YAML file."""
    if isinstance(value, str):
        if value not in known:
            hint = f"known: {', '.join(sorted(known))}"
            message = f"{path}: no material is called {cut(repr(value))}; {hint}"
            raise ConfigError(message, key=_KEY)
        return UserFinish(named=value)
    keys = {"colour", "roughness", "metallic"}
    if not isinstance(value, Mapping) or set(value) - keys or "colour" not in value:
        raise ConfigError(f"{path}: a material has colour, roughness, metallic", key=_KEY)
    shares = [value.get("roughness", 0.35), value.get("metallic", 0.0)]
    if not all(_lies(share, 0.0, 1.0) for share in shares):
        raise ConfigError(f"{path}: roughness and metallic lie in 0..1", key=_KEY)
    colour = _hexadecimal(str(value["colour"]), path)
    return UserFinish("", colour, max(float(shares[0]), _SMOOTHEST), float(shares[1]))


def _hexadecimal(text: str, path: Path) -> Colour:
    """Linear reflectance of `#rrggbb`."""
    try:
        if len(text) != 7 or text[0] != "#":
            raise ValueError
        encoded = [int(text[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    except ValueError:
        message = f"{path}: a colour is written #rrggbb, not {cut(repr(text))}"
        raise ConfigError(message, key=_KEY) from None
    return _linear(np.array(encoded))


def _finish(names: tuple[str, ...], own: UserFinish, chosen: NamedFinishes) -> UserFinish:
    """The first finish whose pattern fits one of a mesh's names, else the file's own."""
    for pattern, finish in chosen:
        if any(fnmatchcase(name, pattern) for name in names):
            return finish
    return own


def _lamps(rows: Any, path: Path) -> tuple[VehicleLamp, ...]:
    """The lamps of the YAML file."""
    if not isinstance(rows, list) or len(rows) > _MOST_LAMPS:
        message = f"{path}: lamps must be a list of at most {_MOST_LAMPS} lamps"
        raise ConfigError(message, key=_KEY)
    return tuple(_lamp(row, path) for row in rows)


def _lamp(row: Any, path: Path) -> VehicleLamp:
    """A lamp of the YAML file; angles there are degrees."""
    try:
        role, yaw = str(row["role"]), float(np.radians(float(row.get("yaw", 0.0))))
        x, y, z = (float(value) for value in row["at"])
        width, height = (float(value) for value in row["size"])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        message = f"{path}: a lamp has role, at: [x, y, z], size: [w, h] and yaw"
        raise ConfigError(message, key=_KEY) from error
    sides = all(0.0 < side <= _LARGEST_LAMP for side in (width, height))
    if role not in LAMP_ROLES or not sides:
        raise ConfigError(f"{path}: roles are {', '.join(LAMP_ROLES)}, sizes positive", key=_KEY)
    if not all(abs(value) <= _LONGEST for value in (x, y, z, yaw)):
        raise ConfigError(f"{path}: a lamp lies at most {_LONGEST:g} m away", key=_KEY)
    return VehicleLamp(role, (x, y, z), (width, height), yaw)


def _own_finish(solid: Solid) -> UserFinish:
    """What the file says a mesh looks like; if it says nothing, the mesh is painted."""
    if solid.rgba is None:
        return UserFinish(named="paint")
    if solid.blended or solid.rgba[3] < 0.9:
        return UserFinish(named="glass")
    rough = 0.35 if solid.roughness is None else max(solid.roughness, _SMOOTHEST)
    return UserFinish("", _linear(solid.rgba[:3]), rough, solid.metallic or 0.0)


def _linear(encoded: Floats) -> Colour:
    """Linear reflectance of sRGB codes in [0, 1], at most what conserves energy."""
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    red, green, blue = np.minimum(linear, 0.85).tolist()
    return red, green, blue
