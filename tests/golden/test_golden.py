"""Examples look as they did: a test of chance against stored pictures, never one of bytes."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from pictures import DATA, PICTURES, SIZE, WINDOW, differs, excess, stored, stored_of


@pytest.mark.slow
@pytest.mark.parametrize("name", PICTURES)
def test_looks_as_it_did(name):
    picture, old = PICTURES[name], stored(name)
    with picture.taken() as take:
        found = differs(take, old)
        assert not found.any(), f"{found.sum()} windows differ: {places(found)}"
        if picture.small is not None:
            lost = differs(take, old, without=picture.small)
            assert lost.any(), f"nobody misses {picture.small}"
            assert lost.sum() <= MOST_WINDOWS, "that was no small one"


MOST_WINDOWS = 24
"""Windows that see something of an object of some 20 pixels, and of its shadow."""


def places(found):
    """Column and row of the pixels where the first windows that differ begin."""
    return [(2 * int(column), 2 * int(row)) for row, column in np.argwhere(found)[:5]]


@pytest.mark.parametrize("name", PICTURES)
def test_what_is_stored_is_small_and_whole(name):
    assert (DATA / f"{name}.npz").stat().st_size < 60_000
    old = stored(name)
    assert old.mean.shape == (SIZE[1] // 2, SIZE[0] // 2, 3) and old.runs >= 12
    assert np.isfinite(old.mean).all() and np.isfinite(old.variance).all()
    assert 0.02 < old.mean.mean() < 0.98 and old.mean.std() > 0.02


# The comparison itself, of pictures that are made by chance ---------------------------------


@cache
def noisy(seed, *, objects=()):
    """A run of a picture with edges, textures and noise; objects are (left, top, grey)."""
    width, height = SIZE
    rng = np.random.default_rng(seed)
    across = np.linspace(0.2, 0.7, width)[None, :, None]
    picture = np.repeat(np.repeat(across, height, axis=0), 3, axis=2)
    picture[height // 2 :] *= 0.5
    for left, top, grey in objects:
        picture[top : top + 4, left : left + 5] = grey
    return np.clip(picture + rng.normal(0.0, 0.05, picture.shape), 0.0, 1.0)


@pytest.fixture(scope="module")
def made():
    """The stored picture of one in which an object of 20 pixels stands, for each place."""
    return cache(lambda place: stored_of([noisy(n, objects=(place,)) for n in range(100, 112)]))


PLACES = [(60 + dx, 20 + dy, 0.6) for dx in range(2) for dy in range(2)] + [
    (0, 0, 0.5),
    (187, 104, 0.6),
]


@pytest.mark.parametrize("place", PLACES)
def test_an_object_of_twenty_pixels_cannot_vanish(made, place):
    found = differs(lambda seed, without: noisy(seed), made(place))
    rows, columns = np.nonzero(found)
    assert len(rows) > 0
    near = np.hypot(2 * columns - place[0], 2 * rows - place[1])
    assert near.max() <= 2 * WINDOW + 4, "windows elsewhere are as they were"


@pytest.mark.parametrize("place", PLACES)
def test_an_object_that_moves_by_its_width_is_seen(made, place):
    left, top, grey = place
    other = (left + 5 if left < 100 else left - 5, top, grey)
    assert differs(lambda seed, without: noisy(seed, objects=(other,)), made(place)).any()


def test_other_noise_makes_no_other_picture(made):
    """Forty runs of other seeds, each of 15,105 comparisons."""
    old = made(PLACES[0])
    worst = [excess(noisy(seed, objects=(PLACES[0],)), old).max() for seed in range(40)]
    assert max(worst) <= 0.0


def test_one_bright_sample_makes_no_other_picture(made):
    def take(seed, without):
        picture = noisy(seed, objects=(PLACES[0],)).copy()
        picture[30 + 7 * seed, 90] = 1.0
        return picture

    old = made(PLACES[0])
    assert not differs(take, old).any()
