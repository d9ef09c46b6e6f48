"""Room for everyone whom a shot shows."""

from collections import Counter

import numpy as np
from builders import view_at

from sumo3dviz_pt.cast.drawing import Drawn
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.scene import Slots
from sumo3dviz_pt.shot.crowd import (
    MOST_FULL_MODELS,
    MOST_SLOTS,
    Choice,
    CrowdFrames,
    CrowdPlan,
    _Members,
    can_be_full,
    fitting,
    plan_crowd,
)

CAR = Drawn("sedan", ("sedan",), ("sedan",), ("sedan/full", *(["sedan/wheel"] * 4)))
TRAIN = Drawn("train", ("engine", "car", "car"), ("engine", "car", "car"))
WALKER = Drawn("walker", (), ("walker",), deforming=("walker",))


def frames_of(positions, *, alive=None, times=1):
    """A camera at the origin that looks east at road users, (k, 3) or (k, n, 3) [m]."""
    places = np.asarray(positions, dtype=float)
    if places.ndim == 2:
        places = np.repeat(places[:, None], times, axis=1)
    times = places.shape[1]
    here = np.ones(places.shape[:2], dtype=bool) if alive is None else np.asarray(alive, dtype=bool)
    camera_path = CameraPath.of([view_at((0.0, 0.0, 1.5), heading=90.0)] * times, aspect=9 / 16)
    return [CrowdFrames(camera_path, here, places)]


def in_a_row(count, *, first, step=0.0):
    return [(first + step * k, 0.0, 0.0) for k in range(count)]


def test_nobody_needs_no_room():
    plan = plan_crowd([CAR], frames_of([(5000.0, 0.0, 0.0)]))
    assert plan.full_models == frozenset()
    assert not plan.slots.near and not plan.slots.far and not plan.slots.deforming


def test_every_distance_has_its_level():
    plan = plan_crowd([CAR] * 3, frames_of([(8.0, 0, 0), (100.0, 0, 0), (600.0, 0, 0)]))
    assert plan.full_models == {"sedan"}
    assert plan.slots.near == {"sedan": 1, "sedan/full": 1, "sedan/wheel": 4}
    assert plan.slots.far == {"sedan": 1}


def test_units_need_a_slot_each():
    plan = plan_crowd([TRAIN] * 2, frames_of([(50.0, 0, 0), (90.0, 0, 0)]))
    assert plan.slots.near == {"engine": 2, "car": 4}


def test_who_takes_poses_is_not_instanced():
    plan = plan_crowd([WALKER, CAR], frames_of([(50.0, 0, 0), (60.0, 0, 0)]))
    assert plan.slots.deforming == {"walker": 1} and plan.slots.near == {"sedan": 1}


def test_what_joins_units_takes_poses_in_full_detail_too():
    full = ("front/full", "front/wheel", "rear/full", "rear/wheel")
    bus = Drawn("bus", ("front", "rear"), ("front", "rear", "fold"), full, ("fold",), 18.0)
    plan = plan_crowd([bus] * 3, frames_of([(12.0, 0, 0), (60.0, 0, 0), (600.0, 0, 0)]))
    assert plan.slots.deforming == {"fold": 2}
    assert plan.slots.far == {"front": 1, "rear": 1, "fold": 1}
    assert plan.slots.near["front"] == plan.slots.near["front/full"] == 1


def test_a_train_is_seen_after_its_front_has_gone():
    """Its front is 150 m behind the camera, its last carriage before it."""
    gone = frames_of([(-150.0, 4.0, 0.0)])
    long = Drawn("train", ("engine",), ("engine",), length=200.0)
    assert plan_crowd([long], gone).slots.near == {"engine": 1}
    assert plan_crowd([TRAIN], gone).slots.near == {}
    # And it is drawn in detail while its rear is near.
    away = frames_of([(330.0, 4.0, 0.0)])
    assert plan_crowd([long], away).slots.near == {"engine": 1}
    assert plan_crowd([TRAIN], away).slots.far == {"engine": 1, "car": 2}


def test_room_is_for_the_most_at_once_not_for_all():
    """Ten cars, one after the other: each frame shows one."""
    places = np.full((10, 10, 3), (50.0, 0.0, 0.0))
    plan = plan_crowd([CAR] * 10, frames_of(places, alive=np.eye(10)))
    assert plan.slots.near == {"sedan": 1}


def test_chunks_of_a_shot_count_together():
    near, far = frames_of([(50.0, 0, 0)]), frames_of([(900.0, 0, 0)])
    plan = plan_crowd([CAR], [*near, *far])
    assert plan.slots.near == {"sedan": 1} and plan.slots.far == {"sedan": 1}


