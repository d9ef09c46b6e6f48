"""No eye stands in its own body: every view, on every model and every person."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.bodies import Body, build_body
from sumo3dviz_pt.cast.choice import Choice, FigureChoice, ModelChoice, models_for
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.settings import LagrangianCamera
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Prototype
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.shot.cameras.riding import RidingCamera, build_ride

CHOICES: dict[str, Choice] = {
    model.name: ModelChoice(model, sorted(model.vclasses)[0], model.size)
    for model in models_for({})
} | {name: FigureChoice(name, 1.7) for name in catalog.names("people")}
NEAREST = 0.15
QUICK = frozenset({"sedan", "city_bus", "cargo_ship", "quadcopter", "man_shirt", "girl"})
"""Those that are tried in every run of the tests."""


def fleet_of(body: Body) -> Fleet:
    """One road user that drives straight on."""
    times = np.arange(5.0)
    positions = np.column_stack([10.0 * times, 0.0 * times, 0.0 * times])
    none = np.full(5, -1)
    trace = Trace(
        "ego", "vehicle", "", times, positions, 0 * times, 0 * times, 0 * times, none, none
    )
    motion = smooth(trace, smoother="linear", step=1.0)
    prototypes = {unit.prototype.name: unit.prototype for unit in body.assembly.units}
    fleet = Fleet((motion,), (body,), ((0.5, 0.5, 0.5),), prototypes)
    return fleet.with_cockpit("vehicle:ego")


def shapes(prototype: Prototype) -> list[Floats]:
    """Triangles of a body in each of its poses, (m, 3, 3) each."""
    meshes = [part.mesh for part in prototype.parts]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])[:-1]
    faces = np.concatenate([m.faces + first for m, first in zip(meshes, starts, strict=True)])
    rest = np.concatenate([mesh.vertices for mesh in meshes])
    poses = [rest] if prototype.poses is None else list(prototype.poses.vertices)
    return [vertices[faces] for vertices in poses]


def drawn(fleet: Fleet, camera: RidingCamera) -> Floats:
    """The own body as the camera's pictures show it, (m, 3, 3) [m]."""
    body = fleet.bodies[0]
    found = []
    for number, unit in enumerate(body.assembly.units):
        opened = camera.cutaway and number == 0
        name = fleet.cockpits["vehicle:ego"].body.name if opened else unit.prototype.name
        scale = body.scale * [unit.stretch, 1.0, 1.0]
        place = body.scale * [unit.at, 0.0, 0.0]
        found += [scale * shape + place for shape in shapes(fleet.prototypes[name])]
    return np.concatenate(found)


def nearest(eye: Floats, triangles: Floats) -> float:
    """From an eye to a body [m], if that is less than half a metre."""
    away = triangles - eye
    near = ((away.min(axis=1) < 0.5) & (away.max(axis=1) > -0.5)).all(axis=1)
    if not near.any():
        return np.inf
    points = trimesh.triangles.closest_point(triangles[near], np.tile(eye, (near.sum(), 1)))
    return float(np.linalg.norm(points - eye, axis=1).min())


def hidden(camera: RidingCamera, triangles: Floats) -> int:
    """How many of five rays over the picture end at the own body within 3 m."""
    placed = camera.aim.placed(camera.eye).matrix
    rays = np.array([(1.0, y, z) for y, z in ((0, 0), (0.3, 0.1), (-0.3, 0.1), (0.3, 0), (0, 0.2))])
    a, b, c = (triangles[:, k] for k in range(3))
    found = 0
    for ray in rays @ placed[:3, :3].T:
        across = np.cross(ray, c - a)
        scale = ((b - a) * across).sum(axis=1)
        scale = np.where(np.abs(scale) < 1e-12, np.inf, scale)
        away = camera.eye - a
        u, turned = (away * across).sum(axis=1) / scale, np.cross(away, b - a)
        v, t = (turned @ ray) / scale, ((c - a) * turned).sum(axis=1) / scale
        found += bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 3.0)).any())
    return found


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in sorted(CHOICES)],
)
def test_every_view_stands_clear_of_its_own_body(name: str) -> None:
    body = build_body(CHOICES[name], {})
    fleet = fleet_of(body)
    for view in catalog.template_names("camera"):
        settings = LagrangianCamera(mode="lagrangian", vehicle="ego", view=view)
        camera = build_ride(settings, fleet=fleet, left_hand=False)
        shown = drawn(fleet, camera)
        away = nearest(camera.eye, shown)
        assert away > NEAREST, f"{view}: {away:.3f} m from its own body"
        if view != "top":
            assert hidden(camera, shown) < 5, f"{view}: in a closed room"
