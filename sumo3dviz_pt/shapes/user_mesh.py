"""Reads a user's own vehicle: a mesh file, or a YAML file that says how to take it.

The YAML file holds `mesh` (a path relative to it) and may hold `forward` and `up`
(`+x`, `-y`, ...) and `scale` (metres per unit). Without it, glTF is taken as its
standard says (up +y, forward +z), other files as forward +x, up +z.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Colour

_KEY = "vehicles.user_models"
_KNOWN = {"mesh", "forward", "up", "scale"}
_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")


def read_user_mesh(path: Path) -> tuple[tuple[Mesh, Colour | None], ...]:
    """Read a vehicle's meshes.

    Args:
        path: GLB, glTF, OBJ, PLY or STL, or a YAML file about one.

    Returns:
        Meshes with the front at x = 0, centred in y, on the ground, in metres; each with
        its linear colour, or None where the file gives none.

    Raises:
        ConfigError: If a file is missing, of an unknown kind, damaged or empty.
    """
    options = _options(path)
    mesh_path = path.parent / str(options["mesh"])
    if mesh_path.suffix.lower() not in _SUFFIXES:
        raise ConfigError(f"{mesh_path.name} is none of {', '.join(_SUFFIXES)}", key=_KEY)
    if not mesh_path.is_file():
        raise ConfigError(f"there is no file {mesh_path}", key=_KEY)
    found = _load(mesh_path)
    body_from_file = _axes(options, gltf=mesh_path.suffix.lower() in (".glb", ".gltf"))
    points = np.concatenate([mesh.vertices for mesh, _ in found]) @ body_from_file.T
    low, high = points.min(axis=0), points.max(axis=0)
    shift = np.array([-high[0], -(low[1] + high[1]) / 2.0, -low[2]])
    return tuple(
        (Mesh(mesh.vertices @ body_from_file.T + shift, mesh.faces), colour)
        for mesh, colour in found
    )


def _options(path: Path) -> Mapping[str, Any]:
    """What the YAML file says, or just the mesh."""
    if path.suffix.lower() not in (".yaml", ".yml"):
        return {"mesh": path.name}
    try:
        options = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"{path} cannot be read: {error}", key=_KEY) from error
    if not isinstance(options, dict) or "mesh" not in options or set(options) - _KNOWN:
        raise ConfigError(f"{path} must hold mesh and may hold forward, up, scale", key=_KEY)
    return options


def _axes(options: Mapping[str, Any], *, gltf: bool) -> Floats:
    """Turns and scales points of the file into the body's frame, (3, 3)."""
    forward = _axis(str(options.get("forward", "+z" if gltf else "+x")))
    up = _axis(str(options.get("up", "+y" if gltf else "+z")))
    scale = options.get("scale", 1.0)
    if not isinstance(scale, int | float) or not 0.0 < scale < float("inf"):
        raise ConfigError(f"scale must be a positive number, not {scale!r}", key=_KEY)
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


def _load(path: Path) -> list[tuple[Mesh, Colour | None]]:
    """All triangle meshes of a file, in its own frame."""
    import trimesh

    try:
        scene: Any = trimesh.load(path, force="scene")
        solids = [item for item in scene.dump() if isinstance(item, trimesh.Trimesh)]
    except Exception as error:  # trimesh's readers raise anything
        raise ConfigError(f"{path} cannot be read: {error}", key=_KEY) from error
    found = [(Mesh(solid.vertices, solid.faces), _colour(solid)) for solid in solids]
    found = [item for item in found if len(item[0].faces)]
    if not found:
        raise ConfigError(f"{path} holds no triangles", key=_KEY)
    return found


def _colour(solid: Any) -> Colour | None:
    """The main colour of a trimesh mesh as linear reflectance; None where it has none."""
    visual = solid.visual
    if not visual.defined:
        return None
    rgba = getattr(visual, "material", visual).main_color
    encoded = np.asarray(rgba, dtype=np.float64)[:3] / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    red, green, blue = np.minimum(linear, 0.85).tolist()
    return red, green, blue
