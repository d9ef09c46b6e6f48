"""A shot for cameras that go anywhere has detail around places and room for everyone."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from builders import view_at, write_scenario

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import LagrangianCamera
from sumo3dviz_pt.job.surroundings import WeatherSettings
from sumo3dviz_pt.library.vehicles.interior.controls import NEEDLE
from sumo3dviz_pt.pipeline.live import Ground
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.picking import build_roam, camera_view, with_traffic
from sumo3dviz_pt.world.build import World

RIDE = LagrangianCamera(mode="lagrangian", vehicle="v1", view="driver")


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    job = load_job(write_scenario(tmp_path_factory.mktemp("roam"), vehicles=6, persons=2))
    ground = Ground.of(job)
    times = (ground.begin, ground.end)
    shot = build_roam(World.of(ground.scenario, job), ground.trajectories, times=times)
    return job, ground, times, shot


def needed(movers):
    return Counter(mover.prototype for mover in movers)


@pytest.mark.parametrize("heading", [0.0, 90.0, 180.0, 270.0])
@pytest.mark.parametrize(
    "away", [(0.0, 0.0, 0.0), (40.0, -60.0, 3.0), (0.0, 0.0, 500.0), (9e3, 0, 0)]
)
def test_no_view_asks_for_more_than_there_is(opened, away, heading):
    _, _, times, shot = opened
    home = shot.camera.view_at(times[0]).position
    for time in np.linspace(*times, 5):
        frame = shot.frame_of(float(time), view_at(tuple(home + np.array(away)), heading=heading))
        assert needed(frame.movers) <= Counter(shot.data.slots.near)
        assert needed(frame.deforming) <= Counter(shot.data.slots.deforming)
        assert needed(frame.far) <= Counter(shot.data.slots.far)


def test_everyone_in_view_is_drawn(opened):
    _, _, times, shot = opened
    time = (times[0] + times[1]) / 2.0
    home = shot.camera.view_at(time).position
    seen = set()
    for heading in range(0, 360, 60):
        seen |= shot.frame_of(time, view_at(tuple(home), heading=heading)).users
    present = {shot.fleet.keys[k] for k in shot.present_at(time).users.tolist()}
    assert seen == present and len(present) >= 6


def test_its_own_camera_is_the_first_of_the_scene(opened):
    job, _, times, shot = opened
    first = next(iter(job.cameras.values()))
    view = camera_view(shot, first, times[0], left_hand=False)
    np.testing.assert_array_equal(
        shot.camera.view_at(times[0]).world_from_camera.matrix, view.world_from_camera.matrix
    )


def test_cabins_of_riding_cameras_can_be_opened(opened):
    job, ground, times, shot = opened
    made = build_roam(
        World.of(ground.scenario, job), ground.trajectories, times=times, riding=[RIDE]
    )
    key = "vehicle:v1"
    assert key not in shot.fleet.cockpits and key in made.fleet.cockpits
    name = made.fleet.cockpits[key].body.name
    assert made.data.slots.near[name] == 1 and made.data.slots.near[NEEDLE] == 2
    begin = ground.trajectories[1].pieces[0].begin
    view = camera_view(made, RIDE, begin, left_hand=False)
    assert view.cutaway and name in needed(made.frame_of(begin, view).movers)


def test_who_rides_with_nobody_hears_so(opened):
    _, _, times, shot = opened
    nobody = LagrangianCamera(mode="lagrangian", vehicle="v77", view="chase")
    with pytest.raises(ConfigError, match="v77"):
        camera_view(shot, nobody, times[0], left_hand=False)


def test_a_scene_without_cameras_is_seen_from_above(tmp_path):
    job = load_job(write_scenario(tmp_path, vehicles=2)).model_copy(update={"cameras": {}})
    ground = Ground.of(job)
    times = (ground.begin, ground.end)
    shot = build_roam(World.of(ground.scenario, job), ground.trajectories, times=times)
    view = shot.camera.view_at(times[0])
    lanes = np.concatenate([lane.shape for lane in ground.scenario.network.lanes.values()])
    assert view.position[2] > lanes[:, 2].max() + 10.0 and view.forward[2] < -0.2
    low, high = lanes[:, :2].min(axis=0) - 80.0, lanes[:, :2].max(axis=0) + 80.0
    assert ((low < view.position[:2]) & (view.position[:2] < high)).all()


def test_who_was_planned_far_away_is_a_stand_in_near_by(opened):
    """Built around a place 7 km off there are no bodies in detail, and still everyone is drawn."""
    job, ground, times, shot = opened
    eyes = shot.camera.view_at(times[0]).position + np.array([[5e3, 5e3, 50.0]])
    made = build_roam(World.of(ground.scenario, job), ground.trajectories, times=times, eyes=eyes)
    time = (times[0] + times[1]) / 2.0
    frame = made.frame_of(time, shot.camera.view_at(time))
    opened = {name for cockpit in made.fleet.cockpits.values() for name in cockpit.names}
    assert set(made.data.slots.near) <= opened
    assert not frame.movers and frame.far
    assert frame.users == shot.frame_of(time, shot.camera.view_at(time)).users


@pytest.mark.slow
def test_rides_in_rain_have_no_wipers_at_rest_beside_those_that_move(opened):
    job, ground, times, _ = opened
    parts = {}
    for name, weather in (
        ("dry", {"wetness": 0.5}),
        ("rain", {"rain": {"rate": "5 mm/h"}}),
        ("no pane", {"rain": {"rate": "5 mm/h"}, "windscreen": False}),
    ):
        wet = job.model_copy(update={"weather": WeatherSettings.model_validate(weather)})
        made = build_roam(
            World.of(ground.scenario, wet), ground.trajectories, times=times, riding=[RIDE]
        )
        parts[name] = len(made.data.prototypes[made.fleet.cockpits["vehicle:v1"].body.name].parts)
    assert parts["dry"] == parts["no pane"] == parts["rain"] + 6


def test_a_window_of_traffic_is_shown_by_a_shot_that_was_built_for_another(opened):
    job, ground, times, shot = opened
    world, frames = World.of(ground.scenario, job), np.arange(*times, 0.5)
    carried = with_traffic(shot, world, ground.trajectories, frames=frames)
    assert carried is not None and carried.data is shot.data
    view = shot.camera.view_at(times[0])
    for time in times:
        own, other = (each.frame_of(time, view) for each in (shot, carried))
        assert own.users == other.users and len(own.users) > 1
        places = ([m.world_from_body.matrix for m in (*f.movers, *f.far)] for f in (own, other))
        np.testing.assert_array_equal(*places)
        np.testing.assert_equal(own.lamps, other.lamps)


@pytest.mark.slow
def test_a_shot_says_when_it_lacks_room_and_a_growing_one_has_some(opened):
    job, ground, times, shot = opened
    world, frames = World.of(ground.scenario, job), np.arange(*times, 0.5)
    more = [replace(each, id=f"{each.id}.{k}") for each in ground.trajectories for k in range(5)]
    assert with_traffic(shot, world, more, frames=frames) is None
    roomy = build_roam(world, ground.trajectories, times=times, growing=True)
    assert with_traffic(roomy, world, more, frames=frames) is not None
    # Who is not there cannot be ridden with, which is no fault of a scene that only begins.
    gone = ground.trajectories[:1]
    riding = [RIDE.model_copy(update={"vehicle": "nobody"})]
    assert build_roam(world, gone, times=times, riding=riding, growing=True).fleet.keys
    with pytest.raises(ConfigError, match="nobody"):
        build_roam(world, gone, times=times, riding=riding)
