"""Drops in the air: how many there are, how large, how fast, and that they are always the same."""

import numpy as np
import pytest
from raining import LENS, SIZE, falling_at, view_from

from sumo3dviz_pt.model.falling import drop_speed, rain_sizes, snow_sizes
from sumo3dviz_pt.render.falling import drops as kinds
from sumo3dviz_pt.render.falling.drops import carried, drops_before

RATE = 20.0


def before(falling, matter=None, rate=RATE):
    return drops_before(falling, matter or kinds.rain(), rate, lens=LENS, size=SIZE)[0]


def pyramid(away, near=0.5):
    """Volume of what is seen between two distances along the axis [m^3]."""
    area = 4.0 * LENS.half_width**2 * SIZE[1] / SIZE[0]
    return area * (away**3 - near**3) / 3.0


def seen(drops, view, away, near=0.5):
    """Which drops lie in the picture between two distances along the axis."""
    middle = 0.5 * (drops.first + drops.last)
    local = (middle - view.position) @ view.world_from_camera.matrix[:3, :3]
    return LENS.sees(local, SIZE[1] / SIZE[0]) & (local[:, 0] > near) & (local[:, 0] < away)


@pytest.mark.parametrize(("matter", "sizes"), [(kinds.rain, rain_sizes), (kinds.snow, snow_sizes)])
def test_numbers_and_sizes_follow_the_distribution(matter, sizes):
    least = 2.0 if matter is kinds.rain else 1.2
    rate, away = (RATE, 6.0) if matter is kinds.rain else (2.0, 3.0)
    spread = sizes(rate)
    counts, wide = [], []
    for turn in range(12):
        view = view_from((40.0 * turn, -7.0, 3.0), yaw=0.5 * turn)
        drops = before(falling_at(3.0 * turn, view=view), matter(), rate)
        inside = seen(drops, view, away) & (drops.diameters > 1e-3 * matter().diameter(least))
        counts.append(float(drops.shown[inside].sum()))
        wide.append(drops.diameters[inside])
    expected = 12 * float(spread.above(least)) * pyramid(away)
    assert sum(counts) == pytest.approx(expected, abs=4.0 * np.sqrt(expected) + 0.02 * expected)
    if matter is kinds.rain:
        # Of an exponential distribution the mean above a limit is 1/slope more.
        mean = 1e3 * np.concatenate(wide).mean()
        assert mean == pytest.approx(least + 1.0 / spread.slope, rel=0.05)


def test_each_falls_as_fast_as_its_size_says():
    falling = falling_at(exposure=0.01)
    drops = before(falling)
    down = (drops.first[:, 2] - drops.last[:, 2]) / falling.exposure
    known = drop_speed(1e3 * drops.diameters)
    off = down / known - 1.0
    assert np.abs(off[drops.diameters > 1e-3]).max() < 0.12
    assert abs(float(np.median(off))) < 0.03


def test_wind_carries_them():
    still, windy = (before(falling_at(wind=wind)) for wind in ((0.0, 0.0), (5.0, -2.0)))
    moved = [(each.last - each.first).mean(axis=0) / 0.01 for each in (still, windy)]
    np.testing.assert_allclose(moved[1][:2] - moved[0][:2], (3.5, -1.4), atol=0.1)


def marks(drops, which):
    """Drops as sorted rows of their places and sizes."""
    rows = np.column_stack([0.5 * (drops.first + drops.last), drops.diameters])[which]
    return rows[np.lexsort(rows.T)]


def test_drops_are_where_they_are_whoever_looks():
    one, other = view_from((0.0, 0.0, 2.0)), view_from((-1.0, 0.3, 2.2), yaw=0.05)
    found = [before(falling_at(100.0, view=view)) for view in (one, other)]
    both = [
        seen(d, one, 3.0, 1.5) & seen(d, other, 4.5, 1.5) & (d.diameters > 0.0015) for d in found
    ]
    assert both[0].sum() > 50
    np.testing.assert_allclose(marks(found[0], both[0]), marks(found[1], both[1]), atol=1e-9)


def test_a_frame_does_not_depend_on_others():
    falling = falling_at(55.0)
    alone = before(falling)
    before(falling_at(54.96))
    again = before(falling)
    np.testing.assert_array_equal(alone.first, again.first)
    np.testing.assert_array_equal(alone.diameters, again.diameters)


def test_drops_stay_the_same_over_time():
    early, late = (
        falling_at(time, wind=(2.0, 0.0), drift=(2.0 * time, 0.0)) for time in (9.0, 9.1)
    )
    largest = kinds.rain().kinds[-3]
    shift = carried(late, largest, 9.1) - carried(early, largest, 9.0)
    np.testing.assert_allclose(shift, (0.14, 0.0, -0.1 * largest.speed), atol=1e-9)
    one, other = before(early), before(late)
    own = [np.flatnonzero(d.speeds == largest.speed) for d in (one, other)]
    # Every large drop near the middle of the view is found again where it must have fallen to.
    sizes = {round(float(d), 12) for d in other.diameters[own[1]]}
    kept = own[0][seen(one.only(own[0]), view_from((0.0, 0.0, 2.5)), 6.0, 2.0)]
    assert len(kept) > 2
    assert all(round(float(one.diameters[k]), 12) in sizes for k in kept)


def test_more_rain_brings_drops_little_by_little():
    counts = [float(before(falling_at(), rate=rate).shown.sum()) for rate in (10.0, 10.001)]
    assert counts[1] == pytest.approx(counts[0], rel=0.002)


def test_other_seeds_have_other_drops():
    from dataclasses import replace

    falling = falling_at()
    one, other = before(falling), before(replace(falling, seed=8))
    assert not np.array_equal(one.diameters[:50], other.diameters[:50])
