"""What is behind a vehicle is seen in its mirrors, where optics say; it guides the denoiser."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import RAW, ball, box, diffuse, frame_of, plane, scene_of, session_of, static

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.vehicles.interior.cutaway import cutaway
from sumo3dviz_pt.model.geometry import Transform, unit
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import LampSet, Mover, Part, Prototype, Slots, View

pytestmark = pytest.mark.usefixtures("compiled")

SIZE = (120, 68)
RED = (0.7, 0.02, 0.02)
YAW = 0.4
BODY = Transform.from_pose((40.0, -25.0, 0.0), yaw=YAW)
LAYERS = ("radiance", "albedo", "normal", "hit", "depth", "ids", "first_depth")
CASES = {
    # width, height, cowl, belt, eye; which pane; where the ball is in the body's frame
    "inner": ((1.84, 1.44, -1.2, 0.95, (-2.12, 0.37, 1.2)), 0, (-28.0, 1.0, 1.0)),
    "left": ((1.84, 1.44, -1.2, 0.95, (-2.12, 0.37, 1.2)), 1, (-20.0, 3.5, 0.8)),
    "right": ((1.84, 1.44, -1.2, 0.95, (-2.12, 0.37, 1.2)), 2, (-20.0, -3.5, 0.8)),
    "of a driver on the right": (
        (1.84, 1.44, -1.2, 0.95, (-2.12, -0.37, 1.2)),
        2,
        (-20.0, -3.5, 0.8),
    ),
    "bus, left": ((2.55, 3.05, -0.1, 1.15, (-0.95, 0.55, 1.95)), 0, (-24.0, 3.5, 1.0)),
    "bus, left, wide": ((2.55, 3.05, -0.1, 1.15, (-0.95, 0.55, 1.95)), 1, (-8.0, 3.5, 1.0)),
    "bus, right": ((2.55, 3.05, -0.1, 1.15, (-0.95, 0.55, 1.95)), 2, (-24.0, -3.5, 1.0)),
}


def opened(width, height, cowl, belt, eye):
    """A box that a driver sits in."""
    shell = Part(box((-4.0, -width / 2, 0.3), (0.0, width / 2, height)), "trim")
    whole = Prototype("car", (shell,), ())
    return cutaway(whole, cowl=cowl, belt=belt, eye=np.array(eye))


def panes_of(body):
    return [part.mesh for part in body.parts if part.material == "mirror"]


def looking_at(eye, aim, *, fov=20.0):
    """A view from one point of the body to another, narrow unless it is said."""
    start, end = BODY.points(np.array([eye, aim]))
    way = end - start
    yaw, pitch = np.arctan2(way[1], way[0]), np.arcsin(way[2] / np.linalg.norm(way))
    return View(Transform.from_pose(start, yaw=yaw, pitch=pitch), Lens.of_degrees(fov))


def rendered(body, view, target, spp=64):
    """Layers of a frame with a red ball behind a body."""
    parts = [
        static("ground", plane(200.0), "grey"),
        static("ball", ball(BODY.points(np.array([target]))[0], 0.5), "red"),
    ]
    materials = {**MATERIALS, "grey": diffuse(0.4, 0.4, 0.4), "red": diffuse(*RED)}
    scene = scene_of(parts, materials, prototypes=[body], slots=Slots({body.name: 1}))
    state = frame_of(view, movers=[Mover("own", body.name, BODY, (0.5, 0.5, 0.5))])
    quality = RAW.model_copy(update={"spp": spp, "pass_spp": spp})
    with session_of(scene, size=SIZE, quality=quality, layers=LAYERS) as session:
        return session.render(state)


def by_optics(pane, eye, target):
    """The point of a pane at which an eye sees a target: where the way by it is stationary."""
    corners = pane.vertices[pane.faces]
    normals = pane.normals[pane.faces]
    # Many points of the pane, and of its normals.
    rng = np.random.default_rng(1)
    shares = rng.dirichlet((1.0, 1.0, 1.0), 40)
    points = np.einsum("kc,fcx->fkx", shares, corners).reshape(-1, 3)
    facing = unit(np.einsum("kc,fcx->fkx", shares, normals).reshape(-1, 3))
    way = unit(points - eye)
    onwards = way - 2.0 * (way * facing).sum(axis=1, keepdims=True) * facing
    aside = np.linalg.norm(np.cross(unit(target - points), onwards), axis=1)
    best = np.argsort(aside)[:6]
    assert aside[best[0]] < 0.01, "the pane shows it"
    return points[best].mean(axis=0)


def projected(view, points):
    """Rows and columns of points of the body in a picture, (2, n)."""
    away = (BODY.points(points) - view.position) @ view.world_from_camera.matrix[:3, :3]
    places, ahead = view.lens.project(away, SIZE)
    assert ahead.all()
    return np.asarray(places)


@pytest.mark.parametrize("case", CASES)
def test_a_body_behind_is_seen_where_optics_demand(case):
    vehicle, number, target = CASES[case]
    body, eye = opened(*vehicle), np.array(vehicle[-1])
    pane = panes_of(body)[number]
    place = by_optics(pane, eye, np.array(target))
    view = looking_at(eye, pane.vertices.mean(axis=0))
    seen = rendered(body, view, target)
    (row, column) = projected(view, place[None])
    # The pane below, which is also in the picture, shows the ball a second time.
    (low, left), (high, right) = (
        edge(projected(view, pane.vertices), axis=1) for edge in (np.min, np.max)
    )
    albedo = seen.layers["albedo"]
    red = np.clip((albedo[..., 0] - albedo[..., 1]) / (RED[0] - RED[1]), 0.0, 1.0)
    rows, columns = np.indices(red.shape)
    red *= (rows > low) & (rows < high) & (columns > left) & (columns < right)
    assert red.sum() > 1.0, "there is something red"
    middle = [(grid * red).sum() / red.sum() for grid in np.indices(red.shape)]
    np.testing.assert_allclose(middle, [row[0], column[0]], atol=0.8)


def test_guides_and_picture_are_of_what_the_mirror_shows():
    vehicle, number, target = CASES["inner"]
    body, eye = opened(*vehicle), np.array(vehicle[-1])
    pane = panes_of(body)[number]
    view = looking_at(eye, by_optics(pane, eye, np.array(target)))
    seen = rendered(body, view, target, spp=16)
    middle = SIZE[1] // 2, SIZE[0] // 2
    np.testing.assert_allclose(seen.layers["albedo"][middle], RED, atol=0.02)
    assert seen.layers["radiance"][middle][0] > 5.0 * seen.layers["radiance"][middle][1]
    # The normal is that of the ball's near side, not the pane's.
    towards = BODY.directions(np.array([[1.0, 0.0, 0.0]]))[0]
    assert seen.layers["normal"][middle] @ towards > 0.6
    # The depth stays that of the pane.
    away = np.linalg.norm(pane.vertices.mean(axis=0) - eye)
    assert seen.layers["depth"][middle] == pytest.approx(away, abs=0.1)


def test_what_mirrors_show_is_not_averaged_over_frames():
    vehicle, number, target = CASES["inner"]
    body, eye = opened(*vehicle), np.array(vehicle[-1])
    view = looking_at(eye, panes_of(body)[number].vertices.mean(axis=0))
    seen = rendered(body, view, target, spp=4)
    ids = seen.layers["ids"].astype(int)
    number = ids[SIZE[1] // 2, SIZE[0] // 2]
    assert seen.movers[number - 1].name == "mirrored"
    assert seen.movers[number - 1].world_from_part is None
    assert (ids == 1).any(), "the rest of the cabin is the vehicle's"


@pytest.fixture
def ride():
    """A scene, and a frame from the driver's seat with the inner mirror in the picture."""
    vehicle, _, target = CASES["inner"]
    body = opened(*vehicle)
    parts = [
        static("ground", plane(200.0), "grey"),
        static("ball", ball(BODY.points(np.array([target]))[0], 0.5), "red"),
    ]
    materials = {**MATERIALS, "grey": diffuse(0.4, 0.4, 0.4), "red": diffuse(*RED)}
    scene = scene_of(parts, materials, prototypes=[body], slots=Slots({body.name: 1}))
    eye = np.array(vehicle[-1])
    view = looking_at(eye, eye + np.array((1.0, 0.0, 0.1)), fov=70.0)
    return scene, frame_of(view, movers=[Mover("own", body.name, BODY, (0.5, 0.5, 0.5))])


