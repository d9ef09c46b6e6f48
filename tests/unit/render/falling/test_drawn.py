"""Strokes that drops leave: how long, how strong, and behind what."""

import numpy as np
import pytest
from raining import LENS, SIZE, falling_at, view_from

from sumo3dviz_pt.model.falling import Cabin, SkyLight
from sumo3dviz_pt.render.falling.drawn import inside, strokes_of
from sumo3dviz_pt.render.falling.drops import Drops, Reach
from sumo3dviz_pt.render.falling.strokes import Veil, draw

FOCAL = 1.0 / LENS.pixel_width(SIZE[0])
GREY = SkyLight((0.5, 0.5, 0.5))


def drop(place, velocity, falling, diameter=0.003):
    """A single drop as it flies through a place in the middle of the exposure."""
    half = 0.5 * falling.exposure * np.array(velocity)
    place = np.array(place)
    speed = np.array([float(np.linalg.norm(velocity))])
    return Drops(
        (place - half)[None], (place + half)[None], np.array([diameter]), speed, np.ones(1)
    )


def strokes(drops, falling, cover=1e-6):
    return strokes_of(
        drops, falling, Reach(cover, FOCAL, falling.exposure), GREY, lens=LENS, size=SIZE
    )


def length(found):
    return float(np.hypot(*(found.ends - found.starts))[0])


def test_a_streak_is_as_long_as_the_drop_falls_before_a_still_camera():
    falling = falling_at(exposure=0.02, aperture=0.0)
    found = strokes(drop((5.0, 0.0, 2.0), (0.0, 0.0, -8.0), falling), falling)
    assert length(found) == pytest.approx(8.0 * 0.02 / 5.0 * FOCAL, rel=1e-3)


def test_a_streak_follows_the_cameras_own_motion():
    # 50 km/h ahead: a drop beside the way moves outwards as well.
    speed = 50.0 / 3.6
    falling = falling_at(exposure=0.02, velocity=(speed, 0.0, 0.0))
    found = strokes(drop((5.0, 1.0, 2.0), (0.0, 0.0, -8.0), falling), falling)
    before, after = 5.0 + 0.01 * speed, 5.0 - 0.01 * speed
    across = FOCAL * (1.0 / after - 1.0 / before)
    down = FOCAL * (0.08 / after + 0.08 / before)
    np.testing.assert_allclose(np.abs(found.ends - found.starts)[:, 0], (down, across), rtol=1e-3)


def test_a_drop_that_moves_as_the_camera_does_leaves_no_streak():
    falling = falling_at(exposure=0.02, velocity=(3.0, -2.0, -6.0))
    found = strokes(drop((4.0, 0.0, 2.0), (3.0, -2.0, -6.0), falling), falling)
    assert length(found) < 1e-6


@pytest.mark.parametrize(("diameter", "away"), [(0.002, 4.0), (0.004, 1.2), (0.012, 2.0)])
def test_what_it_covers_is_its_face_for_the_time_of_the_exposure(diameter, away):
    """Garg and Nayar: cover is the time before a pixel over the exposure; sums are the same."""
    falling = falling_at(exposure=0.02, aperture=0.0)
    found = strokes(drop((away, 0.0, 2.0), (0.1, -1.0, -8.0), falling, diameter), falling)
    veil = Veil(np.full(SIZE[::-1], 100.0, np.float32), np.ones(SIZE[::-1], np.float32))
    draw(veil, found)
    black = veil.over(np.zeros((*SIZE[::-1], 3), np.float32))[..., 0] / found.colours[0, 0]
    width = diameter / away * FOCAL
    assert float(black.sum()) == pytest.approx(np.pi / 4.0 * width**2, rel=0.08)


def test_longer_exposures_cover_less_of_more_pixels():
    covers = []
    for exposure in (0.004, 0.016):
        falling = falling_at(exposure=exposure)
        found = strokes(drop((4.0, 0.0, 2.0), (0.0, 0.0, -8.0), falling), falling)
        covers.append(float(found.depths[0]) * (length(found) + float(found.widths[0])))
    assert covers[0] == pytest.approx(covers[1], rel=0.15)


