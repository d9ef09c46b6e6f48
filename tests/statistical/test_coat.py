"""Varnished paint: what it gives back, how it darkens along it, how sharp its mirror is."""

import numpy as np
import pytest

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.paints import EUROPEAN, flop_of
from sumo3dviz_pt.render.backend import choose_backend

pytestmark = pytest.mark.slow

SAMPLES = 200_000
COSINES = (1.0, 0.8, 0.5, 0.3, 0.15, 0.05)
SILVER = (0.430, 0.440, 0.450)


@pytest.fixture(scope="module", autouse=True)
def compiled():
    choose_backend("llvm")


def finish_of(colour, flop, cosine):
    """The kernel's material at a point of a varnished paint, seen from some angle."""
    import mitsuba as mi

    from sumo3dviz_pt.render.kernel.lobes import VARNISH, Finish, Lobes
    from sumo3dviz_pt.render.paint import effect

    paint = MATERIALS["paint"]
    shown, metallic = effect(mi.Color3f(*colour), mi.Float(0.0), mi.Float(cosine), mi.Float(flop))
    numbers = {"through": 0.0, "glossy": 1.0, "coat": 1.0, "eta": VARNISH}
    numbers |= {"roughness": paint["under_roughness"], "coat_roughness": paint["roughness"]}
    flags = dict.fromkeys(("matt", "open", "mirror"), mi.Bool(False))
    return Finish(
        Lobes(coats=True, metals=True),
        colour=shown,
        metallic=metallic,
        **{name: mi.Float(value) for name, value in numbers.items()},
        **flags,
    )


def given_back(colour, flop, cosine):
    """Share of an even sky's light that a paint sends back, and its standard error."""
    import mitsuba as mi

    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(3, SAMPLES)
    wi = mi.Vector3f(float(np.sqrt(1.0 - cosine**2)), 0.0, cosine)
    finish = finish_of(colour, flop, cosine)
    bounce = finish.bounce(wi, sampler.next_1d(), sampler.next_2d())
    weights = np.array(bounce.weight[1]).astype(float) * np.ones(SAMPLES)
    return weights.mean(), weights.std() / np.sqrt(SAMPLES)


@pytest.mark.parametrize("flop", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("cosine", COSINES)
def test_no_paint_gives_back_more_than_falls_on_it(flop, cosine):
    mean, error = given_back((0.85,) * 3, flop, cosine)
    assert mean <= 1.0 + 4 * error


@pytest.mark.parametrize("cosine", COSINES)
def test_black_paint_mirrors_what_the_law_of_fresnel_says(cosine):
    root = np.sqrt(1.0 - (1.0 - cosine**2) / 1.5**2)
    s, p = (
        (cosine - 1.5 * root) / (cosine + 1.5 * root),
        (1.5 * cosine - root) / (1.5 * cosine + root),
    )
    mean, error = given_back((0.0,) * 3, 0.0, cosine)
    assert mean == pytest.approx(0.5 * (s * s + p * p), abs=4 * error + 2e-3)


def test_silver_is_two_and_a_half_times_as_bright_from_ahead_as_from_60_degrees():
    """Its paint alone: what a black varnish mirrors is taken off."""
    ahead, aside = (
        given_back(SILVER, flop_of(SILVER), cosine)[0] - given_back((0.0,) * 3, 0.0, cosine)[0]
        for cosine in (1.0, 0.5)
    )
    assert ahead / aside == pytest.approx(2.5, rel=0.1)


def test_the_edge_of_a_cloud_in_a_flat_bonnet_is_a_few_pixels_wide():
    """From a tenth to nine tenths of it, in a picture of 960 px and 52 degrees."""
    import mitsuba as mi

    finish = finish_of((0.0,) * 3, 0.0, 1.0)
    across = np.linspace(-0.02, 0.02, 1001)
    x, y = (axis.ravel().astype(np.float32) for axis in np.meshgrid(across, across))
    wo = mi.Vector3f(mi.Float(x), mi.Float(y), mi.Float(np.sqrt(1.0 - x * x - y * y)))
    light = np.array(finish.respond(mi.Vector3f(0.0, 0.0, 1.0), wo).value[1]).reshape(1001, 1001)
    edge = np.cumsum(light.sum(axis=0)) / light.sum()
    wide = np.ptp(across[(edge > 0.1) & (edge < 0.9)])
    assert wide < 3 * np.radians(52.0) / 960


def test_more_than_half_of_all_cars_have_effect_paints():
    shares = dict(zip(EUROPEAN.colours, EUROPEAN.shares, strict=True))
    glitter = sum(share for colour, share in shares.items() if flop_of(colour) > 0.0)
    assert 0.55 < glitter / sum(shares.values()) < 0.75
