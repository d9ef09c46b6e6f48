"""Homes, shops, blocks and buildings over footprints."""

import numpy as np
import pytest

from sumo3dviz_pt.shapes.building_styles import BLOCKS, HOMES, SHOPS, palette
from sumo3dviz_pt.shapes.buildings import FOUNDATION
from sumo3dviz_pt.shapes.facade import FAR, MIDDLE, NEAR, Facade, storey, wall, windows
from sumo3dviz_pt.shapes.footprint import cleaned, extruded
from sumo3dviz_pt.shapes.shell import box, paint, stood_up, upright_uvs

STYLES = [
    (style, seed, most)
    for styles, most in ((HOMES, 1500), (SHOPS, 1000), (BLOCKS, 6500))
    for style in styles.values()
    for seed in range(style.variants)
]
L_SHAPE = np.array([(0, 0), (14, 0), (14, 6), (6, 6), (6, 12), (0, 12)], float)


def parts_of(style, seed, level):
    return paint(style.build(seed, level), palette(style, np.random.default_rng(seed)))


def normals_of(quads):
    return np.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 0])


def count(parts):
    return sum(len(part.mesh.faces) for part in parts)


@pytest.mark.parametrize(("style", "seed", "most"), STYLES)
def test_budgets_and_foundations(style, seed, most):
    near, middle, far = (parts_of(style, seed, level) for level in (NEAR, MIDDLE, FAR))
    assert count(near) <= most
    assert count(middle) < 0.5 * count(near)
    assert count(far) <= 330
    for parts in (near, middle, far):
        points = np.concatenate([part.mesh.vertices for part in parts])
        assert points[:, 2].min() == FOUNDATION
        assert np.isfinite(points).all()
        for part in parts:
            assert part.tint is None or (part.tint <= 0.85).all()


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize("styles", [HOMES, SHOPS, BLOCKS])
def test_walls_and_windows_look_outwards(styles, level):
    shell = next(iter(styles.values())).build(3, level)
    panes = shell["window"] if "window" in shell else shell["band"]
    middle = panes.mean(axis=1) * [1, 1, 0]
    assert ((normals_of(panes) * middle).sum(axis=1) > 0).all()


def test_panes_of_a_facade_tilt_by_millimetres():
    facade = Facade()
    openings = np.concatenate([facade.openings(30.0, 3.0 * i) for i in range(20)])
    panes = windows(openings, facade, level=NEAR, rng=np.random.default_rng(1))["window"]
    off = panes[..., 1] - facade.inset
    assert 0.001 < off.std() < 0.01
    # Still plane: both diagonals meet.
    assert np.abs(off[:, 0] + off[:, 2] - off[:, 1] - off[:, 3]).max() < 1e-12


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize("length", [0.5, 2.0, 4.0, 16.0])
def test_a_wall_covers_its_face_once(level, length):
    facade = Facade()
    made = wall(
        length, np.array([0.0, 3.0, 6.0]), facade, level=level, rng=np.random.default_rng(0)
    )
    flush = [made.get("wall"), made.get("band"), None if level == NEAR else made.get("window")]
    area = sum(
        np.linalg.norm(normals_of(quads), axis=1).sum() for quads in flush if quads is not None
    )
    hole = 0.0
    if level == NEAR:
        openings = facade.openings(length, 0.0)
        hole = 2 * len(openings) * facade.width * facade.height
    assert area + hole == pytest.approx(6.0 * length)


def test_a_storey_without_openings_is_one_wall():
    quads = storey(5.0, 0.0, 3.0, np.zeros((0, 4)))
    assert quads.shape == (1, 4, 3)


def test_boxes_are_closed_and_look_outwards():
    quads = box((-1, -2, -3), (1, 2, 3), skip="")
    assert len(quads) == 6
    assert ((normals_of(quads) * quads.mean(axis=1)).sum(axis=1) > 0).all()


def test_walls_stand_between_their_points_with_the_outside_right():
    placed = stood_up(
        {"wall": storey(4.0, 0, 3, np.zeros((0, 4)))}, np.array([1.0, 1.0]), np.array([5.0, 1.0])
    )["wall"]
    assert placed[0, :, 0].tolist() == [1.0, 5.0, 5.0, 1.0]
    assert (normals_of(placed)[0] * [0, -1, 0]).sum() > 0