def test_what_is_nearer_hides_a_drop():
    falling = falling_at()
    found = strokes(drop((5.0, 0.0, 2.0), (0.0, 0.0, -8.0), falling), falling)
    for away, hit, share in ((3.0, 1.0, 0.0), (8.0, 1.0, 1.0), (3.0, 0.0, 1.0), (3.0, 0.25, 0.75)):
        shape = SIZE[::-1]
        veil = Veil(np.full(shape, away, np.float32), np.full(shape, hit, np.float32))
        draw(veil, found)
        total = float(veil._depth.sum())
        if share == 1.0:
            whole = total
        assert total == pytest.approx(
            share * (whole if away == 3.0 and hit < 1.0 else total), rel=1e-3
        )
        assert (total > 0.0) == (share > 0.0)


def test_drops_come_and_go_softly_with_distance():
    falling = falling_at()
    reach = Reach(0.02, FOCAL, falling.exposure)
    end = float(reach.end(np.array(0.003), np.array(8.0)))
    depths = []
    for away in (0.4 * end, 0.9 * end, 0.99 * end, 1.01 * end):
        found = strokes_of(
            drop((away, 0.0, 2.0), (0.0, 0.0, -8.0), falling),
            falling,
            reach,
            GREY,
            lens=LENS,
            size=SIZE,
        )
        depths.append(float(found.depths.sum()))
    assert depths[0] > depths[1] > depths[2] >= depths[3] == 0.0
    assert depths[2] < 0.01 * depths[0]
    near = [
        float(strokes(drop((a, 0.0, 2.0), (0.0, 0.0, -8.0), falling), falling).depths.sum())
        for a in (0.36, 0.5)
    ]
    assert near[0] < 0.05 * near[1]


def test_nothing_falls_inside_the_ridden_vehicle():
    cabin = Cabin(np.eye(4), np.array([4.5, 1.8, 1.5]))
    places = np.array([[-2.0, 0.0, 1.0], [-2.0, 0.0, 1.6], [0.5, 0.0, 1.0], [-2.0, 1.0, 1.0]])
    assert inside(cabin, places).tolist() == [True, False, False, False]
    falling = falling_at(view=view_from((-2.0, 0.4, 1.2)), cabin=cabin)
    some = [drop((x, 0.4, 1.2), (0.0, 0.0, -8.0), falling) for x in (-0.9, 1.5)]
    assert [len(strokes(each, falling).widths) for each in some] == [0, 1]


def test_a_lens_out_of_focus_spreads_near_flakes():
    place, velocity = (1.0, 0.0, 2.0), (0.0, 0.0, -1.0)
    sharp, soft = (falling_at(aperture=aperture) for aperture in (0.0, 0.02))
    one, other = (strokes(drop(place, velocity, f, 0.006), f) for f in (sharp, soft))
    assert other.widths[0] > 2.0 * one.widths[0]
    assert other.depths[0] < 0.5 * one.depths[0]


@pytest.mark.parametrize("velocity", [(0.0, 6.0, -8.0), (0.0, -4.0, 3.0), (0.0, 20.0, 0.0)])
def test_a_rolling_shutter_sees_each_end_of_a_streak_at_its_rows_time(velocity):
    """What flies across the axis moves evenly in the picture."""
    falling = falling_at(exposure=0.02, aperture=0.0, rolling=0.03)
    plain = falling_at(exposure=0.02, aperture=0.0)
    for up in (-1.2, 0.0, 1.2):
        flying = drop((5.0, 0.4, 2.0 + up), velocity, falling)
        rolled, still = strokes(flying, falling), strokes(flying, plain)
        for now, then, at in (
            (rolled.starts, still.starts, -0.01),
            (rolled.ends, still.ends, 0.01),
        ):
            late = 0.03 * ((now[0, 0] + 0.5) / SIZE[1] - 0.5)
            place = np.array([5.0, 0.4, up]) + (at + late) * np.array(velocity)
            row, column = LENS.project(place, SIZE)[0]
            np.testing.assert_allclose(now[:, 0], (row, column), atol=1e-6)
            assert up == 0.0 or np.abs(now - then).max() > 1.0
