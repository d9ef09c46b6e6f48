"""Nobody whom a camera can see is dropped, whatever the crowd."""

import numpy as np
import pytest
from builders import view_at
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.cast.drawing import Drawn
from sumo3dviz_pt.model.camera import AROUND, CameraPath, in_view
from sumo3dviz_pt.shot import crowd
from sumo3dviz_pt.shot.crowd import CrowdFrames, can_be_full, choose, chunks, plan_crowd

ASPECT = 9 / 16
SEEDS = st.integers(0, 2**32 - 1)


def views_of(rng, count):
    return [
        view_at(
            rng.uniform(-200, 200, 3) * [1, 1, 0.1] + [0, 0, 21],
            heading=rng.uniform(0, 360),
            pitch=rng.uniform(-60, 30),
            fov=rng.uniform(20, 120),
        )
        for _ in range(count)
    ]


def crowd_of(rng, people, count, spread=2000.0):
    positions = rng.normal(0, spread, (people, count, 3)) * [1, 1, 0]
    alive = rng.random((people, count)) < 0.8
    return alive, np.where(alive[..., None], positions, np.nan)


def in_picture(view, points):
    """Which points project into the picture, by the pinhole's formula."""
    camera = (points - view.position) @ view.world_from_camera.matrix[:3, :3]
    ahead = camera[:, 0] > 1e-6
    with np.errstate(all="ignore"):
        x, y = camera[:, 1] / camera[:, 0], camera[:, 2] / camera[:, 0]
    half = view.lens.half_width
    return ahead & (np.abs(x) <= half) & (np.abs(y) <= half * ASPECT)


@given(SEEDS)
def test_whatever_projects_into_the_picture_is_in_view(seed):
    rng = np.random.default_rng(seed)
    views = views_of(rng, 4)
    points = rng.normal(0, 600, (200, 3)) * [1, 1, 0.1]
    found = in_view(CameraPath.of(views, aspect=ASPECT), points, radius=0.0)
    for column, view in enumerate(views):
        assert found[in_picture(view, points), column].all()


@given(SEEDS, st.floats(1, 80))
def test_every_point_of_a_seen_ball_counts(seed, radius):
    rng = np.random.default_rng(seed)
    views = views_of(rng, 3)
    centres = rng.normal(0, 600, (100, 3)) * [1, 1, 0.1]
    found = in_view(CameraPath.of(views, aspect=ASPECT), centres, radius=radius)
    offsets = rng.normal(size=(20, 3))
    offsets *= radius / np.linalg.norm(offsets, axis=1, keepdims=True)
    for column, view in enumerate(views):
        for offset in offsets:
            assert found[in_picture(view, centres + offset), column].all()


def test_most_of_what_lies_behind_is_not_in_view():
    rng = np.random.default_rng(0)
    view = view_at([0, 0, 10], heading=90)
    points = np.column_stack([-rng.uniform(300, 2000, 500), rng.normal(0, 300, 500), np.zeros(500)])
    assert not in_view(CameraPath.of([view], aspect=ASPECT), points, radius=40).any()


def test_near_things_count_even_behind():
    view = view_at([0, 0, 2], heading=90)
    points = np.array([[-AROUND + 1, 0, 2], [-AROUND - 5, 0, 2]])
    found = in_view(CameraPath.of([view], aspect=ASPECT), points, radius=0)
    np.testing.assert_array_equal(found[:, 0], [True, False])


def test_points_may_move():
    camera_path = CameraPath.of([view_at([0, 0, 2], heading=90)] * 2, aspect=ASPECT)
    moving = np.array([[[500.0, 0, 0], [-500.0, 0, 0]]])
    np.testing.assert_array_equal(in_view(camera_path, moving, radius=1), [[True, False]])


