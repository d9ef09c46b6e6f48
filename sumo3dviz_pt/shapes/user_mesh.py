"""Reads a user's own vehicle: a mesh file, or a YAML file that says how to take it.

The YAML file holds `mesh` (a path relative to it) and may hold

    forward: +z            # the axes of the file; glTF: forward +z, up +y; others +x, +z
    up: +y
    scale: 0.01            # metres per unit, or `fit`: as long as the vType
    materials:             # by the name of a mesh or material in the file; * and ? match
      "body*": paint       # one of ours: paint takes the vehicle's colour
      rims: {colour: "#aab0b4", roughness: 0.3, metallic: 1.0}
    lamps:                 # in metres behind the front, as drawn without `fit`
      - {role: head, at: [0.0, 0.6, 0.7], size: [0.2, 0.1], yaw: 0}

Where it maps nothing, colours, roughness and metal of the file count; transparent
parts become dark glass.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh
from sumo3dviz_pt.model.lamps import VehicleLamp
from sumo3dviz_pt.shapes.solids import shaded

_KEY = "vehicles.user_models"
_KNOWN = ("mesh", "forward", "up", "scale", "materials", "lamps")
_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")
_CREASE = float(np.radians(35.0))
"""Edges sharper than this stay sharp."""

_SMOOTHEST = 0.05  # smoother materials make fireflies
LAMP_ROLES = ("head", "tail", "brake", "left", "right", "reverse", "blue", "sign")


@dataclass(frozen=True, slots=True)
class Finish:
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

    pieces: tuple[tuple[Mesh, Finish], ...]
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
    mesh_path = path.parent / str(options["mesh"])
    if mesh_path.suffix.lower() not in _SUFFIXES:
        raise ConfigError(f"{mesh_path.name} is none of {', '.join(_SUFFIXES)}", key=_KEY)
    if not mesh_path.is_file():
        raise ConfigError(f"there is no file {mesh_path}", key=_KEY)
    fitted = options.get("scale") == "fit"
    body_from_file = _axes(options, gltf=mesh_path.suffix.lower() in (".glb", ".gltf"))
    chosen = _finishes(options.get("materials", {}), materials, path)
    found = [
        (_turned(mesh, body_from_file), _finish(names, own, chosen))
        for mesh, names, own in _load(mesh_path)
    ]
    corners = np.stack([mesh.bounds for mesh, _ in found])
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    shift = np.array([-high[0], -(low[1] + high[1]) / 2.0, -low[2]])
    pieces = [
        (Mesh(mesh.vertices + shift, mesh.faces, mesh.normals), finish) for mesh, finish in found
    ]
    lamps = tuple(_lamp(row, path) for row in options.get("lamps") or ())
    return UserVehicle(tuple(pieces), lamps, fitted)


def _options(path: Path) -> Mapping[str, Any]:
    """What the YAML file says, or just the mesh."""
    if path.suffix.lower() not in (".yaml", ".yml"):
        return {"mesh": path.name}
    try:
        options = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"{path} cannot be read: {error}", key=_KEY) from error
    if not isinstance(options, dict) or "mesh" not in options or set(options) - set(_KNOWN):
        raise ConfigError(f"{path} must hold mesh and may hold {', '.join(_KNOWN[1:])}", key=_KEY)
    return options


def _axes(options: Mapping[str, Any], *, gltf: bool) -> Floats:
    """Turns and scales points of the file into the body's frame, (3, 3)."""
    forward = _axis(str(options.get("forward", "+z" if gltf else "+x")))
    up = _axis(str(options.get("up", "+y" if gltf else "+z")))
    scale = options.get("scale", 1.0)
    scale = 1.0 if scale == "fit" else scale
    if not isinstance(scale, int | float) or not 0.0 < scale < float("inf"):
        raise ConfigError(f"scale must be a positive number or fit, not {scale!r}", key=_KEY)
    if abs(forward @ up) > 0.5:
        raise ConfigError("forward and up must be different axes", key=_KEY)
    return np.asarray(float(scale) * np.stack([forward, np.cross(up, forward), up]))


def _axis(word: str) -> Floats:
    """A unit vector from a word such as `-y`."""
    sign, letter = (word[0], word[1:]) if word[:1] in ("+", "-") else ("+", word)
    if letter not in ("x", "y", "z"):
        raise ConfigError(f"an axis is written +x, -y, ..., not {word!r}", key=_KEY)
    axis = np.eye(3)["xyz".index(letter)]
    return np.asarray(-axis if sign == "-" else axis)


def _turned(mesh: Mesh, body_from_file: Floats) -> Mesh:
    """A mesh in the body's directions, with smooth normals up to its creases."""
    return shaded(mesh.vertices @ body_from_file.T, mesh.faces, crease=_CREASE)


Named = tuple[tuple[str, Finish], ...]
"""Finishes by pattern, in the file's order."""


