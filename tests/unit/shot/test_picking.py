"""Who is seen at a point of a picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from analytic_motion import PathPiece
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot.cameras.aiming import aim_at
from sumo3dviz_pt.shot.picking import pick

TYPES = {
    kind.id: kind
    for kind in (
        VehicleType("car", "passenger", 4.6, 1.8, 1.47),
        VehicleType("bus", "bus", 18.0, 2.55, 3.05, "bus/flexible"),
        VehicleType("ped", "pedestrian", 0.215, 0.478, 1.719),
    )
}
TIME = 1.0
ASPECT = 9 / 16
MIDDLE = (0.5, 0.5)
HIGH = np.array([0.0, 0.0, 40.0])


class Parked(PathPiece):
    """Somebody who stands at a point."""

    def __init__(self, x, y, *, yaw=0.0):
        super().__init__(speed=0.0, yaw=yaw)
        object.__setattr__(self, "at", np.array([x, y, 0.0]))

    def point(self, ways):
        return super().point(ways) + self.at


def fleet_of(**users):
    """Road users by name: a type and a piece of motion."""
    made = [
        Trajectory(name, "person" if kind == "ped" else "vehicle", kind, (piece,))
        for name, (kind, piece) in users.items()
    ]
    return build_fleet(made, TYPES, VehicleSettings(), seed=0)


def eye_at(position, target, *, fov=60.0):
    position, target = np.array(position, dtype=float), np.array(target, dtype=float)
    return View(aim_at(target - position).placed(position), Lens.of_degrees(fov))


def picked(fleet, view, point=MIDDLE, **more):
    return pick(fleet.presence.at(TIME), fleet, view, point, aspect=ASPECT, **more)


ROW = fleet_of(
    near=("car", Parked(0, 0)), behind=("car", Parked(20, 0)), walker=("ped", Parked(0, 12))
)
REAR = eye_at((-30, 0, 1.0), (0, 0, 1.0))


def test_the_nearest_is_found():
    assert picked(ROW, REAR) == "vehicle:near"
    assert picked(ROW, eye_at((50, 0, 1), (0, 0, 1))) == "vehicle:behind"
    assert picked(ROW, eye_at((-2, -20, 8), (-2, 0, 0.5))) == "vehicle:near"


def test_beside_everybody_is_nobody():
    assert picked(ROW, eye_at((-30, 0, 1), (-30, 50, 1))) is None
    assert picked(ROW, eye_at((-30, 0, 1), (-60, 0, 1))) is None
    assert picked(ROW, REAR, (0.5, 0.0)) is None
    assert picked(fleet_of(), REAR) is None


def test_points_count_from_the_left_and_the_top():
    eye = eye_at((-30, 6, 1.0), (0, 6, 1.0))
    half = np.tan(np.radians(30))
    right = 0.5 + 6 / 30 / half / 2
    assert picked(ROW, eye, (right, 0.5)) == "vehicle:near"
    assert picked(ROW, eye, (1 - right, 0.5)) == "person:walker"
    assert picked(ROW, eye, (right, 0.9)) is None


@settings(max_examples=tries(60), deadline=None)
@given(
    st.floats(-0.95, 0.95),
    st.floats(-0.95, 0.95),
    st.floats(-3, 3),
    st.floats(3, 60),
    st.floats(0, 6.3),
)
def test_a_point_of_a_body_is_found_where_the_picture_shows_it(along, across, yaw, away, around):
    fleet = fleet_of(a=("car", Parked(3, -7, yaw=yaw)))
    length, width, height = fleet.bodies[0].size
    local = np.array([-length / 2 * (1 + along), width / 2 * across])
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    point = np.array([*(turn @ local + [3, -7]), height / 2])
    aside = np.array([8 * np.cos(around), 8 * np.sin(around), away])
    view = eye_at(point + aside, (0, 0, 0), fov=150)
    ahead, left, up = (point - view.position) @ view.world_from_camera.matrix[:3, :3]
    if ahead <= 0.05:
        return
    half = view.lens.half_width
    at = (0.5 - left / ahead / half / 2, 0.5 - up / ahead / half / ASPECT / 2)
    assert picked(fleet, view, at) == "vehicle:a"


def test_nobody_behind_a_surface_is_found():
    near = 30.0 - ROW.bodies[0].size[0]
    assert picked(ROW, REAR, distance=near) == "vehicle:near"
    assert picked(ROW, REAR, distance=near - 0.2) == "vehicle:near"
    assert picked(ROW, REAR, distance=near - 2.0) is None
    assert picked(ROW, REAR, distance=5.0) is None


def test_a_surface_tells_whose_it_is():
    """Past the near one's roof, within its box, the far one is what is seen."""
    far = 50.0 - ROW.bodies[1].size[0]
    assert picked(ROW, REAR, distance=far) == "vehicle:behind"
    assert picked(ROW, REAR, distance=far + 30.0) == "vehicle:near"


def test_walkers_can_be_clicked_from_afar_and_hide_nobody():
    eye = eye_at((0, -80, 1.7), (-0.1, 12, 1.0))
    assert picked(fleet_of(walker=("ped", Parked(0, 12))), eye) == "person:walker"
    aside = eye_at((0, -80, 1.7), (1.2, 12, 1.0))
    assert picked(fleet_of(walker=("ped", Parked(0, 12))), aside) == "person:walker"
    both = fleet_of(walker=("ped", Parked(0, 12)), car=("car", Parked(4, 20)))
    assert picked(both, aside) == "vehicle:car"
    assert picked(both, eye_at((-0.1, -80, 1.7), (-0.1, 12, 1.0))) == "person:walker"


def test_mirrors_belong_to_their_vehicle():
    car = fleet_of(a=("car", Parked(0, 0)))
    out = car.bodies[0].size[1] / 2 + 0.15
    assert picked(car, eye_at((-20, out, 1), (0, out, 1)), distance=18.5) == "vehicle:a"
    assert picked(car, eye_at((-20, out + 0.3, 1), (0, out + 0.3, 1)), distance=18.5) is None


def test_the_vehicle_around_the_eye_is_not_found():
    inside = eye_at((-2, 0, 1.2), (30, 0, 1.2))
    assert picked(ROW, inside) == "vehicle:behind"
    assert picked(fleet_of(own=("car", Parked(0, 0))), inside) is None


def test_buses_are_found_where_they_bend():
    bend = PathPiece(speed=6.0, curvature=1 / 15.0, start=100.0, length=18.0)
    fleet = fleet_of(bus=("bus", bend))
    trail = bend.trail(np.array([TIME]), np.array([1.0, 16.0]))[0]
    for point in trail:
        assert picked(fleet, eye_at(point + HIGH, point, fov=20)) == "vehicle:bus"
    present = fleet.presence.at(TIME)
    yaw, front = present.yaws[0], present.positions[0]
    straight = front - 9.0 * np.array([np.cos(yaw), np.sin(yaw), 0])
    outside = straight - 3.0 * np.array([np.sin(yaw), -np.cos(yaw), 0])
    assert picked(fleet, eye_at(outside + HIGH, outside, fov=5)) is None


def test_who_is_not_there_is_not_found():
    gone = fleet_of(a=("car", replace(PathPiece(speed=0.0), end=0.5)))
    assert picked(gone, REAR) is None
