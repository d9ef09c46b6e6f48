"""No eye stands in its own body: every view, on every model and every person."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.bodies import Body, build_body, cabin_of
from sumo3dviz_pt.cast.choice import Choice, FigureChoice, ModelChoice, models_for
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.settings import LagrangianCamera
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Prototype
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.shot.cameras.riding import RidingCamera, build_ride, read_view

CHOICES: dict[str, Choice] = {
    model.name: ModelChoice(model, sorted(model.vclasses)[0], model.size)
    for model in models_for({})
} | {name: FigureChoice(name, 1.7) for name in catalog.names("people")}
PEOPLE = frozenset(catalog.names("people"))
NEAREST = 0.15
QUICK = frozenset(
    {"sedan", "city_bus", "boat", "cargo_ship", "light_aircraft", "quadcopter", "man_shirt", "girl"}
)
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


ALL = [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in sorted(CHOICES)]
WIDE, TALL = 24, 14  # rays over a picture
FEW_BACKS = 0.02  # share of a picture: seams and gaps between panels


def first_hits(camera: RidingCamera, triangles: Floats, rays: Floats) -> tuple[Floats, Floats]:
    """How far rays of the camera run to the own body, and how much they go with its normals."""
    back = np.linalg.inv(camera.aim.placed(camera.eye).matrix)
    corners = triangles @ back[:3, :3].T + back[:3, 3]
    a, b, c = corners[corners[..., 0].max(axis=1) > 0.0].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    through_sides = np.stack([np.cross(u, v) for u, v in ((a, b), (b, c), (c, a))])
    far, along = np.full(len(rays), np.inf), np.zeros(len(rays))
    for k, ray in enumerate(rays):
        sides = through_sides @ ray
        met = np.flatnonzero((sides >= 0.0).all(axis=0) | (sides <= 0.0).all(axis=0))
        slope = normals[met] @ ray
        away = (normals[met] * a[met]).sum(axis=1) / np.where(slope == 0.0, np.inf, slope)
        away[away <= 0.0] = np.inf
        if len(away) and np.isfinite(away.min()):
            nearest_one = int(np.argmin(away))
            far[k], along[k] = away[nearest_one], slope[nearest_one]
    return far, along


def check_from_inside(fleet: Fleet, view: str) -> None:
    """Fail where a view shows a back of the own body, or of one of its lamps."""
    settings = LagrangianCamera(mode="lagrangian", vehicle="ego", view=view)
    camera = build_ride(settings, fleet=fleet, left_hand=False)
    reach = np.tan(np.radians(read_view(view).fov) / 2.0)
    left, up = np.meshgrid(np.linspace(reach, -reach, WIDE), reach * np.linspace(0.56, -0.56, TALL))
    rays = np.stack([np.ones(left.size), left.ravel(), up.ravel()], axis=1)
    _, along = first_hits(camera, drawn(fleet, camera), rays)
    assert (along > 0.0).mean() < FEW_BACKS, "the own body is open and black inside"
    # The back of a lamp is black too: something of the body is before it, or it is out of view.
    opened = fleet.cockpits["vehicle:ego"].body
    for lamp in opened.lamps:
        away = fleet.bodies[0].scale * lamp.at - camera.eye
        ahead = np.linalg.inv(camera.aim.placed(np.zeros(3)).matrix)[:3, :3] @ away
        shows_its_back = away @ [np.cos(lamp.yaw), np.sin(lamp.yaw), 0.0] > 0.0
        in_view = (np.abs(ahead[1:]) < ahead[0] * reach * np.array([1.0, 0.56])).all()
        if shows_its_back and in_view:
            far, _ = first_hits(camera, drawn(fleet, camera), ahead[None])
            assert far[0] < 1.0, f"{lamp.role} hangs in the air"


@pytest.mark.parametrize("name", [each for each in ALL if each.values[0] not in PEOPLE])
def test_no_own_wall_is_seen_from_inside(name: str) -> None:
    fleet = fleet_of(build_body(CHOICES[name], {}))
    for view in ("driver", "passenger"):
        check_from_inside(fleet, view)


ROAD = [each for each in ALL if each.values[0] not in PEOPLE]


@pytest.mark.parametrize("name", ROAD)
@pytest.mark.parametrize(("left_hand", "stretched"), [(False, 1.0), (True, 0.9), (False, 1.15)])
def test_a_dash_camera_sees_the_road_and_at_most_a_bonnet(
    name: str, left_hand: bool, stretched: float
) -> None:
    """No mirror, dial or screen is in its picture, and no more than its lowest part is hidden."""
    choice = CHOICES[name]
    assert isinstance(choice, ModelChoice)
    length, width, height = choice.size
    body = build_body(replace(choice, size=(stretched * length, width, height)), {})
    if not cabin_of(body).is_driven or width < 1.3:
        return
    fleet = fleet_of(body).with_cockpit("vehicle:ego", left_hand=left_hand)
    settings = LagrangianCamera(mode="lagrangian", vehicle="ego", view="dashcam")
    camera = build_ride(settings, fleet=fleet, left_hand=left_hand)
    # A barrel shows a little more than its opening says.
    reach = 1.08 * np.tan(camera.lens.opening / 2.0)
    left, up = np.meshgrid(np.linspace(reach, -reach, WIDE), reach * np.linspace(0.56, -0.56, TALL))
    rays = np.stack([np.ones(left.size), left.ravel(), up.ravel()], axis=1)
    far, _ = first_hits(camera, drawn(fleet, camera), rays)
    hits = np.isfinite(far).reshape(TALL, WIDE)
    assert not hits[: TALL * 2 // 3].any(), "the road is hidden"
    if body.seat.cowl[0] < -1.0:
        assert hits[-1].mean() > 0.5, "no bonnet"


@pytest.mark.parametrize("name", ALL)
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
