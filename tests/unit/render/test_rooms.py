"""Rooms behind panes: they have depth, and no light of their own by day."""

import numpy as np
import pytest

from sumo3dviz_pt.render.backend import choose_backend

COUNT = 4000


@pytest.fixture(scope="module")
def rooms():
    if not choose_backend().jit:
        pytest.skip("no JIT variant here")
    from sumo3dviz_pt.render import rooms

    return rooms


def floats(*columns):
    import mitsuba as mi

    return [mi.Float(np.ascontiguousarray(column, np.float32)) for column in columns]


def panes(rng, block=None):
    """Random points on random panes, as their corners tell them."""
    import mitsuba as mi

    sizes = rng.integers(18, 60, (2, COUNT)) + rng.uniform(0.01, 0.99, (2, COUNT))
    number = rng.integers(0, 1024, COUNT) if block is None else block * 128 + rng.integers(0, 128)
    return mi.Color3f(*floats(*sizes / 128.0, np.broadcast_to((number + 0.5) / 1024.0, COUNT)))


def views(rng, *, steepest=0.05):
    """Directions from a pane that looks along x to eyes before it."""
    import mitsuba as mi

    d = rng.normal(size=(3, COUNT))
    d[0] = np.abs(d[0]) * rng.uniform(steepest, 1.0, COUNT)
    d /= np.linalg.norm(d, axis=0)
    return mi.Vector3f(*floats(*d)), d


def seen(rooms, place, view, walls=(0.5, 0.45, 0.4)):
    import mitsuba as mi

    ray = rooms.inward(view, mi.Vector3f(1.0, 0.0, 0.0))
    return [
        np.array(each)
        for each in rooms.seen_through(place, ray, mi.Color3f(*walls), mi.Float(20.0))
    ]


def test_what_is_shown_moves_with_the_eye_as_a_back_wall_does(rooms):
    """From any eye, the line to a point of the back wall shows that point."""
    import mitsuba as mi

    rng = np.random.default_rng(5)
    depth = rng.uniform(2.0, 7.0, COUNT)
    target = np.stack([rng.uniform(-0.8, 1.8, COUNT), rng.uniform(-0.7, 1.7, COUNT), depth])
    eye = np.stack(
        [rng.uniform(-9, 9, COUNT), rng.uniform(-6, 6, COUNT), -rng.uniform(3, 40, COUNT)]
    )
    share = -eye[2] / (depth - eye[2])
    x, y, _ = eye + share * (target - eye)
    # The pane looks along x: its left edge is at low y, and inwards is -x.
    way = eye - target
    view = mi.Vector3f(
        *floats(*(np.stack([-way[2], way[0], way[1]]) / np.linalg.norm(way, axis=0)))
    )
    ray = rooms.inward(view, mi.Vector3f(1.0, 0.0, 0.0))
    box = rooms.Box(mi.Float(-1), mi.Float(2), mi.Float(-0.9), mi.Float(1.8), *floats(depth))
    px, py = floats(x, y)
    far = rooms.leaves(box, px, py, ray)[0]
    # What lies between pane and back wall may end the ray only beside the room.
    found = np.stack([np.array(p) for p in (px + far * ray.x, py + far * ray.y, far * ray.z)])
    inside = (np.abs(x - 0.5) < 1.5) & (np.abs(y - 0.45) < 1.35)
    assert inside.sum() > 500
    assert np.abs(found - target)[:, inside].max() < 2e-3


@pytest.mark.parametrize("steepest", [1.0, 0.02, 1e-7])
def test_colours_are_sound_at_all_angles(rooms, steepest):
    rng = np.random.default_rng(6)
    view, _ = views(rng, steepest=steepest)
    day, glow = seen(rooms, panes(rng), view)
    assert np.isfinite(day).all() and np.isfinite(glow).all()
    assert day.min() > 0.0 and day.max() <= 0.75
    assert glow.min() > 0.0 and glow.max() <= 6.0


def test_rooms_are_dark_by_day_and_cloth_is_not(rooms):
    rng = np.random.default_rng(7)
    draped, bare = (seen(rooms, panes(rng, block), views(rng)[0])[0].mean() for block in (0, 1))
    assert bare < 0.12 < draped


def test_lit_rooms_are_about_as_bright_as_the_lamp_says(rooms):
    rng = np.random.default_rng(8)
    place, view = panes(rng), views(rng, steepest=1.0)[0]
    assert 0.6 < seen(rooms, place, view)[1].mean() < 1.3


def test_a_plain_pane_has_its_own_colour(rooms):
    rng = np.random.default_rng(9)
    day, glow = seen(rooms, panes(rng, 6), views(rng)[0])
    assert day.reshape(3, -1)[:, 0] == pytest.approx([0.5, 0.45, 0.4])
    assert (glow == 1.0).all()


def test_rooms_differ_and_stay(rooms):
    rng = np.random.default_rng(10)
    place, (view, _) = panes(rng), views(rng)
    day = seen(rooms, place, view)[0]
    assert (seen(rooms, place, view)[0] == day).all()
    assert len(np.unique(day.round(3))) > 300
