"""People who ride two-wheelers: they sit on a saddle, hold grips and rest on pedals.

`Machine` says what is known of every two-wheeler, whatever its recipe.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.people.people import LEVELS, in_posture
from sumo3dviz_pt.library.people.posture import SIDES, FootPose, Hold, Posture, about_y, about_z
from sumo3dviz_pt.library.people.wardrobe import Recipe
from sumo3dviz_pt.library.vehicles.cycles.parts import CycleWheel, Fineness, Point
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Bools, Colour, Mesh
from sumo3dviz_pt.model.scene import OWN, Part, VehicleLamp

CLOTHES: Mapping[str, Colour] = {
    "skin": (0.45, 0.28, 0.2),
    "skin_dark": (0.15, 0.085, 0.055),
    "lips": (0.32, 0.12, 0.1),
    "hair_dark": (0.025, 0.018, 0.013),
    "hair_fair": (0.26, 0.2, 0.135),
    "denim": (0.035, 0.055, 0.1),
    "fabric_black": (0.018, 0.018, 0.02),
    "fabric_grey": (0.11, 0.11, 0.115),
    "fabric_pale": (0.5, 0.48, 0.45),
    "fabric_beige": (0.3, 0.235, 0.16),
    "leather_brown": (0.075, 0.04, 0.022),
}
"""Materials of riders, which travel without face tints, and their reflectance."""


_NEAR: Mapping[str, tuple[str, ...]] = {
    "complexion": ("skin", "skin_dark", "lips", "fabric_pale", "hair_dark"),
    "hair": ("hair_dark", "hair_fair", "fabric_grey"),
}
_WORN = tuple(name for name in CLOTHES if not name.startswith(("skin", "lips", "hair")))
"""What the tints of a material may become; shaded skin is never cloth or hair."""


@dataclass(frozen=True, slots=True)
class Grasp(RecipeValue):
    """Where a rider touches the machine; y is that of the left, mirrored on the right.

    Attributes:
        hips: Middle of the hip joints [m].
        lean: Of the trunk, forward [rad].
        grip: Middle of the left grip [m].
        fingers: Pitch of the hands: 0 forward, negative downward [rad].
        feet: Where the balls of the left and the right foot stand [m].
        pitch: Of both feet, toes up [rad].
        knees: How far the knees point outward, y of a unit vector.
        roll: How far the grips turn inward: 0 straight across, 1 along [rad].
    """

    hips: Point
    lean: float
    grip: Point
    feet: tuple[Point, Point]
    fingers: float = -0.35
    pitch: tuple[float, float] = (0.0, 0.0)
    knees: float = 0.20
    roll: float = 0.25


PALM = np.array([0.068, 0.024])
"""From the wrist to the middle of a held grip: along the fingers, out of the palm [m]."""


def posture(grasp: Grasp) -> Posture:
    """Return the pose of a rider."""
    hips = np.array(grasp.hips)
    spine = about_y(grasp.lean)
    arms, feet = {}, {}
    for (side, s), foot, pitch in zip(SIDES.items(), grasp.feet, grasp.pitch, strict=True):
        flip = np.array([1.0, s, 1.0])
        turn = about_z(-s * grasp.roll) @ about_y(-grasp.fingers)
        fingers, palm = turn @ [1.0, 0.0, 0.0], turn @ [0.0, 0.0, -1.0]
        wrist = np.array(grasp.grip) * flip - PALM[0] * fingers - PALM[1] * palm
        # Elbows hang, the left a little wider than the right.
        aside = 0.30 + 0.06 * s
        arms[side] = Hold(wrist, fingers, palm, np.array([-0.50, aside * s, -0.85]))
        toe_out = s * 0.11
        ankle = np.array(foot) + about_z(toe_out) @ about_y(-pitch) @ [-0.113, 0.0, 0.068]
        knee = np.array([1.0, s * grasp.knees, 0.4])
        feet[side] = FootPose(ankle, pitch, pitch, toe_out, knee)
    # Riders look where they go, and a little aside.
    look = about_z(0.10) @ about_y(0.22 * grasp.lean)
    return Posture(hips, about_y(0.55 * grasp.lean), spine, look, feet, arms)


def rider(recipe: Recipe, grasp: Grasp, level: str) -> Iterator[MaterialMesh]:
    """Build a person in the saddle, in materials without tints.

    Args:
        recipe: As in `people`.
        grasp: Where the person touches the machine.
        level: One of `people.LEVELS`.
    """
    own = {**recipe, "curl": 0.85}
    for part in in_posture(own, LEVELS[level], posture(grasp)):
        yield from _untinted(part)


def _untinted(part: Part) -> Iterator[MaterialMesh]:
    """Split a part by the clothes that come nearest to its faces' tints."""
    if part.tint is None or part.role == OWN:
        yield part.material, part.mesh
        return
    names = _NEAR.get(part.material, _WORN)
    known = np.array([CLOTHES[name] for name in names])
    apart = np.log(part.tint[:, None] + 0.01) - np.log(known + 0.01)
    # Hue tells more than brightness, as shades are in the tints.
    bright = apart.mean(axis=2, keepdims=True)
    far = 3.0 * np.linalg.norm(apart - bright, axis=2) + np.abs(bright[..., 0])
    nearest = far.argmin(axis=1)
    for k in np.unique(nearest):
        yield names[k], _faces_of(part.mesh, nearest == k)


def _faces_of(mesh: Mesh, chosen: Bools) -> Mesh:
    """Some faces of a mesh."""
    used, faces = np.unique(mesh.faces[chosen], return_inverse=True)
    assert mesh.normals is not None
    return Mesh(mesh.vertices[used], faces.reshape(-1, 3), mesh.normals[used])


@dataclass(frozen=True, slots=True)
class Machine:
    """A two-wheeler, in metres behind the front of its front wheel.

    Attributes:
        wheel: Both wheels.
        axles: x of the front and the rear axle, or of the rear one alone [m].
        frame: Everything but wheels and rider, at a fineness.
        grasp: Where the rider touches it.
        lamps: What can shine.
        rider: A recipe of `library/people`.
        half_track: |y| of two wheels on the rear axle [m]; 0 for a single one.
    """

    wheel: CycleWheel
    axles: tuple[float, ...]
    frame: Callable[[Fineness], Iterator[MaterialMesh]]
    grasp: Grasp
    lamps: tuple[VehicleLamp, ...]
    rider: Recipe
    half_track: float = 0.0

    @property
    def wheel_places(self) -> tuple[tuple[float, float], ...]:
        """All wheels by x and y [m], the front one first."""
        if not self.half_track:
            return tuple((x, 0.0) for x in self.axles)
        *front, rear = self.axles
        return (*((x, 0.0) for x in front), (rear, self.half_track), (rear, -self.half_track))
