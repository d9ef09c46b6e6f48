"""What is seen through panes of cars: seats and people with depth, and streets beyond them."""

import mitsuba as mi
import numpy as np
import pytest

from sumo3dviz_pt.model.cabins import Cabin, CabinSize, cabin_of

SIZE = CabinSize(rear=0.86, roof=0.48, half=0.8, cowl=1.2, tail=1.8)
CABIN = Cabin((-2.4, 0.95), SIZE)


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def seen(points, ways, *, use=0.5):
    """Colours behind panes, (n, 3), of a car that looks along +x."""
    from sumo3dviz_pt.render.cabins import cabin_frame, cabin_seen

    body = np.asarray(points) + np.array([-2.4, 0.0, 0.95])
    places = CABIN.places(body).astype(np.float32)
    ways = np.asarray(ways, dtype=np.float32)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    first, second = CABIN.numbers()
    numbers = mi.Vector2f(mi.Float([first]), mi.Float([second]))
    ahead = cabin_frame(numbers, None, mi.Bool(False))
    columns = [mi.Float(np.ascontiguousarray(c)) for c in ways.T]
    (colour,) = cabin_seen(
        mi.Vector3f(places.T), numbers, ahead, mi.Vector3f(*columns), mi.Float(use)
    )
    return np.array(colour).T


def test_numbers_tell_a_cabin_apart_and_stay_below_one():
    again = cabin_of(np.array([-2.4, 0.95, 0.86, 0.48, 0.8, 1.2, 1.8]))
    assert again.numbers() == CABIN.numbers()
    assert all(0.0 <= number < 1.0 for number in CABIN.numbers(yaw=-0.1, chance=0.99))
    assert CabinSize(0.0, 9.0, 0.0, 9.0, 0.0).packed < 1.0


def test_one_looks_through_a_car_over_its_seats_and_not_through_them():
    across = (0.02, -1.0, 0.0)
    colours = seen([(0.55, 0.75, 0.25), (-0.05, 0.75, -0.05)], [across, across], use=0.0)
    assert colours[0].mean() > 1.3 * colours[1].mean()


def test_who_drives_hides_what_lies_behind_and_parked_cars_are_empty():
    eye = [(0.12, 0.75, 0.24)]
    across = [(0.0, -1.0, 0.0)]
    assert np.abs(seen(eye, across, use=0.5) - seen(eye, across, use=0.0)).max() > 0.01


def test_seats_shift_against_the_frame_as_one_passes():
    points = [(x, 0.75, 0.05) for x in np.linspace(-0.6, 0.5, 40)]
    ahead, behind = seen(points, [(0.5, -1.0, 0.0)] * 40), seen(points, [(-0.5, -1.0, 0.0)] * 40)
    assert np.abs(ahead - behind).mean() > 0.003


def test_colours_are_reflectances():
    dice = np.random.default_rng(5)
    points = dice.uniform([-1.5, 0.6, 0.0], [1.0, 0.75, 0.4], (500, 3))
    ways = dice.normal(size=(500, 3)) * [1.0, 0.4, 0.4] - [0.0, 0.8, 0.0]
    colours = seen(points, ways)
    assert np.isfinite(colours).all()
    assert (colours > 0.0).all() and (colours <= 0.6).all()


def test_a_lamp_glitters_close_by_and_is_plain_from_afar():
    from sumo3dviz_pt.render.cabins import lens_seen

    place = np.zeros((400, 3), np.float32)
    place[:, 1:] = np.random.default_rng(3).uniform(-0.1, 0.1, (400, 2))
    way, out = mi.Vector3f(1.0, 0.0, 0.0), mi.Vector3f(-1.0, 0.0, 0.0)
    red = mi.Color3f(0.4, 0.01, 0.01)
    near, far = (
        np.array(lens_seen(mi.Vector3f(place.T), way, out, red, mi.Float(size))[0])
        for size in (0.001, 0.1)
    )
    assert near[0].std() > 0.1
    assert 0.25 < near[0].mean() < 0.55
    np.testing.assert_allclose(far[0], 0.4, rtol=1e-5)


def test_dirt_is_more_on_some_and_none_on_what_tells_none():
    from sumo3dviz_pt.render.paint import soiled

    own = np.random.default_rng(4).uniform(-2.0, 2.0, (300, 3)).astype(np.float32)

    def grime(uv, use):
        return np.array(soiled(mi.Point2f(*uv), mi.Vector3f(own.T), mi.Float(use))[0])

    clean, dirty = grime((0.5, -0.3), 0.1), grime((0.5, -0.3), 0.9)
    assert dirty.mean() > 2.5 * clean.mean()
    assert dirty.std() > 0.02
    assert grime((0.7, 0.4), 0.9).max() == 0.0
