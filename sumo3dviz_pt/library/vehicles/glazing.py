"""Panes of cars show cabins, and lamps have depth: what the renderer must be told of them.

Lenses of all colours become one material, so that a body does not consist of more meshes than it
must; their colours go with their faces.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.cabins import cabin_of
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part

PANE = "cabin_pane"
"""The material of panes before cabins."""

LENS = "lens"
"""The material of lamps that show what lies under their covers."""

LENSES = ("lamp_red", "lamp_dark_red", "lamp_amber", "lamp_clear", "lamp_white")
"""Materials of a body that become lenses close by."""


def glazed(pieces: Iterable[MaterialMesh], meta: Mapping[str, Any]) -> Iterator[Part]:
    """Yield the parts of a body whose panes tell of the cabin.

    Args:
        pieces: Materials and meshes, in the body's frame.
        meta: Of the vehicle in the catalogue.
    """
    for material, mesh in pieces:
        yield Part(paned(mesh, meta) if material == PANE else mesh, material)


def lensed(parts: Iterable[Part]) -> Iterator[Part]:
    """Yield parts of which lamps have become lenses, each face with its lamp's colour."""
    for part in parts:
        if part.material in LENSES:
            colour = MATERIALS[part.material]["base_color"]["value"]
            tint = np.tile(np.asarray(colour, dtype=np.float64), (len(part.mesh.faces), 1))
            part = replace(part, material=LENS, tint=tint)
        yield part


def lens_counts(counts: Mapping[str, int]) -> dict[str, int]:
    """Return triangles by material as they are after `lensed`."""
    kept = {material: count for material, count in counts.items() if material not in LENSES}
    lenses = sum(count for material, count in counts.items() if material in LENSES)
    return {**kept, LENS: lenses} if lenses else kept


def paned(mesh: Mesh, meta: Mapping[str, Any], *, yaw: float = 0.0, chance: float = 0.0) -> Mesh:
    """Return a mesh of panes that tells of the cabin behind it.

    Args:
        mesh: In the body's frame.
        meta: Of the vehicle in the catalogue.
        yaw: Where the body will look to, if it stands [rad].
        chance: What is random in it, if it stands, [0, 1).
    """
    cabin = cabin_of(meta["cabin"])
    numbers = cabin.numbers(yaw=yaw, chance=chance)
    uvs = np.tile(numbers, (len(mesh.vertices), 1))
    return replace(mesh, uvs=uvs, wear=cabin.places(mesh.vertices))
