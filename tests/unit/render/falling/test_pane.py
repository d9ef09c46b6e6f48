"""Drops on the pane before a driver's eye, and its wipers."""

from dataclasses import replace

import numpy as np
import pytest
from raining import LENS, SIZE, falling_at, view_from

from sumo3dviz_pt.model.falling import SkyLight, Windscreen
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.render.falling.drawn import with_falling
from sumo3dviz_pt.render.falling.pane import _drops, _wiped, blade_angle, through_pane

LIGHT = SkyLight((0.5, 0.5, 0.5))


def pane(wiped=10.9, wet=400.0, period=2.0):
    frame = np.array(
        [[0.0, -0.8, 0.6, 0.9], [1.0, 0.0, 0.0, -0.3], [0.0, 0.6, 0.8, -0.25], [0.0, 0.0, 0.0, 1.0]]
    )
    pivots = np.array([[0.5, -0.04], [-0.2, -0.04]])
    return Windscreen(frame, (1.4, 0.75), pivots, (0.07, 0.7), wiped, period, wet)


def picture():
    """A dark road under a bright sky, far away."""
    height, width = SIZE[1], SIZE[0]
    radiance = np.full((height, width, 3), 0.1, np.float32)
    radiance[: height // 2] = 1.0
    seen = Layers(
        {
            "depth": np.full((height, width), 30.0, np.float32),
            "hit": np.ones((height, width), np.float32),
        }
    )
    return radiance, seen


def test_more_drops_settle_the_longer_no_blade_passed():
    places = np.array([[0.2, 0.3], [-0.3, 0.35], [0.65, 0.7]])
    counts = []
    for wiped in (10.55, 10.7, 10.9):
        since, _ = _wiped(places, pane(wiped))
        assert np.isfinite(since[:2]).all() and not np.isfinite(since[2])
        assert (since[:2] <= 2.0).all()
        counts.append(len(_drops(7, pane(wiped), wiped * 2.0).at))
    assert counts[0] < counts[1] < counts[2]


def test_a_drop_stays_where_it_settled_until_a_blade_passes():
    early, late = (_drops(7, pane(wiped), 2.0 * wiped) for wiped in (10.75, 10.9))
    since, _ = _wiped(early.at, pane(10.75))
    kept = {tuple(np.round(at, 9)) for at in early.at[np.isfinite(since)]}
    # Squares at the edge of what blades wipe are not wiped, though their drops may lie inside.
    gone = kept - {tuple(np.round(at, 9)) for at in late.at}
    assert len(gone) < 0.03 * len(kept)
    later = {tuple(np.round(at, 9)) for at in _drops(7, pane(11.9), 23.8).at}
    assert len(kept & later) < 0.5 * len(kept)


def test_blades_go_up_and_down_and_rest():
    angles = [blade_angle(pane(10.0 + share)) for share in np.linspace(0.0, 0.999, 200)]
    top = int(np.argmax(angles))
    assert (np.diff(angles[: top + 1]) >= 0.0).all() and (np.diff(angles[top:]) <= 1e-12).all()
    assert max(angles) > 1.5 and angles[-1] == angles[0] == pytest.approx(0.03)
    assert np.abs(np.diff(angles)).max() < 0.1


def test_drops_turn_the_scene_upside_down():
    radiance, seen = picture()
    falling = falling_at(windscreen=pane(10.9, wet=3000.0), aperture=0.0)
    found = through_pane(radiance, seen, falling, LIGHT, LENS)
    changed = np.abs(found - radiance).max(axis=-1) > 0.02
    assert 0.002 < changed.mean() < 0.4
    # Drops before the road show sky, and those before the sky show road.
    below, above = changed.copy(), changed.copy()
    below[: SIZE[1] // 2 + 4], above[SIZE[1] // 2 - 4 :] = False, False
    assert (found[below] > radiance[below]).any() and (found[above] < radiance[above]).any()


def test_what_is_nearer_than_the_pane_stays_as_it_is():
    radiance, seen = picture()
    depth = np.array(seen["depth"])
    depth[:, : SIZE[0] // 2] = 0.4
    falling = falling_at(windscreen=pane(10.2, wet=3000.0))
    found = through_pane(radiance, Layers({**seen, "depth": depth}), falling, LIGHT, LENS)
    np.testing.assert_array_equal(found[:, : SIZE[0] // 2], radiance[:, : SIZE[0] // 2])
    assert not np.array_equal(found, radiance)


def test_pictures_without_a_pane_are_not_bent():
    radiance, seen = picture()
    falling = falling_at()
    found = with_falling(radiance, seen, view_from(), falling, LIGHT)
    np.testing.assert_array_equal(found, radiance)
    wet = replace(falling, windscreen=pane())
    again = [with_falling(radiance, seen, view_from(), wet, LIGHT) for _ in range(2)]
    np.testing.assert_array_equal(*again)


@pytest.mark.parametrize("wiped", [10.3, 10.9], ids=["moving", "resting"])
def test_blades_are_always_before_the_pane(wiped):
    """Traced cabins have no wipers where there is a pane, so none may vanish between turns."""
    radiance, seen = picture()
    found = through_pane(radiance, seen, falling_at(windscreen=pane(wiped, wet=0.0)), LIGHT, LENS)
    darker = (found < 0.8 * radiance).all(axis=-1)
    assert 20 < darker.sum() < 0.1 * darker.size
    assert not (found > radiance + 1e-6).any()
