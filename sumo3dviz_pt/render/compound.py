"""Merges parts of many plain materials into few meshes.

Dr.Jit spends about a millisecond per mesh or BSDF in every frame, so a vehicle of ten materials
would cost as much as a street. All `principled` materials without textures become one BSDF
that reads colour, roughness and metallic from the faces. Textured, clear-coated and other
materials stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Colour, Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import OWN, Bsdf, Part, is_tinted
from sumo3dviz_pt.render.convert import TINT_ATTRIBUTE, face_tint

ROUGHNESS_ATTRIBUTE = "face_roughness"
METALLIC_ATTRIBUTE = "face_metallic"

COMPOUND: Bsdf = {
    "type": "principled",
    "base_color": face_tint(),
    "roughness": {"type": "mesh_attribute", "name": ROUGHNESS_ATTRIBUTE},
    "metallic": {"type": "mesh_attribute", "name": METALLIC_ATTRIBUTE},
    "specular": 0.5,
}

_WHITEST = 0.85
"""Reflectance up to which materials give back no more light than falls on them."""

_PLAIN_KEYS = {"type", "base_color", "roughness", "metallic", "specular"}


@dataclass(frozen=True, slots=True, eq=False)
class MergedMesh:
    """Meshes that share a material.

    Attributes:
        material: A name of the scene's materials, or empty for the compound.
        mesh: All of them.
        attributes: Values per face, (m, channels), by attribute name.
        painted: Whether its colour is that of the mover that shows it.
    """

    material: str
    mesh: Mesh
    attributes: Mapping[str, Floats]
    painted: bool = False


def is_plain(bsdf: Bsdf) -> bool:
    """Return whether a material can go into the compound."""
    if bsdf.get("type") != "principled" or not set(bsdf) <= _PLAIN_KEYS:
        return False
    numbers = all(isinstance(bsdf.get(key, 0.0), int | float) for key in ("roughness", "metallic"))
    return numbers and bsdf["base_color"].get("type") in ("rgb", "tint")


def merged_meshes(
    parts: Iterable[Part], materials: Mapping[str, Bsdf], *, own_tint: bool = True
) -> list[MergedMesh]:
    """Merge parts into as few meshes as their materials allow.

    Args:
        parts: In one common frame.
        materials: BSDFs by name.
        own_tint: Whether tinted parts without tints of their own are coloured by
            faces (grey); if not, they stay apart, to be coloured by a mover.

    Returns:
        Lumps in order of first appearance; flat and smooth meshes stay apart.
    """
    groups: dict[tuple[str, bool, bool, bool, bool], list[Part]] = {}
    for part in parts:
        if not len(part.mesh.faces):
            continue
        by_mover = not own_tint and _by_mover(part, materials)
        name = "" if is_plain(materials[part.material]) and not by_mover else part.material
        keep_uvs = bool(name) and part.mesh.uvs is not None
        keep_wear = bool(name) and part.mesh.wear is not None
        key = (name, part.mesh.normals is not None, keep_uvs, keep_wear, by_mover)
        groups.setdefault(key, []).append(part)
    return [_merge(key[0], members, materials, painted=key[-1]) for key, members in groups.items()]


def _merge(
    name: str, parts: Sequence[Part], materials: Mapping[str, Bsdf], *, painted: bool
) -> MergedMesh:
    """Join parts of one group."""
    meshes = [part.mesh for part in parts]
    if not name:
        meshes = [replace(mesh, uvs=None, wear=None) for mesh in meshes]
    attributes = face_attributes(parts, materials, compound=not name)
    if painted:
        attributes.pop(TINT_ATTRIBUTE, None)
    return MergedMesh(name, merge_meshes(meshes), attributes, painted)


def face_attributes(
    parts: Sequence[Part], materials: Mapping[str, Bsdf], *, compound: bool
) -> dict[str, Floats]:
    """Return values per face, (m, channels), by attribute name.

    Args:
        parts: Their faces follow each other in this order.
        materials: BSDFs by name.
        compound: Whether the parts are made of the compound, which reads all from the faces.
    """
    attributes: dict[str, list[Floats]] = {}
    for part in parts:
        bsdf = materials[part.material]
        faces = len(part.mesh.faces)
        if compound or is_tinted(bsdf):
            attributes.setdefault(TINT_ATTRIBUTE, []).append(_face_colours(part, bsdf))
        if compound:
            for key, attribute in (
                ("roughness", ROUGHNESS_ATTRIBUTE),
                ("metallic", METALLIC_ATTRIBUTE),
            ):
                default = 0.5 if key == "roughness" else 0.0
                value: Any = bsdf.get(key, default)
                value = value if isinstance(value, int | float) else default
                attributes.setdefault(attribute, []).append(np.full((faces, 1), float(value)))
    return {key: np.concatenate(values) for key, values in attributes.items()}


def _face_colours(part: Part, bsdf: Bsdf) -> Floats:
    """Return the reflectance of each face, (m, 3)."""
    if part.tint is not None:
        return part.tint
    colour = bsdf.get("base_color", bsdf.get("reflectance", {}))
    value = colour.get("value", 0.5) if colour.get("type") == "rgb" else 0.5
    return np.broadcast_to(np.asarray(value, float), (len(part.mesh.faces), 3)).copy()


def _by_mover(part: Part, materials: Mapping[str, Bsdf]) -> bool:
    """Return whether a part takes its mover's colour."""
    return part.tint is None and is_tinted(materials[part.material])


@dataclass(frozen=True, slots=True, eq=False)
class Shades:
    """What the colours of a mover are multiplied with, face by face.

    Attributes:
        base: (m, 3).
        roles: Names of the colours, such as `OWN`; empty for white.
        role: Index of each face among them, (m,).
    """

    base: Floats
    roles: tuple[str, ...]
    role: Ints

    @classmethod
    def of(cls, parts: Sequence[Part], materials: Mapping[str, Bsdf]) -> Shades:
        """Find them on bodies of the compound; parts without a tint take their mover's colour."""
        own = [_by_mover(part, materials) for part in parts]
        named = [OWN if plain else part.role for part, plain in zip(parts, own, strict=True)]
        roles = tuple(sorted(set(named)))
        counts = [len(part.mesh.faces) for part in parts]
        base = [
            np.ones((count, 3)) if plain else _face_colours(part, materials[part.material])
            for part, plain, count in zip(parts, own, counts, strict=True)
        ]
        index = np.repeat(np.array([roles.index(name) for name in named], dtype=np.int64), counts)
        return cls(np.concatenate([np.zeros((0, 3)), *base]), roles, index)

    def coloured(self, own: Colour, outfit: Mapping[str, Colour]) -> Floats:
        """Return the reflectance of each face of a mover, (m, 3).

        Args:
            own: Its own colour.
            outfit: Its other colours, by role; white for those missing.
        """
        white = (1.0, 1.0, 1.0)
        palette = [own if role == OWN else outfit.get(role, white) for role in self.roles]
        return np.asarray(
            np.minimum(self.base * np.array(palette).reshape(-1, 3)[self.role], _WHITEST)
        )
