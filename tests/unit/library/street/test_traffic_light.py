"""Heads, lenses, poles, and the figures that shine in them."""

import numpy as np
import pytest

from sumo3dviz_pt.library.street import traffic_light
from sumo3dviz_pt.library.street.traffic_light import (
    BARS,
    HOUSING,
    RADIUS,
    bars_of,
    border,
    bracket,
    crossbar,
    digit,
    hanger,
    housing,
    lens,
    mast,
    pole,
    walker,
    window,
)
from sumo3dviz_pt.model.geometry import merge_meshes


def areas(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


SOLID = {
    "housing": housing(3),
    "counter": housing(3, counter=True),
    "far": housing(2, level=1),
    "pole": pole(3.0),
    "mast": mast(5.5, 7.0),
    "right mast": mast(5.5, -7.0),
    "far mast": mast(5.5, 7.0, level=1),
    "bracket": bracket(3),
    "hanger": hanger(3, 1.0),
    "border": border(3),
    "lens": lens(1),
    "standing": walker(1, walking=False),
    "walking": walker(0, walking=True),
    "window": window(0),
    "digit": merge_meshes(digit(0, 3)),
}


@pytest.mark.parametrize("name", SOLID)
def test_faces_have_an_area_and_agree_with_their_normals(name):
    mesh = SOLID[name]
    flat = areas(mesh)
    assert np.linalg.norm(flat, axis=1).min() > 1e-9
    assert ((flat[:, None] * mesh.normals[mesh.faces]).sum(axis=2) > 0).mean() > 0.99
    assert np.isfinite(mesh.vertices).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_lenses_are_domed_discs_that_look_backwards(index):
    disc = lens(index)
    assert len(disc.faces) <= 32
    assert np.hypot(disc.vertices[:, 1], disc.vertices[:, 2] - HOUSING * (index + 0.5)).max() == (
        pytest.approx(RADIUS)
    )
    assert (areas(disc)[:, 0] < 0).all()
    assert (disc.normals[:, 0] < 0).all()
    assert -areas(disc)[:, 0].sum() == pytest.approx(np.pi * RADIUS**2, rel=0.03)


@pytest.mark.parametrize("lamps", [2, 3])
def test_lenses_lie_in_front_of_the_housing_under_hoods(lamps):
    body = housing(lamps)
    front = body.vertices[np.abs(body.vertices[:, 1]) < 0.12]
    assert lens(0).vertices[:, 0].max() < -0.1
    assert front[:, 0].min() < lens(0).vertices[:, 0].min() - 0.1, "hoods reach over the lenses"
    assert len(body.faces) < 1000
    assert len(housing(lamps, level=1).faces) < len(body.faces) / 3
    assert len(housing(lamps, backing=False).faces) < len(body.faces)


def test_a_counter_is_one_more_box():
    with_, without = (housing(3, counter=c, backing=False).bounds[1, 2] for c in (True, False))
    assert with_ - without == pytest.approx(HOUSING)


def test_poles_reach_into_the_ground_and_arms_over_the_road():
    assert pole(3.0).bounds[:, 2] == pytest.approx([-0.5, 3.0], abs=0.02)
    left, right = mast(5.5, 7.0), mast(5.5, -7.0)
    assert left.bounds[1, 1] == pytest.approx(7.0, abs=0.1)
    assert right.bounds[0, 1] == pytest.approx(-7.0, abs=0.1)
    assert left.bounds[0, 2] == pytest.approx(-0.5, abs=0.02)
    assert crossbar(1.2, 2.9).bounds[:, 1] == pytest.approx([-0.6, 0.6], abs=0.01)


@pytest.mark.parametrize("walking", [False, True])
def test_people_fit_their_lens_and_stand_before_it(walking):
    figure = walker(1, walking=walking)
    spots = figure.vertices - [0, 0, HOUSING * 1.5]
    assert np.hypot(spots[:, 1], spots[:, 2]).max() < RADIUS
    assert (figure.vertices[:, 0] < window(1).vertices[:, 0].min()).all()
    assert (areas(figure)[:, 0] < 0).all()


def test_digits_lie_in_the_box_and_each_sign_differs():
    for place in (0, 1):
        bars = digit(place, 3)
        assert len(bars) == len(BARS)
        spots = merge_meshes(bars).vertices
        assert spots[:, 2].min() > 3 * HOUSING and spots[:, 2].max() < 4 * HOUSING
        assert np.sign(spots[:, 1]).mean() == pytest.approx(1 - 2 * place, abs=0.2), "tens left"
    shown = {bars_of(number) for number in range(100)}
    assert len(shown) == 100
    assert len({traffic_light.SEGMENTS[d] for d in "0123456789"}) == 10


@pytest.mark.parametrize("number", [None, -1, 100])
def test_what_two_digits_cannot_show_stays_dark(number):
    assert bars_of(number) == frozenset()


def test_seven_and_leading_blanks():
    assert bars_of(7) == {(1, "a"), (1, "b"), (1, "c")}
    assert {bar for place, bar in bars_of(10) if place == 0} == {"b", "c"}
