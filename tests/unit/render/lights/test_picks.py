"""How often paths aim at which lamp, by the place that is lit."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import FrameState, Lobe, View
from sumo3dviz_pt.model.weather import Weather
from sumo3dviz_pt.render.lights.emitter import WIDE, Glow, LampSizes, grid_corner, lobe_row

pytestmark = pytest.mark.usefixtures("compiled")

EYE = np.array([4.0, -7.0, 1.5])
UP = (0.0, 0.0, 1.0)


def glow_of(radiance, places, *, areas=None, lamps=None, axes=None, weight=1.0) -> Glow:
    count, units = len(radiance), len(places)
    return Glow(
        np.repeat(np.array(radiance, float)[:, None], 3, axis=1),
        np.tile(UP, (count, 1)) if axes is None else np.array(axes, float),
        np.tile(lobe_row(Lobe()), (count, 1)),
        np.ones(units) if areas is None else np.array(areas, float),
        np.arange(units) if lamps is None else np.array(lamps),
        np.array(places, float),
        weight,
    )


def frame_of(wetness: float) -> FrameState:
    matrix = np.eye(4)
    matrix[:3, 3] = EYE
    view = View(Transform(matrix), Lens.of_degrees(60.0))
    return FrameState(0.0, view, (), weather=Weather(wetness=wetness))


def picks_of(*glows: Glow, wetness: float = 0.0):
    from sumo3dviz_pt.render.lights.picks import LampPicks

    named = {str(k): glow for k, glow in enumerate(glows)}
    sizes = {k: LampSizes(len(g.radiance), len(g.areas), 1) for k, g in named.items()}
    picks = LampPicks(sizes, wet=wetness > 0.0)
    picks.follow(named, frame_of(wetness))
    return picks


def middles_of(glow: Glow) -> Floats:
    """Middles of columns and lines, (cells, 2) [m]."""
    cells = LampSizes(len(glow.radiance), len(glow.areas), 1).cells
    step = WIDE / cells
    return grid_corner(frame_of(0.0).view) + (np.arange(cells)[:, None] + 0.5) * step


def densities(picks, glow: Glow, number: int = 0) -> Floats:
    """What a kernel reads, (cells, cells, units)."""
    import mitsuba as mi

    origin = frame_of(0.0).origin
    middles, units = middles_of(glow) - origin[:2], len(glow.areas)
    y, x, u = np.meshgrid(
        middles[:, 1], middles[:, 0], (np.arange(units) + 0.5) / units, indexing="ij"
    )
    place = mi.Point3f(*(mi.Float(each.ravel().astype(np.float32)) for each in (x, y, 0.0 * x)))
    u = mi.Float(u.ravel().astype(np.float32))
    found = picks.density(mi.UInt32(number), u, place, mi.Bool(True))
    return np.array(found, float).reshape(x.shape)


def shares(picks, glow: Glow) -> Floats:
    """How often units are picked, (cells, cells, units)."""
    return densities(picks, glow) * glow.areas


def expected(glow: Glow, wetness: float) -> tuple[Floats, Floats]:
    """Shares and their sum in double precision, by NumPy."""
    middles = middles_of(glow)
    half = 0.5 * (middles[1, 0] - middles[0, 0])
    to = np.stack(np.meshgrid(*middles.T), axis=-1)[:, :, None] - glow.places[:, :2]
    away = (to**2).sum(axis=-1) + (half + 1.0) ** 2
    cosine = (to * glow.axes[glow.lamp_of_unit, :2]).sum(axis=-1) / np.sqrt(away)
    power = glow.power * (0.03 + np.clip(0.5 + 2.0 * cosine, 0.0, 1.0)) / away
    to_cell = np.stack(np.meshgrid(*middles.T), axis=-1)[:, :, None] - EYE[:2]
    to_lamp = glow.places[:, :2] - EYE[:2]
    along, near = (to_cell * to_lamp).sum(axis=-1), (to_cell**2).sum(axis=-1)
    aside = to_cell[..., 0] * to_lamp[:, 1] - to_cell[..., 1] * to_lamp[:, 0]
    both = 2.0 * (near - along) + (to_lamp**2).sum(axis=-1)
    mirrored = (along > near) / (aside**2 / (half**2 * both + 1e-6) + 1.0) ** 2
    power *= 1.0 + 100.0 * wetness * mirrored
    total = power.sum(axis=-1, keepdims=True)
    return power / total, total[..., 0]


def some_lamps(seed: int, count: int) -> Glow:
    rng = np.random.default_rng(seed)
    radiance = rng.exponential(size=count) ** 3 * (rng.random(count) < 0.6)
    places = np.column_stack([rng.uniform(-150.0, 250.0, (count, 2)), rng.uniform(0, 9, count)])
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    return glow_of(radiance, places, areas=rng.uniform(0.01, 0.5, count), axes=axes)


@pytest.mark.parametrize("wetness", [0.0, 0.7])
def test_units_are_picked_as_double_precision_says(wetness: float) -> None:
    import mitsuba as mi

    glows = some_lamps(1, 700), some_lamps(2, 40)
    picks = picks_of(*glows, wetness=wetness)
    for number, glow in enumerate(glows):
        share, total = expected(glow, wetness)
        found = densities(picks, glow, number) * glow.areas
        rtol = 1e-5 if wetness == 0.0 else 2e-5  # far from the line of a streak, it falls fast
        np.testing.assert_allclose(found, share, rtol=rtol, atol=1e-30)
        line, column = (mi.UInt32(each.ravel()) for each in np.indices(total.shape, np.uint32))
        of = len(total)
        given = picks.given(mi.UInt32(number), column, line, of=of, active=mi.Bool(True))
        np.testing.assert_allclose(np.array(given).reshape(of, of), total, rtol=rtol)


@pytest.mark.parametrize("wetness", [0.0, 1.0])
@pytest.mark.parametrize("at", [(10.0, -3.0), (150.0, 80.0), (-500.0, 0.0)])
def test_units_are_picked_by_their_density(at: tuple[float, float], wetness: float) -> None:
    import drjit as dr
    import mitsuba as mi

    glow, count = some_lamps(3, 60), 400_000
    picks = picks_of(glow, wetness=wetness)
    place, sample = mi.Point3f(*at, 0.0), (dr.arange(mi.Float, count) + 0.5) / count
    picked = picks.pick(mi.UInt32(0), place, sample, mi.Bool(True))
    face, left = np.array(picked.face), np.array(picked.left)
    said = picks.density(mi.UInt32(0), (mi.Float(picked.face) + 0.5) / 60, place, mi.Bool(True))
    np.testing.assert_allclose(np.array(picked.density), np.array(said), rtol=1e-6)
    found = np.bincount(face, minlength=60) / count
    share = np.zeros(60)
    share[face] = np.array(said) * glow.areas[face]
    np.testing.assert_allclose(found, share, atol=1e-5)
    assert left.min() >= 0.0 and left.max() <= 1.0
    assert left[face == found.argmax()].mean() == pytest.approx(0.5, abs=1e-3)
    assert (glow.radiance[face] > 0.0).all()


@pytest.mark.parametrize("radiance", [(1.0, 1.0), (3.0, 0.5), (0.0, 2.0)])
def test_lamps_side_by_side_are_picked_by_their_power(radiance) -> None:
    glow = glow_of(radiance, np.zeros((3, 3)), areas=(1.0, 1.0, 2.0), lamps=(0, 1, 1))
    found = shares(picks_of(glow), glow)
    both = np.stack([found[..., 0], found[..., 1:].sum(axis=-1)], axis=-1)
    wanted = np.array(radiance) * [1.0, 3.0] / (radiance[0] + 3.0 * radiance[1])
    np.testing.assert_allclose(both, np.broadcast_to(wanted, both.shape), atol=1e-6)


def test_what_lies_behind_a_lamp_is_rarely_lit_by_it_but_may_be() -> None:
    places, axes = [(64.0, -7.0, 0.7), (64.5, -7.0, 0.7)], [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]
    back_to_back = glow_of((1.0, 1.0), places, axes=axes)
    cells = shares(picks_of(back_to_back), back_to_back)[..., 0]
    assert cells[32, 0] > 0.9 and cells[32, -1] < 0.1 and (cells > 0.0).all()


def test_wet_ground_before_a_lamp_mirrors_it_and_so_aims_at_it() -> None:
    """Each of two far lamps is picked on the way from the eye to it."""
    glow = glow_of((1.0, 1.0), EYE + np.array([[90.0, 0.0, 0.0], [0.0, 90.0, 6.0]]))
    before, cells, moist = (
        shares(picks_of(glow, wetness=wetness), glow)[..., 0] for wetness in (0.0, 1.0, 0.1)
    )
    column, line = ((EYE[:2] - grid_corner(frame_of(0.0).view)) / (WIDE / 64)).astype(int)
    assert (cells[line, column + 4 : column + 28] > 0.9).all()
    assert (cells[line + 4 : line + 28, column] < 0.1).all()
    assert (before[line, column + 4 : column + 12] < 0.8).all()
    ahead = cells[line, column + 4 : column + 12], moist[line, column + 4 : column + 12]
    assert (ahead[0] > ahead[1]).all()
    # Nothing is mirrored behind the eye.
    np.testing.assert_allclose(cells[0, 0], before[0, 0], rtol=1e-6)


@pytest.mark.parametrize("glow", [glow_of((0.0, 0.0), np.zeros((2, 3))), some_lamps(1, 9)])
def test_dark_lamps_and_those_that_are_only_seen_have_no_density(glow: Glow) -> None:
    import mitsuba as mi

    glow = glow_of(glow.radiance[:, 0], glow.places, weight=0.0)
    picks = picks_of(glow, some_lamps(2, 5))
    assert not densities(picks, glow).any()
    picked = picks.pick(mi.UInt32(0), mi.Point3f(0.0), mi.Float([0.0, 0.5]), mi.Bool(True))
    assert not np.array(picked.density).any()