def _finishes(given: Any, known: Collection[str], path: Path) -> Named:
    """What the YAML file says of materials."""
    if not isinstance(given, Mapping):
        raise ConfigError(f"{path}: materials must map names to materials", key=_KEY)
    return tuple((str(name), _wanted(value, known, path)) for name, value in given.items())


def _wanted(value: Any, known: Collection[str], path: Path) -> Finish:
    """One material of the YAML file."""
    if isinstance(value, str):
        if value not in known:
            raise ConfigError(f"{path}: no material is called {value!r}", key=_KEY)
        return Finish(named=value)
    keys = {"colour", "roughness", "metallic"}
    if not isinstance(value, Mapping) or set(value) - keys or "colour" not in value:
        raise ConfigError(f"{path}: a material has colour, roughness, metallic", key=_KEY)
    shares = [value.get("roughness", 0.35), value.get("metallic", 0.0)]
    if not all(isinstance(share, int | float) and 0.0 <= share <= 1.0 for share in shares):
        raise ConfigError(f"{path}: roughness and metallic lie in 0..1", key=_KEY)
    colour = _hexadecimal(str(value["colour"]), path)
    return Finish("", colour, max(float(shares[0]), _SMOOTHEST), float(shares[1]))


def _hexadecimal(text: str, path: Path) -> Colour:
    """Linear reflectance of `#rrggbb`."""
    try:
        if len(text) != 7 or text[0] != "#":
            raise ValueError
        encoded = [int(text[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    except ValueError:
        raise ConfigError(f"{path}: a colour is written #rrggbb, not {text!r}", key=_KEY) from None
    return _linear(np.array(encoded))


def _finish(names: tuple[str, ...], own: Finish, chosen: Named) -> Finish:
    """The first finish whose pattern fits one of a mesh's names, else the file's own."""
    for pattern, finish in chosen:
        if any(fnmatchcase(name, pattern) for name in names):
            return finish
    return own


def _lamp(row: Any, path: Path) -> VehicleLamp:
    """A lamp of the YAML file; angles there are degrees."""
    try:
        role, yaw = str(row["role"]), float(np.radians(float(row.get("yaw", 0.0))))
        x, y, z = (float(value) for value in row["at"])
        width, height = (float(value) for value in row["size"])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        message = f"{path}: a lamp has role, at: [x, y, z], size: [w, h] and yaw"
        raise ConfigError(message, key=_KEY) from error
    if role not in LAMP_ROLES or width <= 0.0 or height <= 0.0:
        raise ConfigError(f"{path}: roles are {', '.join(LAMP_ROLES)}, sizes positive", key=_KEY)
    return VehicleLamp(role, (x, y, z), (width, height), yaw)


def _load(path: Path) -> list[tuple[Mesh, tuple[str, ...], Finish]]:
    """All triangle meshes of a file, in its own frame, with their names and looks."""
    import trimesh

    try:
        scene: Any = trimesh.load(path, force="scene")
        solids = [item for item in scene.dump() if isinstance(item, trimesh.Trimesh)]
    except Exception as error:  # trimesh's readers raise anything
        raise ConfigError(f"{path} cannot be read: {error}", key=_KEY) from error
    found = [(_solid(solid), _names(solid), _own_finish(solid)) for solid in solids]
    found = [item for item in found if len(item[0].faces)]
    if not found:
        raise ConfigError(f"{path} holds no triangles", key=_KEY)
    return found


def _solid(solid: Any) -> Mesh:
    """A mesh whose equal vertices are one, without faces that have no area."""
    solid = solid.copy()
    solid.merge_vertices(merge_tex=True, merge_norm=True)
    keep = solid.area_faces > 1e-12
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces)[keep])


def _names(solid: Any) -> tuple[str, ...]:
    """Names of a mesh and of its material."""
    material = getattr(solid.visual, "material", None)
    names = [solid.metadata.get("name"), getattr(material, "name", None)]
    return tuple(str(name) for name in names if name)


def _own_finish(solid: Any) -> Finish:
    """What the file says a mesh looks like; without a word it is painted."""
    visual = solid.visual
    if not visual.defined:
        return Finish(named="paint")
    material = getattr(visual, "material", visual)
    rgba = np.asarray(material.main_color, dtype=np.float64) / 255.0
    if getattr(material, "alphaMode", None) == "BLEND" or rgba[3] < 0.9:
        return Finish(named="glass")
    rough, metal = (getattr(material, f"{key}Factor", None) for key in ("roughness", "metallic"))
    roughness = 0.35 if rough is None else max(float(rough), _SMOOTHEST)
    return Finish("", _linear(rgba[:3]), roughness, 0.0 if metal is None else float(metal))


def _linear(encoded: Floats) -> Colour:
    """Linear reflectance of sRGB codes in [0, 1], at most what conserves energy."""
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    red, green, blue = np.minimum(linear, 0.85).tolist()
    return red, green, blue
