"""How bright drops are by sky and lamps."""

import numpy as np
import pytest
from raining import falling_at

from sumo3dviz_pt.model.falling import Glows, SkyLight, Throws
from sumo3dviz_pt.render.falling.light import CLEAR, even_light, lit, phase, phase_table

DARK = SkyLight((0.0, 0.0, 0.0))


def test_a_ball_of_water_scatters_all_light_once():
    cosine = np.linspace(-1.0, 1.0, 20_001)
    total = 2.0 * np.pi * np.trapezoid(phase(cosine), cosine)
    assert total == pytest.approx(0.99, abs=0.015)
    assert (phase_table() >= 0.0).all()


def test_light_goes_mostly_on_and_the_rainbow_is_bright():
    forward = float(phase(np.cos(np.radians(np.arange(0.0, 65.0)))).min())
    assert forward > 5.0 * float(phase(np.array(np.cos(np.radians(100.0)))))
    bow, gap = (float(phase(np.array(np.cos(np.radians(180.0 - a))))) for a in (41.0, 50.0))
    assert bow > 5.0 * gap


def test_even_light_is_a_mean_of_sky_and_ground():
    light = SkyLight((1.0, 2.0, 3.0))
    level = even_light(np.array([0.0]), light, 0.2, flakes=False)[0]
    np.testing.assert_allclose(level, CLEAR * 0.6 * np.array([1.0, 2.0, 3.0]))
    down, up = even_light(np.array([-1.0, 1.0]), light, 0.2, flakes=False)[:, 0]
    assert up == pytest.approx(CLEAR) and down == pytest.approx(0.2 * CLEAR)


def lamp(at, axis, intensity=1.0):
    return Glows(
        np.array([at]), np.array([axis]), np.full((1, 3), intensity), np.array([[1.0, 0.0]])
    )


def test_lamps_light_flakes_by_the_square_of_distance():
    eye = np.array([0.0, 0.0, 0.0])
    places = np.array([[5.0, 0.0, 2.0], [5.0, 0.0, 0.0]])
    falling = falling_at(glows=lamp((5.0, 0.0, 4.0), (0.0, 0.0, -1.0)))
    near, far = lit(places, falling, DARK, eye=eye, flakes=True)[:, 0]
    assert near / far == pytest.approx(4.0, rel=0.05)
    assert far == pytest.approx(0.95 / (4.0 * np.pi) / 16.0, rel=0.01)
    behind = lit(np.array([[5.0, 0.0, 6.0]]), falling, DARK, eye=eye, flakes=True)
    assert behind.max() == 0.0


def test_drops_before_a_lamp_glow_more_than_drops_lit_from_behind_the_eye():
    eye = np.zeros(3)
    place = np.array([[5.0, 0.0, 0.0]])
    before = falling_at(glows=lamp((10.0, 0.5, 0.0), (-1.0, 0.0, 0.0)))
    behind = falling_at(glows=lamp((0.0, 0.5, 0.0), (1.0, 0.0, 0.0)))
    one, other = (lit(place, f, DARK, eye=eye, flakes=False).max() for f in (before, behind))
    assert one > 10.0 * other > 0.0


def test_head_lamps_throw_light_where_their_pattern_says():
    pattern = np.zeros((8, 8))
    pattern[4:, :] = 1.0  # below the middle
    throws = Throws(np.eye(4)[None], np.ones((1, 3)), pattern, 1.0)
    falling = falling_at(throws=throws)
    places = np.array([[5.0, 0.0, -1.0], [5.0, 0.0, 1.0], [-5.0, 0.0, -1.0], [5.0, 6.0, -1.0]])
    found = lit(places, falling, DARK, eye=np.array([-3.0, 0.0, 0.0]), flakes=True)[:, 0]
    assert found[0] == pytest.approx(0.95 / (4.0 * np.pi) / 26.0, rel=0.01)
    assert found[1:].max() == 0.0
