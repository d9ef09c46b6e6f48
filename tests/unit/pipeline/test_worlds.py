"""One world for all shots: what was built for one serves the next, and changes nothing."""

import os

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.files.values import packed
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.pipeline import worlds
from sumo3dviz_pt.pipeline.accounts import plan_digest, world_digest
from sumo3dviz_pt.pipeline.production import Request, example, prepare, read, scenario_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.worlds import world_of
from sumo3dviz_pt.world import cache
from sumo3dviz_pt.world.build import build_place
from sumo3dviz_pt.world.roads.wear import details

TIMES = np.array([5.0, 5.5])


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("worlds"), vehicles=5, signals=True, trees=True)


@pytest.fixture(autouse=True)
def _nothing_remembered():
    worlds._memory_of.cache_clear()


def world(scene, **changes):
    job = load_job(scene, {key.replace("__", "."): value for key, value in changes.items()})
    _, scenario, _ = read(job, begin=5.0, end=5.5)
    return world_of(scenario, job, scenario_files(job))


FAR = {"mode": "eulerian", "position": [40, 60, 9], "look_at": [0, 0, 0]}
CAMERAS = {"far": {**FAR, "clear_view": False}}


SAME_PLACE = pytest.mark.parametrize(
    "changes",
    [
        {"cameras": CAMERAS},
        {"shots": [{"camera": "post", "from": 5, "to": 6}]},
        {"output__size": [64, 36]},
        {"quality": "draft"},
        {"vehicles__colours": "sumo"},
        {"sky__preset": "sky_overcast"},
        {"sky__sun": {"azimuth": 250, "elevation": 12}},
        {"lights": "off"},
        {"weather__preset": "rain"},
        {"traffic": {"leave_out": ["veh0"]}},
    ],
    ids=lambda changes: next(iter(changes)),
)


@SAME_PLACE
def test_cameras_shots_sizes_light_and_traffic_share_a_world(scene, changes):
    assert world(scene).memory is world(scene, **changes).memory
    assert world(scene).key == world(scene, **changes).key


@SAME_PLACE
def test_what_shares_a_world_stands_alike_in_it(scene, changes):
    path = CameraPath(np.array([[0.0, -30.0, 9.0]]), np.array([[0.0, 1.0, -0.2]]), np.array([0.6]))

    def place(**changes):
        worlds._memory_of.cache_clear()
        return packed(build_place(world(scene, **changes), path), cache._KINDS)

    assert place() == place(**changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"seed": 8},
        {"roads__surface": "concrete"},
        {"lights": "on"},
        {"template": "city_night"},
        {"cameras": {"far": FAR}},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_another_world_begins_with_nothing(scene, changes):
    assert world(scene).memory is not world(scene, **changes).memory


@pytest.mark.parametrize("name", ["net.net.xml", "tls.xml", "trees.add.xml"])
def test_a_changed_file_is_another_world(scene, name):
    first = world(scene).memory
    stat = (scene.parent / name).stat()
    os.utime(scene.parent / name, ns=(stat.st_atime_ns, stat.st_mtime_ns + 1_000_000))
    assert world(scene).memory is not first


def built(scene, camera):
    """Digests of a shot's world and plan."""
    shot = prepare(load_job(scene, {"template": "city_day"}), Request(camera=camera), TIMES).shot
    return world_digest(shot.data), plan_digest(shot.data, shot.full_models)


@pytest.mark.slow
@pytest.mark.parametrize("camera", ["flight", "driver"])
def test_what_was_built_for_another_shot_changes_nothing(camera):
    job, times = load_job(example("crossing")), np.array([460.0, 461.0])

    def digests(name):
        shot = prepare(job, Request(camera=name), times).shot
        return world_digest(shot.data), plan_digest(shot.data, shot.full_models)

    digests("corner")
    after = digests(camera)
    worlds._memory_of.cache_clear()
    assert digests(camera) == after


@pytest.mark.slow
def test_a_repair_is_laid_once_for_all_shots(scene, monkeypatch):
    laid = []
    make = details._detail

    def laying(place, kind):
        laid.append(place.name)
        return make(place, kind)

    monkeypatch.setattr(details, "_detail", laying)
    for camera in ("post", "driver", "post"):
        built(scene, camera)
    assert laid and len(set(laid)) == len(laid)
