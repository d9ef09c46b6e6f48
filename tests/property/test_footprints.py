"""Buildings over any outline that a map may hold."""

import numpy as np
import pytest
import shapely
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.library.buildings.building import FOUNDATION
from sumo3dviz_pt.library.buildings.facade import FAR, MIDDLE, NEAR
from sumo3dviz_pt.library.buildings.palettes import palette
from sumo3dviz_pt.library.buildings.roofs import inset
from sumo3dviz_pt.library.buildings.shell import paint
from sumo3dviz_pt.library.buildings.styles import cleaned, extruded, style_for

HIGHEST_ROOF = 1.0  # of a gabled roof, times the plan's width
REACH = 2.0  # of steps, awnings, balconies and eaves [m]

PHASES = (Phase.explicit, Phase.generate)  # to shrink an outline takes minutes

coordinate = st.floats(-40.0, 40.0, allow_nan=False).map(lambda value: round(value, 2))
outlines = st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=12)


@st.composite
def stars(draw):
    """Outlines without crossings: concave, slender, with needles, either way round."""
    count = draw(st.integers(3, 14))
    radii = np.array(draw(st.lists(st.floats(1.5, 45.0), min_size=count, max_size=count)))
    angle = np.sort(draw(st.lists(st.floats(0.0, 6.28), min_size=count, max_size=count)))
    flat = draw(st.sampled_from([1.0, 0.3, 0.1]))
    ring = np.column_stack([radii * np.cos(angle), flat * radii * np.sin(angle)])
    return ring[::-1] if draw(st.booleans()) else ring


def built(shape, height, share, seed, level):
    plan = cleaned(np.asarray(shape, dtype=float))
    if plan is None:
        return None, None, None
    style = style_for(plan, height, share=share)
    return plan, style, extruded(plan, height, level=level, seed=seed, style=style)


# Sides that are next to level and not quite: the eaves' corner lay at infinity.
LEVEL = np.array(
    [[2.0, 0.0], [16.8, 0.0], [13.0, 1e-173], [2.5, 3e-38], [2.4, 0.1], [-7.5, 17.6], [-0.7, 1.3],
     [-1.0, 1.8], [0.0, -2.5]]
)  # fmt: skip


@settings(deadline=None, phases=PHASES, max_examples=tries(60))
@example(LEVEL, 2.0, 0.0, 0, NEAR)
@given(
    st.one_of(stars(), outlines),
    st.floats(2.0, 60.0),
    st.floats(0.0, 0.999),
    st.integers(0, 9),
    st.sampled_from([NEAR, MIDDLE, FAR]),
)
def test_any_outline_becomes_a_sound_building(shape, height, share, seed, level):
    plan, style, shell = built(shape, height, share, seed, level)
    if plan is None:
        return
    colours = palette(style.colours, np.random.default_rng(seed), textured=True, dark=True)
    tiles = {material: 3.0 for material, _ in colours.values() if material.startswith("cladding")}
    parts = paint(shell, colours, tiles=tiles)
    points = np.concatenate([part.mesh.vertices for part in parts])
    assert np.isfinite(points).all()
    assert points[:, 2].min() == FOUNDATION
    assert points[:, 2].max() > height
    low, high = plan.min(axis=0), plan.max(axis=0)
    assert points[:, 2].max() < height + 6.0 + HIGHEST_ROOF * np.ptp(plan, axis=0).max()
    assert (points[:, :2] > low - REACH).all()
    assert (points[:, :2] < high + REACH).all()
    for part in parts:
        a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
        assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9).all()
        assert part.mesh.uvs is None or np.isfinite(part.mesh.uvs).all()


@settings(deadline=None, phases=PHASES, max_examples=tries(40))
@given(stars(), st.floats(6.0, 30.0), st.floats(0.0, 0.999))
def test_walls_enclose_the_plan_and_look_outwards(shape, height, share):
    plan, _, shell = built(shape, height, share, 1, FAR)
    if plan is None:
        return
    walls = np.concatenate([shell[role] for role in ("wall", "base", "plinth") if role in shell])
    # Gauss: the area of a plan is half the flux of (x, y) through its walls, per height.
    normal = np.cross(walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]) / 2
    below = walls[..., 2].mean(axis=1) < 0.5 * FOUNDATION + 0.7
    foot = shell["plinth"]
    tall = np.ptp(foot[..., 2])
    flux = (normal[below] * walls[below].mean(axis=1)).sum(axis=1)
    sides = np.cross(foot[:, 2] - foot[:, 0], foot[:, 3] - foot[:, 1]) / 2
    enclosed = (sides * foot.mean(axis=1))[:, :2].sum() / 2 / tall
    assert enclosed == pytest.approx(shapely.Polygon(plan).area, rel=1e-6)
    assert len(flux)


@settings(deadline=None, phases=PHASES, max_examples=tries(60))
@given(stars(), st.floats(0.1, 3.0))
def test_moved_plans_lie_within(shape, distance):
    plan = cleaned(shape)
    if plan is None:
        return
    moved = inset(plan, distance)
    if moved is not None:
        inner, outer = shapely.Polygon(moved), shapely.Polygon(plan)
        assert outer.buffer(1e-6).covers(inner)
        assert inner.exterior.distance(outer.exterior) == pytest.approx(distance, abs=1e-6)