@given(SEEDS, st.integers(1, 40))
def test_nobody_visible_is_dropped_and_the_limit_holds(seed, limit):
    rng = np.random.default_rng(seed)
    views = views_of(rng, 5)
    camera_path = CameraPath.of(views, aspect=ASPECT)
    alive, positions = crowd_of(rng, 150, 5, spread=500.0)
    choice = choose(camera_path, alive, positions, limit=limit)
    assert not (choice.near & choice.far).any()
    shown = choice.near | choice.far
    assert not (shown & ~alive).any()
    assert (choice.near.sum(axis=0) <= limit).all()
    for column, view in enumerate(views):
        points = np.nan_to_num(positions[:, column], nan=1e9)
        distance = np.linalg.norm(points - view.position, axis=1)
        must = alive[:, column] & (distance < crowd.FAR_END) & in_picture(view, points)
        assert shown[must, column].all()
        end = crowd.near_end(camera_path)[column]
        assert (distance[choice.near[:, column]] < end).all()
        apart = choice.far[:, column] & (distance < end)
        if apart.any():
            assert choice.near[:, column].sum() == limit
            assert distance[choice.near[:, column]].max() <= distance[apart].min()


@given(SEEDS)
def test_frames_do_not_know_of_each_other(seed):
    """Law 1: a frame alone chooses as it does in a film, in any order."""
    rng = np.random.default_rng(seed)
    views = views_of(rng, 6)
    alive, positions = crowd_of(rng, 60, 6, spread=300.0)
    whole = choose(CameraPath.of(views, aspect=ASPECT), alive, positions, limit=7)
    for n in rng.permutation(6):
        camera_path = CameraPath.of([views[n]], aspect=ASPECT)
        alone = choose(camera_path, alive[:, [n]], positions[:, [n]], limit=7)
        np.testing.assert_array_equal(alone.near[:, 0], whole.near[:, n])
        np.testing.assert_array_equal(alone.far[:, 0], whole.far[:, n])


def body_of(kind):
    return Drawn(kind, (kind,), (kind,), (f"{kind}/full", *[f"{kind}/wheel"] * 4))


@pytest.mark.parametrize("people", [1, 150, 1500])
def test_slots_suffice_for_every_frame(people):
    rng = np.random.default_rng(people)
    kinds = [f"body{k}" for k in range(5)]
    bodies = [body_of(kinds[k]) for k in rng.integers(0, 5, people)]
    frames = []
    for _ in range(2):
        views = views_of(rng, 7)
        frames.append(
            CrowdFrames(
                CameraPath.of(views, aspect=ASPECT), *crowd_of(rng, people, 7, spread=250.0)
            )
        )
    plan = plan_crowd(bodies, frames)
    assert sum(plan.slots.near.values()) <= crowd.MOST_SLOTS
    assert 0 < plan.limit <= crowd.MOST_NEAR
    for camera_path, alive, positions in frames:
        for n in range(len(camera_path.positions)):
            part = slice(n, n + 1)
            able = can_be_full(bodies, plan.full_models)
            choice = choose(
                camera_path.slice(part),
                alive[:, part],
                positions[:, part],
                limit=plan.limit,
                can_be_full=able,
            )
            for kind in kinds:
                own = np.array([body.model == kind for body in bodies])
                full_models = choice.full[own].sum()
                assert choice.near[own].sum() <= plan.slots.near.get(kind, 0)
                assert choice.far[own].sum() <= plan.slots.far.get(kind, 0)
                assert full_models <= plan.slots.near.get(f"{kind}/full", 0)
                assert 4 * full_models <= plan.slots.near.get(f"{kind}/wheel", 0)
    backwards = plan_crowd(bodies, frames[::-1])
    assert backwards == plan


def test_the_limit_gives_way_where_bodies_are_many():
    """Different bodies in different frames add up to slots; then fewer are detailed."""
    kinds = [f"body{k}" for k in range(12)]
    bodies = [Drawn(kind, (kind,), (kind,)) for kind in kinds for _ in range(100)]
    camera_path = CameraPath.of([view_at([0, 0, 5], heading=90)] * 12, aspect=ASPECT)
    positions = np.broadcast_to([20.0, 0.0, 0.0], (1200, 12, 3))
    alive = np.zeros((1200, 12), dtype=bool)
    for k in range(12):
        alive[100 * k : 100 * (k + 1), k] = True
    plan = plan_crowd(bodies, [CrowdFrames(camera_path, alive, positions)])
    assert sum(plan.slots.near.values()) <= crowd.MOST_SLOTS
    assert plan.limit < crowd.MOST_NEAR
    assert all(plan.slots.near[kind] + plan.slots.far[kind] == 100 for kind in kinds)


def test_chunks_cover_everything_once():
    for count in (0, 1, 199, 200, 201, 1000):
        covered = [n for part in chunks(count) for n in range(count)[part]]
        assert covered == list(range(count))
