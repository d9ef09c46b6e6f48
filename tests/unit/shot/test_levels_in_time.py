"""What a film shows of somebody from frame to frame: which level of detail, who they are."""

from __future__ import annotations

import numpy as np
import pytest
from builders import view_at
from PIL import Image as Pillow
from PIL import ImageDraw

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.fitting import read_vehicle
from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.library.mesh.shading import clustered_body
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.traffic import Trace, VehicleType
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.shot.crowd import FULL_END, MOST_NEAR, NEAR_END, choose

EYE = (0.0, 0.0, 1.5)
ALL = np.ones(1, dtype=bool)
TYPES = {
    kind.id: kind
    for kind in (
        VehicleType("car", "passenger", 5.0, 1.8, 1.5),
        VehicleType("bus", "bus", 12.0, 2.5, 3.4),
        VehicleType("ped", "pedestrian", 0.215, 0.478, 1.719),
    )
}


def levels_of(places, *, fov=50.0):
    """The level at each of the places, (n, 3), of one car before a camera that looks east."""
    places = np.asarray(places, dtype=float)[None]
    camera_path = CameraPath.of(
        [view_at(EYE, heading=90.0, fov=fov)] * places.shape[1], aspect=9 / 16
    )
    alive = np.ones(places.shape[:2], dtype=bool)
    choice = choose(camera_path, alive, places, limit=MOST_NEAR, can_be_full=ALL)
    codes = choice.near[0] + 2 * choice.far[0] + 3 * choice.full[0]
    return ["-nfh"[code] for code in codes]


def ahead(distances):
    distances = np.asarray(distances, dtype=float)
    return np.column_stack([distances, 0 * distances, 0 * distances])


def switch(distances, levels, before):
    """Where somebody who drives away leaves a level, which they enter but once."""
    text = "".join(levels)
    assert text == "h" * text.count("h") + "n" * text.count("n") + "f" * text.count("f")
    return distances[text.rindex(before)]


def test_who_drives_away_changes_level_twice():
    distances = np.arange(5.0, 400.0, 0.31)
    levels = levels_of(ahead(distances))
    assert switch(distances, levels, "h") == pytest.approx(FULL_END, abs=0.5)
    assert switch(distances, levels, "n") == pytest.approx(NEAR_END, abs=0.5)


@pytest.mark.parametrize("fov", [12.0, 25.0, 50.0])
def test_levels_change_where_bodies_are_as_large_through_any_lens(fov):
    """A telephoto lens would show a stand-in across half the picture."""
    distances = np.geomspace(5.0, 1800.0, 4000)
    levels = levels_of(ahead(distances), fov=fov)
    larger = np.tan(np.radians(25.0)) / np.tan(np.radians(fov / 2.0))
    assert switch(distances, levels, "n") == pytest.approx(NEAR_END * larger, rel=0.01)
    far = min(FULL_END * larger, 120.0)
    assert switch(distances, levels, "h") == pytest.approx(far, rel=0.01)


@pytest.mark.parametrize("side", [-3.5, 3.5])
def test_who_overtakes_changes_before_they_come_into_the_picture(side):
    """From behind to 30 m ahead, a body reaches 5 m back from its front."""
    along = np.arange(-40.0, 30.0, 0.25)
    places = np.column_stack([along, np.full(len(along), side), 0 * along])
    levels = levels_of(places)
    half = np.tan(np.radians(25.0))
    shown = [side**2 < (half * x) ** 2 and x > 0 for x in along]
    assert {level for level, seen in zip(levels, shown, strict=True) if seen} == {"h"}
    assert levels[0] == "n", "who cannot be seen needs no full detail"
    assert "".join(levels).count("nh") == 1


def trajectory_of(name, kind, type_id, *, begin=0.0, count=6):
    times, none = begin + np.arange(count), np.full(count, -1)
    places = np.column_stack([4.0 * times, 0 * times, 0 * times])
    ones = np.ones(count)
    trace = Trace(name, kind, type_id, times, places, 0 * ones, 4 * ones, 0 * ones, none, none)
    return smooth(trace, smoother="paper_symmetric", step=1.0)


def looks_at(trajectories, time):
    fleet = build_fleet(trajectories, TYPES, VehicleSettings(), seed=7)
    return {m.id: (m.prototype, m.colour) for m in fleet.movers_at(time)}


def test_who_somebody_is_depends_on_no_shot():
    """Other neighbours, another order, another window, another time: the same body and paint."""
    users = [("car", "vehicle", f"car.{k}") for k in range(10)]
    users += [("bus", "vehicle", f"bus.{k}") for k in range(2)]
    users += [("ped", "person", f"ped.{k}") for k in range(2)]
    whole = [trajectory_of(name, kind, type_id) for type_id, kind, name in users]
    some = [trajectory_of(n, k, t, begin=2.0, count=3) for t, k, n in users[::-3]]
    known = looks_at(whole, 1.0)
    assert known == looks_at(whole[::-1], 4.9)
    again = looks_at(some, 3.5)
    assert len(again) == len(some) and again == {key: known[key] for key in again}
    assert len(set(known.values())) > 8


def outline(meshes, *, across, low, shape, pixel):
    """What a body covers seen from its side (0) or from behind (1)."""
    picture = Pillow.new("1", shape)
    draw = ImageDraw.Draw(picture)
    for mesh in meshes:
        corners = mesh.vertices[mesh.faces][..., [across, 2]]
        for corner in ((corners - low) / pixel).round(3):
            draw.polygon([tuple(point) for point in corner], fill=1)
    return np.asarray(picture)


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("city_car", 0.10),
        ("sedan", 0.09),
        ("estate", 0.09),
        ("delivery_van", 0.07),
        ("city_bus", 0.05),
        ("rigid_truck", 0.06),
    ],
)
@pytest.mark.parametrize("cell", [None, 0.18, 0.35])
def test_stand_ins_have_the_outline_of_bodies(name, most, cell):
    """Where a body becomes its stand-in it is 20 pixels long: a tenth is less than one each way."""
    body = read_vehicle(catalog.find("vehicles", name))
    near, far = ([part.mesh for part in parts] for parts in (body.parts, body.far))
    far = far if cell is None else clustered_body(far, cell)
    assert sum(len(mesh.faces) for mesh in far) < 2000
    points = np.concatenate([mesh.vertices for mesh in near])
    for across in (0, 1):
        low = points[:, [across, 2]].min(axis=0) - 0.3
        shape = np.ceil((points[:, [across, 2]].max(axis=0) + 0.3 - low) / 0.03).astype(int)
        one, other = (
            outline(meshes, across=across, low=low, shape=tuple(shape), pixel=0.03)
            for meshes in (near, far)
        )
        limit = 0.05 if cell is None else most
        assert (one ^ other).sum() < limit * one.sum()