def with_lamp(scene):
    """The same scene with a lamp beside the ball, which shines to all sides."""
    middle = BODY.points(np.array([CASES["inner"][2]]))[0] + [0.0, 0.0, 0.8]
    mesh = box(middle - 0.15, middle + 0.15)
    faces = np.zeros(len(mesh.faces), int)
    bright = np.full((1, 3), 100.0)
    lamp = LampSet("lamp", "signals", mesh, faces, ("one",), sampled=True, radiance=bright)
    return replace(scene, lamps=(lamp,))


def with_seeds(ride, count, **changes):
    """Pictures of two samples by many seeds, and where mirrors are seen in them."""
    scene, state = ride
    quality = RAW.model_copy(update={"spp": 2, "pass_spp": 2, **changes})
    with session_of(scene, size=SIZE, quality=quality, layers=LAYERS) as session:
        found = []
        for seed in range(count):
            session.retune(quality, seed=seed)
            found.append(session.render(state).layers["radiance"])
        mirrors = session.by_kernel.current().mirrors
        return np.stack(found), mirrors.areas(state.view, SIZE)


@pytest.mark.slow
def test_mirrors_get_more_samples_where_frames_are_averaged(ride):
    plain, areas = with_seeds(ride, 24)
    more, again = with_seeds(ride, 24, accumulate=4)
    assert areas == again and len(areas) == 1, "the inner mirror is in the picture"
    there = np.zeros(SIZE[::-1], np.bool_)
    there[areas[0].slices] = True
    np.testing.assert_array_equal(plain[:, ~there], more[:, ~there])
    # Three times the samples have a third of the variance, and the same mean.
    ours, theirs = (pictures[:, there].var(axis=0, ddof=1).mean() for pictures in (more, plain))
    assert 0.22 < ours / theirs < 0.5
    off = more[:, there].mean(axis=(1, 2)) - plain[:, there].mean(axis=(1, 2))
    assert abs(off.mean()) < 4.0 * off.std(ddof=1) / np.sqrt(len(off))


