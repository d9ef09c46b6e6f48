"""Lamps of vehicles light what is around them as photometry says, still and in a film."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    RAW,
    box,
    constant_sky,
    diffuse,
    frame_of,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)

from sumo3dviz_pt.cast.lamps import running_lights
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.vehicles.lamps import low_beam
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Part, Prototype, Slots, VehicleLamp

pytestmark = pytest.mark.slow

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
ALBEDO = 0.5
HEAD, TAIL = 1.5, 0.8
WALL = 25.0
SIZE = (96, 54)
FINE = RAW.model_copy(update={"spp": 64, "pass_spp": 64, "max_depth": 2})

LAMPS = (
    VehicleLamp("head", (0.01, 0.6, HEAD), (0.2, 0.12), 0.0),
    VehicleLamp("head", (0.01, -0.6, HEAD), (0.2, 0.12), 0.0),
    VehicleLamp("brake", (-4.01, 0.6, TAIL), (0.2, 0.12), np.pi),
    VehicleLamp("brake", (-4.01, -0.6, TAIL), (0.2, 0.12), np.pi),
)
MATERIAL = {"car": diffuse(0.1), "wall": diffuse(ALBEDO), "signal_lens": MATERIALS["signal_lens"]}


def upright(x, *, facing):
    """A large wall at x [m] that faces -x or +x."""
    y, z = 60.0, 40.0
    corners = np.array([[x, -y, 0.0], [x, y, 0.0], [x, y, z], [x, -y, z]])
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    return Mesh(corners, faces if facing < 0 else faces[:, ::-1])


def body(name="car"):
    mesh = box((-4.0, -0.9, 0.3), (0.0, 0.9, 1.4))
    part = Part(mesh, "car")
    return Prototype(name, (part,), (part,), LAMPS)


def night(walls, *, near=1, far=0):
    lights = running_lights([body()], dark=True, left_hand=False)
    slots = Slots({"car": near} if near else {}, {"car": far} if far else {})
    scene = scene_of(
        [static(f"w{k}", wall, "wall") for k, wall in enumerate(walls)],
        MATERIAL,
        sky=constant_sky(1e-12),
        prototypes=[body()],
        slots=slots,
    )
    return replace(scene, running=lights)


def car(place=(0.0, 0.0, 0.0), *, lit=("head",), name="vehicle:a", yaw=0.0):
    return replace(
        mover(name, place, (0.1, 0.1, 0.1), prototype="car", yaw=yaw), lit=frozenset(lit)
    )


def lux(radiance):
    """Illuminance on a matt wall of `ALBEDO` from its radiance."""
    return radiance @ LUMINANCE * np.pi / ALBEDO * CANDELAS_PER_UNIT


def eye(*, height=9.0):
    """Over the car, towards the wall."""
    return view_at([0.0, 0.0, height], heading=90, pitch=-8.0, fov=60)


def angles(view):
    """Degrees right of and above the beam's axis, of every pixel's point on the wall."""
    rays = view.directions(SIZE)
    points = view.position + rays * ((WALL - view.position[0]) / rays[..., :1])
    x, y, z = np.moveaxis(points - [0.06, 0.0, HEAD], -1, 0)
    return np.degrees(np.arctan2(-y, x)), np.degrees(np.arctan2(z, np.hypot(x, y))), points


@pytest.fixture(scope="module", params=["kernel", "path"])
def session(request):
    scene = night([upright(WALL, facing=-1)])
    quality = FINE.model_copy(update={"tracer": request.param})
    with session_of(scene, size=SIZE, quality=quality) as opened:
        yield opened


def test_head_lamps_light_a_wall_as_the_regulation_asks(session):
    view = eye()
    found = lux(session.render(frame_of(view, movers=[car()])).radiance.astype(float))
    across, up, points = angles(view)
    away = np.linalg.norm(points - [0.06, 0.0, HEAD], axis=-1)
    # The lenses themselves glow with 25 cd on their axis, as oncoming eyes see them.
    candelas = 2.0 * low_beam(across, up) + 50.0 * points[..., 0] / away
    expected = candelas * (points[..., 0] / away) / away**2
    bright = (expected > 8.0) & (up < -1.0) & (points[..., 2] > 0)
    assert bright.sum() > 30
    ratio = found[bright] / expected[bright]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.06)
    dark = (up > 3.0) & (points[..., 2] < 8)
    assert found[dark].mean() < 4.0


def test_lamps_that_are_off_light_nothing(session):
    radiance = session.render(frame_of(eye(), movers=[car(lit=())])).radiance
    assert lux(radiance.astype(float)).max() < 1e-3


def test_light_goes_with_the_car(session):
    """Also across the grid of the renderer's origins, back again, and after being off."""
    view = eye()
    first = session.render(frame_of(view, movers=[car()])).radiance
    for away in (3.0, 600.0):
        moved = view_at([away, 0.0, 9.0], heading=90, pitch=-8.0, fov=60)
        frame = frame_of(moved, movers=[car((away, 0.0, 0.0))])
        assert not np.allclose(session.render(frame).radiance, first)
    again = session.render(frame_of(view, movers=[car()])).radiance
    np.testing.assert_allclose(again, first, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("level", ["movers", "far"])
@pytest.mark.parametrize("yaw", [0.0, 1.1])
def test_brake_lamps_shine_backwards(level, yaw):
    """The ground behind gets what two small lamps of 110 cd give it through their lobes."""
    scene = night([plane(60.0)], near=level == "movers", far=level == "far")
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    spot = np.append(turn @ [-7.0, 0.0], 0.0)
    view = view_at([*spot[:2], 30.0], pitch=-89.99, fov=0.5)
    with session_of(scene, size=(16, 16), quality=FINE) as opened:
        frame = frame_of(view, **{level: [car(lit=("brake",), yaw=yaw)]})
        found = lux(opened.render(frame).radiance.astype(float)).mean()
    lamps = np.array([[-4.01, 0.6, TAIL], [-4.01, -0.6, TAIL]])
    ways = np.array([-7.0, 0.0, 0.0]) - lamps
    away = np.linalg.norm(ways, axis=1)
    leaving, arriving = -ways[:, 0] / away, -ways[:, 2] / away
    lobe = scene.running.lobes["brake"]
    expected = float((110.0 * lobe.at(leaving) * leaving * arriving / away**2).sum())
    assert found == pytest.approx(expected, rel=0.04)


def test_the_farthest_beams_fade():
    """More cars than spots: nobody's light appears or vanishes from one frame to the next."""
    from sumo3dviz_pt.render.lights.running import MOST_BEAMS, Beams

    scene = night([plane(60.0)], near=60)
    assert scene.running is not None and scene.running.beam is not None
    beams = Beams(scene, scene.running.beam, {})
    assert beams.count == MOST_BEAMS
    rows = [car((float(x), 0.0, 0.0), name=f"vehicle:{x:04d}") for x in range(0, 60)]
    shares = []
    for step in np.arange(0, 3.0, 0.05):
        view = view_at([step, 0.0, 2.0], heading=90)
        shown = beams._shining(frame_of(view, movers=rows))
        places = {round(float(place.position[0] - 0.06)): share for place, share in shown}
        shares.append([places.get(k, 0.0) for k in range(60)])
    assert np.abs(np.diff(np.array(shares), axis=0)).max() < 0.05


@pytest.mark.parametrize("ahead", [10.0, 25.0, 40.0])
def test_the_road_ahead_gets_what_the_beam_gives(ahead):
    """Horizontal illuminance of both beams and both lenses, E = I h / r^3."""
    scene = night([plane(120.0)])
    view = view_at([ahead, 0.0, 30.0], pitch=-89.99, fov=0.5)
    with session_of(scene, size=(16, 16), quality=FINE) as opened:
        found = lux(opened.render(frame_of(view, movers=[car()])).radiance.astype(float)).mean()
    away = np.hypot(ahead - 0.06, HEAD)
    up = -np.degrees(np.arctan2(HEAD, ahead - 0.06))
    candelas = 2.0 * float(low_beam(np.array(0.0), np.array(up))) + 50.0 * ahead / away
    assert found == pytest.approx(candelas * HEAD / away**3, rel=0.1)
    assert {10.0: 2.5, 25.0: 1.0, 40.0: 0.3}[ahead] < found < 40.0


def test_lamps_have_their_colour():
    """Indicators are amber; brake lamps are red, and far brighter than tail lamps."""
    roles = ("left", "right", "brake", "tail")
    lamps = tuple(replace(LAMPS[2], role=role) for role in roles)
    lights = running_lights([replace(body(), lamps=lamps)], dark=True, left_hand=False)
    assert lights is not None
    for role in ("left", "right"):
        red, green, blue = lights.intensity[role]
        assert 0.2 < green / red < 0.5 and blue < 0.05 * red
    for role in ("brake", "tail"):
        assert max(lights.intensity[role][1:]) < 0.05 * lights.intensity[role][0]
    assert lights.intensity["brake"][0] > 8.0 * lights.intensity["tail"][0]


def test_the_cap_leaves_lamps_that_are_seen():
    """What an eye 20 m ahead gets from both lenses is their intensity over 400 m^2."""
    quality = FINE.model_copy(update={"cap": 40.0, "spp": 64})
    view = view_at([20.0, 0.0, HEAD], heading=-90, fov=8)
    scene = night([plane(30.0)])
    with session_of(scene, size=(128, 32), quality=quality, white=1e-4) as opened:
        radiance = opened.render(frame_of(view, movers=[car()])).radiance.astype(float)
    pixel = (2.0 * view.lens.half_width / 128) ** 2
    candelas = float(radiance.sum(axis=(0, 1)) @ LUMINANCE) * pixel * CANDELAS_PER_UNIT * 20.0**2
    assert candelas == pytest.approx(50.0, rel=0.1)


def test_lamps_smaller_than_a_pixel_do_not_go_on_and_off():
    """With four samples each lens was seen by none in every other frame."""
    quality = FINE.model_copy(update={"cap": 40.0, "spp": 4, "pass_spp": 4})
    view = view_at([20.0, 0.0, HEAD], heading=-90, fov=60)
    shown = []
    with session_of(night([plane(30.0)]), size=(64, 36), quality=quality, white=1e-4) as opened:
        for seed in range(8):
            opened.retune(quality, seed=seed)
            shown.append(opened.render(frame_of(view, movers=[car()])).radiance.sum())
    assert min(shown) > 0.4 * np.mean(shown)
    assert np.std(shown) < 0.4 * np.mean(shown)
