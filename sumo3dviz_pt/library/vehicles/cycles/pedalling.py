"""Cyclists who pedal: a bicycle with its rider in the phases of one turn of the cranks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sumo3dviz_pt.library.mesh.solids import by_material, moved
from sumo3dviz_pt.library.people.people import LEVELS, clothed, measures
from sumo3dviz_pt.library.people.posture import matrices
from sumo3dviz_pt.library.people.skin import dressed
from sumo3dviz_pt.library.vehicles.cycles.bicycle import BicycleRecipe, bicycle, drive, still_parts
from sumo3dviz_pt.library.vehicles.cycles.parts import FULL, wheel
from sumo3dviz_pt.library.vehicles.cycles.rider import Machine, posture
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh, read_value
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Part, Poses

PHASES = 12
"""Number of phases of one turn of the cranks."""

DEVELOPMENT = 5.5
"""How far a bicycle rolls in one turn of the cranks: a 28-inch wheel times a gear of 2.6 [m]."""


def pedals(recipe: Mapping[str, Any]) -> bool:
    """Return whether the vehicle of an `asset.yaml` is pedalled."""
    return bool(recipe.get("recipe", {}).get("model") == "bicycle")


def pedalling(recipe: Mapping[str, Any]) -> tuple[tuple[Part, ...], Poses]:
    """Build a bicycle with its rider.

    Args:
        recipe: Content of an `asset.yaml` for which `pedals` holds.

    Returns:
        Parts at rest, and their poses: 0 is at rest, the others are the phases of one turn.
    """
    own = read_value(BicycleRecipe, recipe["recipe"])
    turns = [own.turn, *(2.0 * np.pi * np.arange(PHASES) / PHASES).tolist()]
    machines = [bicycle(replace(own, turn=turn)) for turn in turns]
    figure = {**own.rider, "curl": 0.85}
    body = measures(figure)
    bones = np.stack([matrices(body, posture(machine.grasp)) for machine in machines])
    rider, moves = dressed(list(clothed(figure, LEVELS["middle"])), bones)
    still = by_material([*still_parts(own, FULL), *_wheels(machines[0])])
    drives = [by_material(drive(turn, FULL)) for turn in turns]
    parts = [Part(mesh, name) for some in (still, drives[0]) for name, mesh in some.items()]
    rigid, turning = _stacked([still] * len(turns)), _stacked(drives)
    poses = Poses(
        np.concatenate([rigid[0], turning[0], moves.vertices], axis=1),
        np.concatenate([rigid[1], turning[1], moves.normals], axis=1),
    )
    return (*parts, *rider), poses


def _wheels(machine: Machine) -> Iterator[MaterialMesh]:
    """Both wheels; their spokes look the same at every turn."""
    made = list(wheel(machine.wheel, FULL))
    for x in machine.axles:
        for material, mesh in made:
            yield material, moved(mesh, x, 0.0, machine.wheel.radius)


def _stacked(states: Sequence[Mapping[str, Mesh]]) -> tuple[Floats, Floats]:
    """Vertices and normals of meshes by material in several states, (states, n, 3) each."""
    vertices = [np.concatenate([mesh.vertices for mesh in state.values()]) for state in states]
    normals = [np.concatenate([_normals(mesh) for mesh in state.values()]) for state in states]
    return np.stack(vertices), np.stack(normals)


def _normals(mesh: Mesh) -> Floats:
    """A mesh's normals, which all pieces of bicycles have, (n, 3)."""
    assert mesh.normals is not None
    return mesh.normals
