"""Splashes on the ground, and spray behind tyres."""

import numpy as np
from raining import LENS, SIZE, falling_at, view_from

from sumo3dviz_pt.model.falling import Puffs, SkyLight
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.render.falling.drawn import splashes, with_falling

LIGHT = SkyLight((0.5, 0.5, 0.5))
VIEW = view_from((0.0, 0.0, 2.0), pitch=-0.15)


def plain(albedo=(0.1, 0.1, 0.1), wall=None):
    """What a camera sees of flat ground at height 0, and of a wall."""
    rays = VIEW.directions(SIZE)
    away = np.where(rays[..., 2] < -1e-3, -2.0 / np.minimum(rays[..., 2], -1e-3), 0.0)
    away = np.where(away < 200.0, away, 0.0)
    if wall is not None:
        before = wall / rays[..., 0]
        away = np.where((away > before) | (away == 0.0), before, away)
    hit = (away > 0.0).astype(np.float32)
    colour = np.broadcast_to(np.float32(albedo), (*hit.shape, 3))
    return Layers({"depth": away.astype(np.float32), "hit": hit, "albedo": colour})


def test_crowns_stand_on_the_ground_before_the_camera():
    falling = falling_at(view=VIEW, rain=30.0)
    found = splashes(falling, LIGHT, plain(), lens=LENS, size=SIZE)
    assert found is not None and len(found.widths) > 20
    assert found.away.max() < 14.0
    # They rise, and their feet are where the ground is seen.
    assert (found.starts[0] >= found.ends[0] - 1e-6).all()
    seen = plain()["depth"]
    rows, columns = np.rint(found.starts).astype(int)
    np.testing.assert_allclose(seen[rows, columns] * 0.97, found.away, rtol=0.05)


def test_crowns_last_for_more_than_a_frame_and_then_go():
    def marks(time):
        falling = falling_at(time, view=VIEW, rain=30.0)
        found = splashes(falling, LIGHT, plain(), lens=LENS, size=SIZE)
        return {tuple(np.round(at, 6)) for at in found.starts.T}

    now, next_frame, later = marks(12.0), marks(12.04), marks(12.2)
    assert 0.2 * len(now) < len(now & next_frame) < 0.9 * len(now)
    assert len(now & later) == 0


def test_grass_and_walls_do_not_splash():
    falling = falling_at(view=VIEW, rain=30.0)
    green = splashes(falling, LIGHT, plain((0.05, 0.12, 0.03)), lens=LENS, size=SIZE)
    assert green is None
    walled = splashes(falling, LIGHT, plain(wall=5.0), lens=LENS, size=SIZE)
    free = splashes(falling, LIGHT, plain(), lens=LENS, size=SIZE)
    assert walled.away.max() < 6.5 < free.away.max()


def covered(puffs, seen):
    """How much of a black picture puffs whiten, (h, w)."""
    falling = falling_at(view=VIEW, puffs=puffs)
    black = np.zeros((*seen["hit"].shape, 3), np.float32)
    return with_falling(black, seen, VIEW, falling, LIGHT)[..., 1]


def puff(away, radius=0.8, depth=0.5):
    at = VIEW.position + away * VIEW.forward
    return Puffs(at[None], np.array([radius]), np.array([depth]))


def test_spray_covers_what_is_behind_it_and_is_hidden_by_what_is_before():
    behind, before = covered(puff(8.0), plain(wall=20.0)), covered(puff(8.0), plain(wall=5.0))
    assert behind.max() > 0.05 and before.max() < 0.02 * behind.max()
    within = covered(puff(8.0), plain(wall=8.0)).max()
    assert 0.3 * behind.max() < within < 0.7 * behind.max()


def test_spray_is_soft():
    shown = covered(puff(8.0), plain(wall=30.0))
    steps = np.abs(np.diff(shown, axis=1)).max()
    assert steps < 0.12 * shown.max()


def test_two_puffs_cover_as_optical_depths_add():
    one = covered(puff(8.0, depth=0.3), plain(wall=30.0))
    both = Puffs(
        *(np.concatenate([getattr(puff(8.0, depth=0.3), n)] * 2) for n in ("at", "radii", "depths"))
    )
    two = covered(both, plain(wall=30.0))
    white = one.max() / (1.0 - np.exp(-0.3 * 1.0))
    place = np.unravel_index(one.argmax(), one.shape)
    assert two[place] > 1.6 * one[place] and two.max() < white * 1.05


def test_spray_that_nothing_throws_up_changes_nothing():
    seen = plain(wall=30.0)
    picture = np.random.default_rng(3).random((*seen["hit"].shape, 3), dtype=np.float32)
    found = with_falling(picture, seen, VIEW, falling_at(view=VIEW), LIGHT)
    np.testing.assert_array_equal(found, picture)
