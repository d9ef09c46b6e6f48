"""Roof, pillars and doors around a driver, and the map on the screen before him."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from alike import assert_outward

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.vehicles.interior.controls import dials
from sumo3dviz_pt.library.vehicles.interior.mirrors import outer_mirrors
from sumo3dviz_pt.library.vehicles.interior.saloon import saloon
from sumo3dviz_pt.library.vehicles.interior.screen import screen, screen_lamps, screen_middle
from sumo3dviz_pt.library.vehicles.interior.shell import roof_over, shell
from sumo3dviz_pt.model.geometry import Floats, Mesh

CABINS = {
    # half, windscreen's foot, dashboard, eye, body's top
    "car": (0.87, -1.2, 0.945, (-2.12, 0.37, 1.2), 1.44),
    "van": (1.05, -0.72, 1.25, (-1.75, 0.42, 1.75), 2.62),
    "bus": (1.225, -0.1, 1.15, (-0.95, 0.55, 1.95), 3.05),
}


def made(name: str, *, side: float = 1.0) -> tuple[Floats, list[tuple[str, Mesh]]]:
    """Eye and shell of a cabin."""
    half, front, belt, place, top = CABINS[name]
    eye = np.array(place) * [1.0, side, 1.0]
    return eye, list(shell(half, front=front, belt=belt, eye=eye, top=top))


def hidden(eye: Floats, targets: Floats, triangles: Floats) -> Floats:
    """Which points an eye does not see for triangles, (n,)."""
    a, b, c = triangles.transpose(1, 0, 2)
    found = np.zeros(len(targets), bool)
    for number, target in enumerate(targets):
        way = target - eye
        across = np.cross(way, c - a)
        scale = ((b - a) * across).sum(axis=1)
        scale = np.where(np.abs(scale) < 1e-12, np.inf, scale)
        u, turned = ((eye - a) * across).sum(axis=1) / scale, np.cross(eye - a, b - a)
        v, t = (turned @ way) / scale, ((c - a) * turned).sum(axis=1) / scale
        found[number] = ((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 0.99)).any()
    return found


def triangles_of(pieces: list[tuple[str, Mesh]]) -> Floats:
    return np.concatenate([mesh.vertices[mesh.faces] for _, mesh in pieces])


@pytest.mark.parametrize("name", CABINS)
def test_every_piece_is_closed_faces_outwards_and_has_a_material(name: str) -> None:
    for material, mesh in made(name)[1]:
        assert_outward(mesh, least=0.95)
        solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
        assert solid.is_watertight and solid.volume > 0.0, material
        assert material in MATERIALS


@pytest.mark.parametrize("name", CABINS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_neither_the_road_nor_the_near_mirror_is_hidden(name: str, side: float) -> None:
    eye, pieces = made(name, side=side)
    half, front, belt, *_ = CABINS[name]
    triangles = triangles_of(pieces)
    panes = [
        mesh.vertices
        for material, mesh in outer_mirrors(half + 0.05, front=front, belt=belt, eye=eye)
        if material == "mirror"
    ]
    near = np.concatenate([pane for pane in panes if side * pane[:, 1].mean() > 0.0])
    assert not hidden(eye, near[::9], triangles).any()
    # Thirty degrees to both sides, from six under the horizon to six over it.
    aside, up = np.meshgrid(np.tan(np.radians([-29, -20, 0, 20, 29])), np.tan([-0.1, 0.0, 0.1]))
    rays = np.column_stack([np.ones(aside.size), aside.ravel(), up.ravel()])
    assert not hidden(eye, eye + 4.0 * rays, triangles).any()


@pytest.mark.parametrize("name", CABINS)
def test_a_roof_is_over_the_head_and_ends_behind_it(name: str) -> None:
    eye, pieces = made(name)
    above = np.concatenate([mesh.vertices for material, mesh in pieces if material == "headliner"])
    assert above[:, 2].min() > eye[2] + 0.15
    assert above[:, 0].min() < eye[0] - 0.5 and above[:, 0].max() < CABINS[name][1]
    assert hidden(eye, eye[None] + [-0.2, 0.0, 2.0], triangles_of(pieces)).all()


def test_a_sign_on_a_roof_does_not_raise_it() -> None:
    eye = np.array([-2.0, 0.4, 1.2])
    assert roof_over(eye, top=1.45) == pytest.approx(1.4, abs=0.01)
    assert roof_over(eye, top=3.0) == roof_over(eye, top=2.0)
    assert roof_over(eye, top=1.2) > eye[2] + 0.15


def test_the_screen_shows_streets_of_several_widths_within_its_frame() -> None:
    eye = np.array([-2.1, 0.37, 1.2])
    pieces = list(screen(eye, belt=0.95))
    low, high = next(mesh for material, mesh in pieces if material == "gloss_black").bounds
    layers = [(material, mesh) for material, mesh in pieces if material.startswith("screen_")]
    assert {"screen_land", "screen_street", "screen_road", "screen_route"} <= {m for m, _ in layers}
    planes = [mesh.vertices[0, 0] for _, mesh in layers]
    assert len(set(np.round(planes, 5))) == len(planes), "no two layers lie in one plane"
    assert max(planes) < low[0]
    for material, mesh in layers:
        assert material in MATERIALS
        assert (mesh.bounds[0, 1:] > low[1:] - 0.002).all(), material
        assert (mesh.bounds[1, 1:] < high[1:] + 0.002).all(), material
    for lamp in screen_lamps(eye):
        assert (np.abs(np.array(lamp.at[1:]) - screen_middle(eye)[1:]) < [0.115, 0.041]).all()


def test_both_dials_have_numbers_that_neither_touch_nor_leave_the_dial() -> None:
    eye = np.array([-2.1, 0.37, 1.2])
    ways = [mesh.vertices - eye for material, mesh in dials(eye) if material == "plate"]
    for left in (0.078, -0.078):
        texts = [at for at in ways if abs(at[:, 1].mean() - left) < 0.045 and len(at) > 6]
        assert len(texts) == 8, "seven numbers and a unit"
        lows = np.array([at[:, 1:].min(axis=0) for at in texts])
        highs = np.array([at[:, 1:].max(axis=0) for at in texts])
        apart = (lows[:, None] > highs[None]) | (lows[None] > highs[:, None])
        assert (apart.any(axis=2) | np.eye(8, dtype=bool)).all()
        reach = [np.hypot(at[:, 1] - left, at[:, 2] + 0.204).max() for at in texts]
        assert max(reach) < 0.036


def seats_of_a_bus() -> tuple[Floats, list[tuple[str, Mesh]]]:
    """The driver's eye and the passengers' room of a city bus."""
    half, _, _, place, top = CABINS["bus"]
    eye = np.array(place)
    return eye, list(saloon(half, front=eye[0] - 1.1, rear=-12.0, eye=eye, top=top))


def test_passengers_room_is_closed_pieces_behind_the_driver_with_a_free_gangway() -> None:
    eye, pieces = seats_of_a_bus()
    for material, mesh in pieces:
        assert_outward(mesh, least=0.95)
        assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=True).is_watertight, material
        assert material in MATERIALS
        low, high = mesh.bounds
        assert low[0] > -12.0 and high[0] <= eye[0] - 1.1 + 1e-9
        through = low[1] < 0.0 < high[1]
        assert not through or material in ("headliner", "trim") or high[0] < -11.8


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_passengers_see_the_street_through_their_windows(side: float) -> None:
    """Most of what lies to a seat's side and a little ahead is free."""
    eye, pieces = seats_of_a_bus()
    triangles = triangles_of(pieces)
    yaw, pitch = np.meshgrid(np.radians([50.0, 70.0, 90.0]), np.radians([-12.0, 0.0, 8.0]))
    ways = np.stack(
        [np.cos(yaw) * np.cos(pitch), side * np.sin(yaw) * np.cos(pitch), np.sin(pitch)], axis=-1
    ).reshape(-1, 3)
    seats = [
        eye + np.array([-back, side * 0.55 - eye[1], -0.2]) for back in np.arange(3.0, 9.0, 0.76)
    ]
    shares = [hidden(seat, seat + 6.0 * ways, triangles).mean() for seat in seats]
    assert np.mean(shares) < 0.35 and max(shares) < 0.6
