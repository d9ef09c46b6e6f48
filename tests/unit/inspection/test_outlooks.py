"""Shots near each other share a place when they are reported on, and each has its part of it."""

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.inspection.checks import Outing, check_scene, outlooks
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.progress import heard_by
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.pipeline.reading import motion_of, read_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.steps import WorkCourse, checking_steps
from sumo3dviz_pt.world.outlook import seen_of

CAMERAS = """
  near: {mode: eulerian, position: [10, -12, 6], look_at: [40, 0, 1]}
  away: {mode: eulerian, position: [4000, 0, 8], look_at: [4040, 0, 1]}
"""
NAMES = ("post", "near", "away")


@pytest.fixture
def job(tmp_path):
    scene = write_scenario(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("cameras:\n", f"cameras:{CAMERAS}", 1)
    scene.write_text(text, encoding="utf-8")
    return load_job(scene)


def test_shots_near_each_other_share_a_place(job):
    files, scenario = read_files(job)
    motion = motion_of(job, scenario)
    times = np.array([4.0, 4.5])
    post, near, away = outlooks(job, files, scenario, motion, [Outing(n, times) for n in NAMES])
    assert post is near and post is not None and len(post.camera_path.positions) == 4
    assert away is None
    assert outlooks(job, files, scenario, motion, [Outing("post", times)]) == [None]


def test_a_shared_place_counts_about_as_much_as_a_shots_own(job):
    shots = [shot.model_copy(update={"camera": name}) for shot in job.shots for name in NAMES[:2]]
    together = check_scene(job.model_copy(update={"shots": tuple(shots)}), presets=["draft"])
    for said in together["shots"]:
        alone = [shot for shot in shots if shot.camera == said["camera"]]
        own = check_scene(job.model_copy(update={"shots": tuple(alone)}), presets=["draft"])
        expected = own["shots"][0]["triangles"]["total"]
        assert said["triangles"]["total"] == pytest.approx(expected, rel=0.25)
        assert said["about"] and not own["shots"][0]["about"]


def test_what_a_report_announces_are_the_steps_that_were_expected(job):
    """Else the time left would stand still, or count what is over."""
    shots = tuple(job.shots[0].model_copy(update={"camera": name}) for name in NAMES)
    job = job.model_copy(update={"shots": shots})
    steps = checking_steps(job)
    course, seconds = WorkCourse(steps, 0.0), []

    def hear(event):
        course.hear(event, 0.0)
        seconds.append(course.seconds_left(0.0))

    with heard_by(hear):
        check_scene(job, presets=["draft"])
    assert seconds[0] == pytest.approx(sum(step.seconds for step in steps))
    assert sorted(seconds, reverse=True) == seconds
    assert seconds[-1] <= steps[-1].seconds


def test_a_camera_has_the_faces_in_squares_that_it_sees():
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    spots = np.array([[200.0, 0.0, 0.0], [-200.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    vertices = (spots[:, None] + triangle).reshape(-1, 3)
    mesh = Mesh(vertices, np.arange(9), things=(("a", 1), ("b", 1), ("c", 1)))
    tint = np.array([[0.1] * 3, [0.2] * 3, [0.3] * 3])
    parts = [StaticPart(f"{f}/x", f, Part(mesh, "x", tint)) for f in ("trees", "roads")]
    way = CameraPath(np.array([[0.0, 0.0, 5.0]]), np.array([[1.0, 0.0, 0.0]]), np.array([0.5]))
    trees, roads = seen_of(parts, way, lanes=10)
    assert trees.part.mesh.things == (("a", 1), ("c", 1)) and len(trees.part.mesh.faces) == 2
    assert trees.part.tint[:, 0].tolist() == [0.1, 0.3]
    assert len(roads.part.mesh.faces) == 3, "of a small network each camera has all roads"


def test_paths_are_joined_with_what_only_some_have():
    one = CameraPath(np.zeros((2, 3)), np.tile([1.0, 0, 0], (2, 1)), np.full(2, 0.5))
    two = CameraPath(np.ones((1, 3)), np.array([[0.0, 1.0, 0.0]]), np.full(1, 0.4), np.array([7.0]))
    both = CameraPath.joined([one, two])
    assert len(both.positions) == 3 and both.behind is None
    assert both.parallel.tolist() == [0.0, 0.0, 7.0]
