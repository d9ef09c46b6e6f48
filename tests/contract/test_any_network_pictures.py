"""Every third network with all that our code adds, and a picture of one of its cameras.

Building and rendering all of them would take a quarter of an hour. Which camera is rendered goes
round by the network's number.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from any_network.known import expect
from any_network.laws import before_camera, blocked_ways, standing_on_roads
from any_network.paving import ground_over_paving, paved_twice
from any_network.programs import why_missing
from any_network.proposed import (
    Plants,
    Pose,
    badly_placed,
    filled,
    furnished,
    lonely,
    planted,
    poses_of,
)
from any_network.shared import unshared
from any_network.towns import PICTURED, Town, made_town, name_of
from needed import skip_if

from sumo3dviz_pt.job.settings import Job, default
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.pipeline.live import OpenShot
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.world.placement.lanes import build_lane_index

SIZE = (96, 54)

pytestmark = [
    pytest.mark.slow,
    skip_if(bool(why_missing()), why_missing() or "SUMO is here"),
]


@dataclass(frozen=True, slots=True, eq=False)
class Built:
    """A town with all that stands around its proposed overview.

    Attributes:
        town: The town.
        job: The scene file that `init` writes.
        time: In the middle of the proposed shots [s].
        static: What does not move.
    """

    town: Town
    job: Job
    time: float
    static: tuple[StaticPart, ...]


@pytest.fixture(scope="module", params=PICTURED, ids=name_of)
def built(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Built]:
    town = made_town(request.param, tmp_path_factory.mktemp("towns"))
    job = town.job(default("template"))
    time = 0.5 * (job.shots[0].start + job.shots[0].end)
    made = prepare(job, Request(camera="overview"), np.array([time]))
    static = (*made.shot.data.static, *unshared(made.shot.stands))
    yield Built(town, job, time, static)


def test_nothing_stands_where_vehicles_drive(built, request):
    expect(request, "standing_on_roads", built.town.number)
    faults = list(standing_on_roads(built.town.drawn, built.static))
    faults += blocked_ways(built.town.drawn, built.static)
    assert not faults, "\n".join(faults[:20])


def test_paving_beside_roads_lies_on_top_and_alone(built):
    faults = [*ground_over_paving(built.static, step=0.9), *paved_twice(built.static)]
    assert not faults, "\n".join(faults)


def test_nothing_stands_before_the_proposed_camera(built, request):
    expect(request, "before_camera", built.town.number)
    camera = built.job.cameras["overview"]
    eye, target = np.array(camera.position), np.array(camera.look_at)
    faults = list(before_camera(eye, target, built.static))
    assert not faults, "\n".join(faults[:20])


def test_eyes_of_proposed_cameras_are_in_the_open(built, request):
    expect(request, "badly_placed", built.town.number)
    faults = [
        f"{name}: {fault}"
        for name, pose in _poses(built)
        for law in (badly_placed, filled, furnished)
        for fault in law(pose, built.static)
    ]
    lanes, plants = build_lane_index(built.town.scenario.network), Plants.among(built.static)
    faults += [
        f"{name}: {fault}" for name, pose in _poses(built) for fault in planted(pose, plants, lanes)
    ]
    assert not faults, "\n".join(faults[:20])


def test_somebody_is_in_view_of_a_proposed_camera(built, request):
    expect(request, "lonely", built.town.number)
    span = (built.job.shots[0].start, built.job.shots[0].end)
    faults = [
        f"{name}: {fault}"
        for name in ("overview", "corner", "flight")
        if name in built.job.cameras
        for fault in lonely(poses_of(built.job.cameras[name]), span, built.town.scenario)
    ]
    assert not faults, "\n".join(faults[:20])


def _poses(built: Built) -> Iterator[tuple[str, Pose]]:
    """Poses of all proposed cameras that ride in no vehicle."""
    for name, camera in built.job.cameras.items():
        yield from ((name, pose) for pose in poses_of(camera))


def test_a_proposed_camera_takes_a_picture(built, request):
    expect(request, "picture", built.town.number)
    names = sorted(built.job.cameras)
    name = names[PICTURED.index(built.town.number) % len(names)]
    asked = Request(camera=name, size=SIZE, quality="draft", variant="scalar")
    with OpenShot(prepare(built.job, asked, np.array([built.time]))) as shot:
        still = shot.still(built.time)
    assert np.isfinite(still.radiance).all()
    picture = still.develop()
    assert 8.0 < picture.mean() < 247.0 and picture.std() > 4.0
