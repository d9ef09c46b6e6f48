"""Dashboard and steering wheel before a driver."""

import numpy as np
import pytest
from alike import assert_outward

from sumo3dviz_pt.library.vehicles.interior.cockpit import cockpit, cockpit_lamps
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.render.lights.running import clear_lamps

CAR = {"front": -1.1, "belt": 0.95, "edge": 1.0}
EYE = np.array([-2.1, 0.37, 1.2])


def made(width=1.8, *, eye=EYE, **given):
    return list(cockpit(width, **{**CAR, **given}, eye=eye))


def shelf_of(pieces):
    return next(mesh for material, mesh in pieces if material == "dash_pad")


def wheel_of(pieces):
    """The rim, (n, 3)."""
    return next(mesh for material, mesh in pieces if material == "leather_rim").vertices


def hood_of(pieces):
    """The skin of the hood over the instruments, (n, 3)."""
    return [mesh for material, mesh in pieces if material == "dash_pad"][1].vertices


@pytest.mark.parametrize("width", [1.6, 1.8, 2.55])
def test_shelf_fits_between_the_doors_and_ends_at_the_bonnet(width):
    low, high = shelf_of(made(width)).bounds
    assert -width / 2 < low[1] and high[1] < width / 2
    assert high[1] == pytest.approx(-low[1])
    assert high[0] == pytest.approx(CAR["front"] + 0.03)
    assert -0.6 < low[0] - CAR["front"] < -0.4
    assert low[2] >= 0.2


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_hood_and_wheel_are_before_the_driver(side):
    eye = EYE * [1.0, side, 1.0]
    pieces = made(eye=eye)
    hood = hood_of(pieces)
    assert hood[:, 1].mean() == pytest.approx(eye[1], abs=0.02)
    assert hood[:, 2].max() > shelf_of(pieces).vertices[:, 2].max()
    assert wheel_of(pieces)[:, 1].mean() == pytest.approx(eye[1], abs=0.02)


@pytest.mark.parametrize(("width", "radius"), [(1.8, 0.187), (2.55, 0.23)])
def test_wheel_is_a_ring_ahead_of_and_below_the_eye(width, radius):
    points = wheel_of(made(width))
    low, high = points.min(axis=0), points.max(axis=0)
    assert high[1] - low[1] == pytest.approx(2 * (radius + 0.0155), abs=2e-3)
    assert high[2] < EYE[2] - 0.05 and low[0] > EYE[0] + 0.2
    # It leans: the top is farther from the driver than the bottom.
    rim = points
    top, bottom = rim[np.argmax(rim[:, 2])], rim[np.argmin(rim[:, 2])]
    assert top[0] > bottom[0] + radius * 0.5


def test_the_road_is_seen_over_the_dashboard():
    """Eleven degrees under the horizon nothing but the wipers is in the way."""
    pieces = [mesh for material, mesh in made() if material not in ("mirror", "trim", "interior")]
    away = np.concatenate([mesh.vertices for mesh in pieces]) - EYE
    dip = np.degrees(np.arctan2(-away[:, 2], away[:, 0]))
    assert dip.min() > 11.0


def test_meshes_have_area_and_unit_normals_that_agree_with_faces():
    for _, mesh in made():
        assert_outward(mesh, least=0.9)


def test_shelf_looks_up_and_the_rim_outwards():
    pieces = made()
    prototypes = shelf_of(pieces)
    rim = next(mesh for material, mesh in pieces if material == "leather_rim")
    flat = prototypes.normals[prototypes.vertices[:, 0] > CAR["front"] - 0.25]
    assert (flat[:, 2] > 0.0).all()
    middle = rim.vertices.mean(axis=0)
    away = rim.vertices - middle
    farthest = np.linalg.norm(away, axis=1) > 0.195
    assert ((away * rim.normals).sum(axis=1)[farthest] > 0.0).all()


def test_instruments_glow_before_the_driver_and_nothing_hides_them():
    lamps = cockpit_lamps(belt=CAR["belt"], eye=EYE)
    assert {lamp.role for lamp in lamps} == {"dials", "screen"}
    moved = clear_lamps(lamps, [Part(mesh, material) for material, mesh in made()])
    for lamp, seen in zip(lamps, moved, strict=True):
        assert seen.at == lamp.at
        away = np.array(lamp.at) - EYE
        assert 0.5 < away[0] < 0.8 and away[2] < -0.1


def test_trucks_have_neither_instruments_nor_an_inner_mirror_in_view():
    eye = np.array([-1.2, 0.7, 2.3])
    pieces = made(2.5, eye=eye, front=-0.08, belt=1.2, edge=1.2)
    assert "mirror" not in {material for material, _ in pieces}
    assert not cockpit_lamps(belt=1.2, eye=eye)


def test_the_mirror_shows_the_driver_what_is_behind():
    pane = next(mesh for material, mesh in made() if material == "mirror")
    middle = pane.vertices.mean(axis=0)
    facing = pane.normals.mean(axis=0, where=pane.normals[:, :1] < -0.9)
    facing /= np.linalg.norm(facing)
    seen = (middle - EYE) / np.linalg.norm(middle - EYE)
    way = seen - 2.0 * (seen @ facing) * facing
    assert way[0] < -0.97 and abs(way[2]) < 0.1


def test_the_dashboard_follows_the_bent_glass_and_its_seam_is_sewn():
    pieces = made()
    shelf = shelf_of(pieces).vertices
    ends = shelf[np.abs(shelf[:, 1]) > 0.99 * shelf[:, 1].max()]
    assert shelf[:, 0].max() - ends[:, 0].max() == pytest.approx(0.1, abs=0.01)
    thread = [mesh for material, mesh in pieces if material == "stitch"]
    assert len(thread) == 1 and len(thread[0].faces) > 400
    assert np.ptp(thread[0].vertices[:, 1]) > 1.2


def test_a_car_costs_few_triangles_more_than_its_pad():
    """A bare pad is 19,000; all else before the driver is as much again."""
    assert sum(len(mesh.faces) for _, mesh in made()) < 43_000


def test_wipers_are_left_out_where_moving_ones_are_drawn():
    """Two arms, two blades and two knobs lie at the windscreen's foot, and nothing else goes."""
    with_wipers, without = made(), made(wipers=False)
    at_rest = [mesh for material, mesh in with_wipers if material == "trim"]
    others = {mesh.vertices.tobytes() for _, mesh in without}
    gone = [mesh for mesh in at_rest if mesh.vertices.tobytes() not in others]
    assert len(gone) == len(with_wipers) - len(without) == 6
    assert all(abs(mesh.vertices[:, 0] - CAR["front"]).max() < 0.1 for mesh in gone)
