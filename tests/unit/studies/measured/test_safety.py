"""Flashes, red flashes and signal colours of pictures whose answers are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.studies.measured.safety import (
    APART,
    FlashMeter,
    SignalColours,
    chromaticity,
    colour_difference,
    flashes_too_often,
    seen_with,
    size_row,
)

SIZE = (48, 27)
RATE = 24


def code(light):
    """The sRGB code of a relative luminance."""
    value = 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055
    return round(255.0 * value)


def measured(pictures, *, pixels=10.0, rate=RATE):
    meter = FlashMeter(SIZE, rate, pixels)
    for picture in pictures:
        meter.add(picture)
    return meter.result()


def filled(colour, part=(slice(None), slice(None)), beside=(0, 0, 0)):
    picture = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
    picture[...] = beside
    picture[part] = colour
    return picture


def square_wave(hertz, low, high, *, seconds=3, part=(slice(None), slice(None)), beside=0):
    """Frames that change from low to high and back so many times a second, in codes."""
    for n in range(seconds * RATE):
        on = int(2 * hertz * n / RATE) % 2
        yield filled([high if on else low] * 3, part, [beside] * 3)


@pytest.mark.parametrize(("hertz", "bad"), [(1, False), (3, False), (4, True), (12, True)])
def test_three_flashes_in_a_second_are_the_most(hertz, bad):
    found = measured(square_wave(hertz, 0, 255))
    assert found["flash_rate"] == hertz
    assert bool(flashes_too_often(found)) == bad
    assert found["flash_area"] == (1.0 if bad else 0.0)


@pytest.mark.parametrize(
    ("low", "high", "flashes"),
    [
        (code(0.5), code(0.62), True),
        (code(0.5), code(0.58), False),  # less than a tenth
        (code(0.85), code(1.0), False),  # both are bright
        (code(0.75), code(0.9), True),
    ],
)
def test_a_flash_is_a_tenth_of_which_one_side_is_dark(low, high, flashes):
    assert (measured(square_wave(6, low, high))["flash_rate"] > 0.0) == flashes


def test_small_places_flash_as_they_like():
    """A field of 10 pixels has 81 of them: a quarter is 20."""
    for side, bad in ((4, False), (5, True)):
        part = (slice(5, 5 + side), slice(5, 5 + side))
        found = measured(square_wave(6, 0, 255, part=part))
        assert (found["flash_rate"] > 3.0) == bad
        assert found["flash_area"] == pytest.approx(side**2 / 81, abs=0.002)
    # Of a film that fills a small part of the field, even all of it is little.
    assert measured(square_wave(6, 0, 255), pixels=100.0)["flash_rate"] == 0.0


def test_slow_changes_and_steps_one_way_are_no_flashes():
    fade = [filled([code(light)] * 3) for light in np.linspace(0.0, 1.0, 3 * RATE)]
    assert measured(fade)["flash_rate"] == 0.5
    assert measured([filled([0] * 3)] * 10)["flash_rate"] == 0.0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=48), st.floats(0.0, 0.04))
def test_small_noise_adds_no_flashes(levels, noise):
    """Changes below half a tenth neither make flashes nor break one in two."""
    clean = [light if k % 2 else levels[max(k - 1, 0)] for k, light in enumerate(levels)]
    pictures = [filled([code(light)] * 3) for light in clean]
    rate = measured(pictures)["flash_rate"]
    assert rate <= len(clean) / 2
    quiet = [filled([code(0.5 + noise * (-1) ** k)] * 3) for k in range(20)]
    assert measured(quiet)["flash_rate"] == 0.0


@pytest.mark.parametrize(
    ("one", "other", "flashes"),
    [
        ((255, 0, 0), (0, 0, 255), True),
        ((255, 0, 0), (0, 0, 0), True),
        ((128, 0, 0), (128, 128, 128), True),
        ((255, 0, 0), (200, 0, 0), False),  # both red
        ((200, 150, 150), (0, 0, 255), False),  # no saturated red
    ],
)
def test_red_flashes_go_into_or_out_of_a_saturated_red(one, other, flashes):
    pictures = [filled(one if n % 4 < 2 else other) for n in range(2 * RATE)]
    found = measured(pictures)
    assert (found["red_flash_rate"] > 3.0) == flashes
    assert ("red flashes" in flashes_too_often(found)) == flashes


def test_chromaticity_of_primaries():
    np.testing.assert_allclose(chromaticity(np.array([1.0, 0, 0])), (0.4507, 0.5229), atol=2e-3)
    np.testing.assert_allclose(chromaticity(np.ones(3)), (0.1978, 0.4683), atol=2e-3)
    assert APART == 0.2


def test_red_and_green_are_alike_for_who_lacks_a_cone():
    red, green = np.array([0.8, 0.05, 0.02]), np.array([0.12, 0.45, 0.02])
    normal = colour_difference(red, green, "normal")
    for vision in ("protanopia", "deuteranopia"):
        assert colour_difference(red, green, vision) < normal / 2.0
        grey = np.full(3, 0.4)
        np.testing.assert_allclose(seen_with(grey, vision), grey, atol=0.01)
    # Long waves are dark to who lacks their cone.
    dim = [float(seen_with(red, vision) @ (0.2126, 0.7152, 0.0722)) for vision in
           ("protanopia", "deuteranopia")]  # fmt: skip
    assert dim[0] < dim[1]


def test_lenses_that_shine_are_told_apart_and_the_unseen_have_no_difference():
    colours = SignalColours()
    picture = filled((40, 40, 40))
    flat = picture.reshape(-1, 3)
    flat[[3, 4]], flat[[60, 61]] = (180, 40, 30), (60, 230, 120)
    colours.add(picture, {"red": np.array([3, 4]), "green": np.array([60, 61])})
    colours.add(picture, {"yellow": np.array([], dtype=np.int64)})
    found = colours.differences()
    alone = colour_difference(
        *(np.array([linear_from_srgb(code / 255) for code in one])
          for one in ((180, 40, 30), (60, 230, 120))), "normal",
    )  # fmt: skip
    assert found["red_green_normal"] == pytest.approx(alone) and alone > 60.0
    assert found["red_green_normal"] > 2.0 * found["red_green_deuteranopia"] > 0.0
    assert np.isnan(found["red_yellow_normal"]) and len(found) == 9


def test_sizes_and_times(tmp_path):
    (tmp_path / "a.mp4").write_bytes(bytes(2_500_000))
    row = size_row([tmp_path / "a.mp4"], (5.0, 100.0))
    assert row == {"megabytes": 2.5, "load_5": 4.0, "load_100": 0.2}
