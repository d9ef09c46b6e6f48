"""Those whose motion is left out of a shot are never drawn in it."""

from functools import partial

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import LagrangianCamera
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.motion import LogMotion
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.worlds import world_of
from sumo3dviz_pt.shot import crowd
from sumo3dviz_pt.shot.build import moments_of
from sumo3dviz_pt.shot.cameras.aiming import build_camera
from sumo3dviz_pt.shot.road_users import everyone, users_in_view, with_seat


@pytest.fixture(scope="module", params=["crossing", "ronda"])
def read(request):
    job = load_job(example(request.param))
    shot = job.shots[0]
    times = np.arange(shot.start, shot.start + 4.0, 0.2)
    files, scenario = read_files(job, begin=times[0], end=times[-1])
    return job, times, world_of(scenario, job, files), motion_of(job, scenario)


def test_nobody_who_is_drawn_is_left_out(read):
    job, times, world, motion = read
    trajectories = motion.smooth()
    for camera in job.cameras.values():
        seat = partial(with_seat, camera=camera, world=world)
        fleet = seat(everyone(world, trajectories))
        built = build_camera(camera, fleet=fleet, left_hand=world.left_hand)
        moments = moments_of(built, times)
        path = CameraPath.of([built.view_at(each) for each in moments.tolist()], aspect=9 / 16)
        alive, positions = fleet.positions(moments)
        drawn = crowd.choose(path, alive, positions, limit=120, lengths=fleet.lengths)
        shown = (drawn.near | drawn.far).any(axis=1)

        name = camera.vehicle if isinstance(camera, LagrangianCamera) else ""
        riders = motion.smooth(motion.named(name))
        seen = users_in_view(world, riders, camera=camera, times=times)

        assert not (shown & ~seen).any()
        assert shown.any()


def test_a_driver_does_not_see_everybody(read):
    job, times, world, motion = read
    camera = next(each for each in job.cameras.values() if isinstance(each, LagrangianCamera))
    riders = motion.smooth(motion.named(camera.vehicle))
    seen = users_in_view(world, riders, camera=camera, times=times)
    assert 0 < seen.sum() < len(seen)


def test_some_are_smoothed_as_all_are(read):
    _, times, _, motion = read
    which = np.arange(len(motion.ids)) % 3 == 1
    everybody = motion.smooth()
    for one, k in zip(motion.smooth(which), np.flatnonzero(which), strict=True):
        other = everybody[int(k)]
        assert one.key == other.key
        moved, same = one.sample(times), other.sample(times)
        assert np.array_equal(moved.alive, same.alive)
        assert np.array_equal(moved.positions, same.positions, equal_nan=True)


def test_a_name_or_a_key_finds_a_road_user(read):
    motion: LogMotion = read[3]
    name, trace = motion.ids[0], motion.log.traces[0]
    assert motion.named(name)[0]
    assert motion.named(f"{trace.kind}:{name}").sum() == 1
    assert not motion.named("").any()