def test_detail_gives_way_where_instances_would_be_too_many():
    count = 200
    trains = [Drawn("train", ("car",) * 6, ("car",) * 6)] * count
    plan = plan_crowd(trains, frames_of(in_a_row(count, first=30.0, step=1.0)))
    assert sum(plan.slots.near.values()) <= MOST_SLOTS
    assert plan.slots.near["car"] == 6 * plan.limit
    assert plan.slots.far["car"] == 6 * (count - plan.limit)


def test_only_some_models_are_shown_in_full_detail():
    """The most seen ones; who is no copy of them is drawn in the middle level."""
    count = MOST_FULL_MODELS + 3
    bodies = [
        Drawn(f"m{k:02}", (f"m{k:02}",), (f"m{k:02}",), (f"m{k:02}/full",)) for k in range(count)
    ]
    # One at a time stands near the camera, the later ones longer.
    times = sum(range(1, count + 1))
    alive = np.zeros((count, times), dtype=bool)
    alive[np.repeat(np.arange(count), np.arange(1, count + 1)), np.arange(times)] = True
    places = np.full((count, times, 3), (8.0, 0.0, 0.0))
    plan = plan_crowd(bodies, frames_of(places, alive=alive))
    assert plan.full_models == {f"m{k:02}" for k in range(3, count)}
    assert can_be_full(bodies, plan.full_models).tolist() == [k >= 3 for k in range(count)]
    assert {name for name in plan.slots.near if "/" not in name} == {"m00", "m01", "m02"}


def test_models_without_full_detail_never_show_it():
    assert not can_be_full([TRAIN], frozenset(["train"])).any()


def test_the_order_of_frames_does_not_matter():
    parts = [*frames_of([(50.0, 0, 0), (400.0, 0, 0)]), *frames_of([(700.0, 0, 0), (9.0, 0, 0)])]
    one, other = (plan_crowd([CAR, TRAIN], some) for some in (parts, parts[::-1]))
    assert isinstance(one, CrowdPlan) and one == other
    assert list(one.slots.near) == sorted(one.slots.near) == list(other.slots.near)


def chosen(levels):
    """A choice of one time by a level for each road user."""
    rows = [np.array([[level == name] for level in levels]) for name in LEVELS]
    return Choice(*rows, np.zeros_like(rows[0]))


def levels_of(choice):
    """The level of each road user, or None."""
    rows = zip(choice.near[:, 0], choice.far[:, 0], choice.full[:, 0], strict=True)
    return [next((name for name, on in zip(LEVELS, row, strict=True) if on), None) for row in rows]


LEVELS = ("near", "far", "full")


def test_who_finds_no_room_in_detail_is_drawn_by_a_stand_in():
    slots = Slots(near={"sedan": 1}, far={"sedan": 3})
    choice = fitting(chosen(["near"] * 3), [CAR] * 3, slots, np.array([9.0, 3.0, 5.0]))
    assert levels_of(choice) == ["far", "near", "far"], "the nearest comes first"


def test_who_finds_no_room_at_all_is_not_drawn():
    slots = Slots(near={"engine": 1, "car": 3}, far={"engine": 1, "car": 1})
    choice = fitting(chosen(["near", "near"]), [TRAIN] * 2, slots, np.array([1.0, 2.0]))
    assert levels_of(choice) == ["near", None], "the second train lacks a carriage at both levels"


def test_full_detail_gives_way_to_the_middle_level():
    slots = Slots(near={"sedan": 2, "sedan/full": 1, "sedan/wheel": 4}, far={"sedan": 2})
    choice = fitting(chosen(["full", "full"]), [CAR] * 2, slots, np.array([8.0, 4.0]))
    assert levels_of(choice) == ["near", "full"]


def test_nobody_is_brought_nearer_than_was_chosen():
    slots = Slots(near={"sedan": 9}, far={"sedan": 9}, deforming={"walker": 9})
    wanted = chosen(["far", None, "near"])
    choice = fitting(wanted, [CAR, CAR, WALKER], slots, np.array([1.0, 2.0, 3.0]))
    assert levels_of(choice) == ["far", None, "near"]


def test_the_most_bodies_at_once_are_those_of_some_frame():
    rng = np.random.default_rng(5)
    drawn = [("a", "b")[: rng.integers(0, 3)] + ("a",) * int(rng.integers(0, 2)) for _ in range(9)]
    for share in (0.0, 0.1, 0.7):
        chosen = np.repeat(rng.random((9, 20)) < share, 3, axis=1)
        frames = [Counter(n for k in np.flatnonzero(f) for n in drawn[k]) for f in chosen.T]
        wanted = {n: most for n in "ab" if (most := max(frame[n] for frame in frames))}
        assert _Members.of(drawn).most(chosen) == wanted
