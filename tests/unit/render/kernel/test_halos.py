"""Angles at which halos look for the light of a lamp."""

import numpy as np
import pytest

from sumo3dviz_pt.model.weather import ASYMMETRY

pytestmark = pytest.mark.usefixtures("compiled")


def scattered(angle: np.ndarray) -> np.ndarray:
    """Henyey and Greenstein's phase function where light comes from an angle along a ray."""
    cosine = np.cos(angle + 0.5 * np.pi)
    return (1.0 - ASYMMETRY**2) / (1.0 + ASYMMETRY**2 - 2.0 * ASYMMETRY * cosine) ** 1.5


def picked(first: float, last: float, *, faces: bool) -> tuple[np.ndarray, np.ndarray]:
    """Pick many angles, evenly over all chances."""
    import mitsuba as mi

    from sumo3dviz_pt.render.kernel.halos import _picked_angle

    chances = (np.arange(200_000) + 0.5) / 200_000
    found = _picked_angle(mi.Float(first), mi.Float(last), mi.Bool(faces), mi.Float(chances))
    angle, density = (np.array(each, np.float64) for each in found)
    return angle, density


SPANS = [(-1.55, 1.5), (-1.3, 0.4), (-0.6, 1.5), (0.1, 1.2), (1.56, 1.57), (-1.57, -1.5)]


@pytest.mark.parametrize(("first", "last"), SPANS)
@pytest.mark.parametrize("faces", [True, False])
def test_angles_are_picked_by_their_density(first: float, last: float, faces: bool) -> None:
    angle, density = picked(first, last, faces=faces)
    assert (angle >= first - 1e-6).all() and (angle <= last + 1e-6).all()
    assert np.isfinite(density).all() and (density > 0.0).all()
    steps = first + (last - first) * (np.arange(100_000) + 0.5) / 100_000
    for light in (np.ones_like, scattered):
        expected = light(steps).mean() * (last - first)
        assert (light(angle) / density).mean() == pytest.approx(expected, rel=0.01)


def test_looking_past_a_lamp_that_faces_the_eye_makes_little_noise() -> None:
    """Where it does not, light comes from where it shines, and all angles are as likely."""
    spreads = {}
    for faces in (True, False):
        angle, density = picked(-1.5, 1.5, faces=faces)
        values = scattered(angle) / density
        spreads[faces] = values.std() / values.mean()
    assert spreads[True] < 0.4 * spreads[False]


def test_a_lamp_beside_the_eye_is_looked_for_evenly() -> None:
    _, density = picked(0.0, 1.4, faces=True)
    assert density == pytest.approx(1 / 1.4, rel=1e-5)


def test_droplets_scatter_forwards_and_lose_nothing() -> None:
    """The phase function is one over all directions; its mean cosine is the asymmetry."""
    import mitsuba as mi

    from sumo3dviz_pt.render.kernel.air import phase

    cosine, weight = np.polynomial.legendre.leggauss(400)
    found = np.array(phase(mi.Float(cosine.astype(np.float32))))
    assert 2.0 * np.pi * np.sum(weight * found) == pytest.approx(1.0, rel=1e-3)
    assert 2.0 * np.pi * np.sum(weight * cosine * found) == pytest.approx(ASYMMETRY, rel=1e-3)