def test_variants_and_colours_differ():
    style = BLOCKS["plaster"]
    heights = {style.build(seed, FAR)["wall"][..., 2].max() for seed in range(style.variants)}
    walls = {palette(style, np.random.default_rng(seed))["wall"] for seed in range(8)}
    assert len(heights) > 3
    assert len(walls) > 4
    given = palette(style, np.random.default_rng(0), (0.1, 0.2, 0.3))
    assert given["wall"] == ("wall", (0.1, 0.2, 0.3))


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize(
    ("plan", "height"),
    [
        (L_SHAPE, 9.0),
        (np.array([(0, 0), (10, 0), (10, 8), (0, 8.0)]), 6.0),
        (np.array([(0, 0), (4, 0), (4, 3), (0, 3.0)]), 2.6),
        (L_SHAPE * 3, 15.0),
    ],
)
def test_extruded_buildings_keep_to_their_footprint(plan, height, level):
    shell = extruded(plan, height, level=level, seed=1)
    walls = shell["wall"]
    assert (walls[..., :2].min(axis=(0, 1)) >= plan.min(axis=0) - 0.05).all()
    assert (walls[..., :2].max(axis=(0, 1)) <= plan.max(axis=0) + 0.05).all()
    top = max(quads[..., 2].max() for quads in shell.values())
    assert height < top < height + 7.0
    roof = shell.get("roof", shell.get("deck"))
    assert (normals_of(roof)[:, 2] > 0).all()


def test_flat_roofs_cover_a_concave_plan():
    deck = extruded(L_SHAPE, 13.0, level=MIDDLE, seed=1)["deck"]
    area = np.linalg.norm(normals_of(deck), axis=1).sum() / 2
    assert area == pytest.approx(14 * 6 + 6 * 6)


@pytest.mark.parametrize(
    ("shape", "corners"),
    [
        (L_SHAPE[::-1], 6),
        (np.vstack([L_SHAPE, L_SHAPE[:1]]), 6),
        (np.array([(0, 0), (10, 10), (10, 0), (0, 10.0)]), 3),  # a bow tie: its larger half
    ],
)
def test_outlines_become_counter_clockwise(shape, corners):
    plan = cleaned(shape)
    x, y = plan.T
    assert len(plan) == corners
    assert (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() > 0


@pytest.mark.parametrize("shape", [np.zeros((5, 2)), L_SHAPE[:2], L_SHAPE * 0.1])
def test_outlines_without_area_are_nothing(shape):
    assert cleaned(shape) is None


def test_courses_of_neighbouring_walls_fit_together():
    quads = storey(6.0, 0.0, 3.0, np.array([[2.0, 3.0, 1.0, 2.0]]))
    placed = stood_up({"wall": quads}, np.array([3.0, -1.0]), np.array([9.0, -1.0]))["wall"]
    uvs = upright_uvs(placed, tile=2.0)
    along, height = placed[..., 0].ravel() / 2, placed[..., 2].ravel() / 2
    assert np.ptp(np.abs(uvs[..., 0].ravel()) - along) == pytest.approx(0.0, abs=1e-9)
    assert uvs[..., 1].ravel() == pytest.approx(height)


@pytest.mark.parametrize(("style", "seed", "most"), STYLES)
def test_levels_of_detail_have_one_shape(style, seed, most):
    shells = [style.build(seed, level) for level in (NEAR, MIDDLE, FAR)]
    tops = [max(quads[..., 2].max() for quads in shell.values()) for shell in shells]
    assert tops[0] == pytest.approx(tops[1], abs=0.3)
    # Chimneys and lifts are gone from afar.
    assert tops[0] == pytest.approx(tops[2], abs=2.6)
    assert ("rail" in shells[0]) == ("rail" in shells[1])
    for role in ("wall", "plinth"):
        lows = [shell[role][..., :2].min(axis=(0, 1)) for shell in shells]
        assert np.abs(lows[0] - lows[1]).max() < 1e-6 or role == "plinth"
        assert np.abs(lows[0] - lows[2]).max() < 1.2
