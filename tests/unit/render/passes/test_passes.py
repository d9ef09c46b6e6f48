"""Passes are counted, capped and averaged."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.render.passes.samples import Accumulator, capped, frame_seed

SHAPE = (3, 4, 3)


def image(value=1.0, shape=(500, 400, 3)):
    return np.full(shape, value, dtype=np.float32)


def test_counts_broken_and_negative_pixels():
    picture = image()
    picture[0, 0] = (np.nan, 1, 1)
    picture[1, 2, 1] = np.inf
    picture[2, 2, 0] = -np.inf
    picture[3, 3] = (-1, 2, 2)
    accumulator = Accumulator()
    for _ in range(2):
        accumulator.add(picture)
    tally = accumulator.tally
    assert (tally.nonfinite, tally.negative, tally.passes) == (6, 2, 2)
    with pytest.raises(RenderError, match="6 pixel values of 2 passes"):
        accumulator.mean()


def test_few_broken_pixels_become_black():
    picture = image()
    picture[0, 0] = np.nan
    picture[5, 5] = (-1, 2, 2)
    accumulator = Accumulator()
    accumulator.add(picture)
    mean = accumulator.mean()
    assert np.isfinite(mean).all() and (mean >= 0).all()
    np.testing.assert_array_equal(mean[0, 0], 0)
    np.testing.assert_array_equal(mean[5, 5], [0, 2, 2])
    assert picture[5, 5, 0] == -1, "the pass itself must not change"


@pytest.mark.parametrize(("broken", "fails"), [(2, False), (3, True)])
def test_a_share_of_1e_5_is_the_limit(broken, fails):
    picture = image()
    picture.reshape(-1, 3)[:broken] = np.inf
    accumulator = Accumulator()
    accumulator.add(picture)
    if fails:
        with pytest.raises(RenderError, match="NaN or"):
            accumulator.mean()
    else:
        assert accumulator.mean().shape == picture.shape


def test_no_pass_is_an_error():
    with pytest.raises(RenderError, match="no pass"):
        Accumulator().mean()


def test_cap_keeps_the_hue_and_spares_lamps():
    picture = image(0.5, SHAPE)
    picture[0, 0] = picture[0, 1] = (80, 40, 20)
    exempt = np.zeros(SHAPE[:2], dtype=bool)
    exempt[0, 1] = True
    accumulator = Accumulator(exempt)
    accumulator.add(*capped(picture, 8.0))
    mean = accumulator.mean()
    np.testing.assert_allclose(mean[0, 0], [8, 4, 2], rtol=1e-6)
    np.testing.assert_allclose(mean[0, 1], [80, 40, 20])
    np.testing.assert_allclose(mean[1:], 0.5)
    tally = accumulator.tally
    assert tally.capped == pytest.approx(140 - 14)
    assert tally.capped_share == pytest.approx(126 / picture.sum())


def test_what_white_pixels_lose_is_not_dimming():
    """A glint stays white; a dark pixel that loses its only bright sample gets darker."""
    picture = image(0.1, SHAPE)
    picture[0, 0] = (80, 80, 80)
    accumulator = Accumulator(white=1.0)
    accumulator.add(*capped(picture, 8.0))
    assert accumulator.tally.capped == pytest.approx(216)
    assert accumulator.tally.dimmed == 0
    for _ in range(15):
        accumulator.add(*capped(image(0.1, SHAPE), 8.0))
    assert accumulator.tally.capped == accumulator.tally.dimmed == pytest.approx(216)
    # 216 of what that pixel and all others, with 0.1 in each channel and pass, would have had.
    rest = 0.3 * (16 * SHAPE[0] * SHAPE[1] - 1)
    assert accumulator.tally.dimmed_share == pytest.approx(216 / (240 + rest), rel=1e-5)


def test_no_more_is_capped_than_there_is():
    """Though single precision rounds what was taken up."""
    accumulator = Accumulator()
    for light in (2.0**18, 0.0, 1e6 / 3.0):
        accumulator.add(*capped(image(light, SHAPE), 0.015625))
    assert 0.99 < accumulator.tally.capped_share <= 1.0


def test_nothing_seen_is_nothing_capped():
    assert Accumulator().tally.capped_share == 0.0


RADIANCE = arrays(np.float32, SHAPE, elements=st.floats(0, 1e6, width=32, allow_subnormal=False))


@given(st.lists(RADIANCE, min_size=1, max_size=4), st.floats(0.01, 1e3))
def test_cap_laws(passes, limit):
    accumulator, plain = Accumulator(), Accumulator()
    for picture in passes:
        accumulator.add(*capped(picture, limit))
        plain.add(picture)
    mean, truth = accumulator.mean(), plain.mean()
    np.testing.assert_allclose(
        truth, np.mean(passes, axis=0, dtype=np.float64), rtol=1e-6, atol=1e-30
    )
    assert (mean <= limit * (1 + 1e-6)).all() and (mean <= truth * (1 + 1e-6) + 1e-30).all()
    assert plain.tally.capped == 0
    assert 0 <= accumulator.tally.capped_share <= 1
    lost = (truth.astype(float) - mean).sum() * len(passes)
    assert accumulator.tally.capped == pytest.approx(
        lost, rel=1e-3, abs=1e-3 * float(truth.sum()) + 1e-9
    )


@given(RADIANCE, st.floats(0.01, 1e3))
def test_hue_survives_the_cap(picture, limit):
    accumulator = Accumulator()
    accumulator.add(*capped(picture, limit))
    mean = accumulator.mean().astype(float)
    cross = np.cross(mean, picture.astype(float))
    size = np.linalg.norm(mean, axis=-1) * np.linalg.norm(picture.astype(float), axis=-1)
    assert (np.linalg.norm(cross, axis=-1) <= 1e-5 * size + 1e-12).all()


# Seeds -------------------------------------------------------------------------------------


def test_seeds_differ_by_film_and_frame():
    times = [n / 25 for n in range(500)] + [-0.04, -7.0, 1e5]
    seeds = [frame_seed(seed, time) for seed in (0, 1, 2**31 - 1) for time in times]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**32 for seed in seeds)


@given(st.integers(0, 2**31 - 1), st.floats(-1e6, 1e6))
def test_seed_is_a_pure_function_that_forgives_rounding(seed, time):
    time = round(time, 3)
    assert frame_seed(seed, time) == frame_seed(seed, time + 1e-9 * (1 if time < 1e4 else 0))


def test_seed_is_the_same_on_every_machine():
    assert frame_seed(7, 12.04) == 3947781329