def test_the_area_of_a_mirror_holds_all_that_it_shows(ride):
    scene, state = ride
    quality = RAW.model_copy(update={"spp": 16, "pass_spp": 16})
    with session_of(scene, size=SIZE, quality=quality, layers=LAYERS) as session:
        seen = session.render(state)
        (area,) = session.by_kernel.current().mirrors.areas(state.view, SIZE)
    number = 1 + [mover.name for mover in seen.movers].index("mirrored")
    shown = seen.layers["ids"].astype(int) == number
    assert shown.sum() > 0.4 * area.pixels
    shown[area.slices] = False
    assert not shown.any()


@pytest.mark.slow
def test_without_mirrors_there_is_nothing_to_trace_again(ride):
    scene, state = ride
    away = View(Transform.from_pose(state.view.position, yaw=YAW + np.pi), Lens.of_degrees(70.0))
    quality = RAW.model_copy(update={"accumulate": 4})
    plain = scene_of([static("ground", plane(200.0), "grey")], {"grey": diffuse(0.4, 0.4, 0.4)})
    with session_of(plain, size=SIZE, quality=quality, layers=LAYERS) as session:
        session.render(frame_of(state.view))
        assert session.by_kernel.current().mirrors is None
    with session_of(scene, size=SIZE, quality=quality, layers=LAYERS) as session:
        session.render(frame_of(away, movers=list(state.movers)))
        assert session.by_kernel.current().mirrors.areas(away, SIZE) == ()


@pytest.mark.slow
def test_lamps_in_mirrors_have_the_light_that_paths_find_there_and_less_noise(ride):
    """Distant head lamps came and went in the mirror from frame to frame."""
    lit = with_lamp(ride[0]), ride[1]
    plain, (area,) = with_seeds(lit, 32, cap=None)
    # A cap that takes nothing: lamps that are seen directly are traced by themselves.
    apart, _ = with_seeds(lit, 32, cap=1e6)
    inside = (slice(None), *area.slices)
    one, other = (pictures[inside].sum(axis=(1, 2, 3)) for pictures in (apart, plain))
    off = one.mean() - other.mean()
    assert abs(off) < 4.0 * np.hypot(one.std(ddof=1), other.std(ddof=1)) / np.sqrt(len(one))
    bright = plain[inside].mean(axis=(0, -1)) > 3.0
    assert bright.sum() >= 1, "the lamp is in the mirror"
    less, more = (
        pictures[inside].mean(axis=-1)[:, bright].var(axis=0) for pictures in (apart, plain)
    )
    assert less.mean() < 0.4 * more.mean()
