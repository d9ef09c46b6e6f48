"""Homes, shops, blocks and buildings over footprints."""

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.library.buildings import palettes
from sumo3dviz_pt.library.buildings.building import FOUNDATION, Walls, raised, rectangle
from sumo3dviz_pt.library.buildings.facade import (
    CLASSES,
    FAR,
    MIDDLE,
    NEAR,
    PROUD,
    Facade,
    storey,
    wall,
    windows,
)
from sumo3dviz_pt.library.buildings.palettes import SHOPS as SHOP_LIGHTS
from sumo3dviz_pt.library.buildings.palettes import SIGNS, WINDOWS, lit_roles, palette
from sumo3dviz_pt.library.buildings.roofs import (
    EAVES,
    GableRidge,
    gable_roof,
    hip_roof,
    inset,
    is_convex,
)
from sumo3dviz_pt.library.buildings.shell import box, paint, stood_up, upright_uvs
from sumo3dviz_pt.library.buildings.sign_boards import Boards, blade_signs
from sumo3dviz_pt.library.buildings.styles import (
    BLOCKS,
    HOMES,
    ROWS,
    SHOPS,
    SUITING,
    cleaned,
    extruded,
    footprint_of,
    style_for,
)
from sumo3dviz_pt.model.layers import LUMINANCE

MOST = {"homes": (1900, 360, 130), "shops": (960, 390, 90), "blocks": (8900, 2200, 560)}
EVERY = [
    pytest.param(style, seed, MOST[kind], id=f"{kind}-{name}-{seed}")
    for kind, styles in (("homes", HOMES), ("shops", SHOPS), ("blocks", BLOCKS))
    for name, style in styles.items()
    for seed in range(style.variants)
]
ONE_EACH = [
    pytest.param(style, id=f"{name}")
    for styles in (HOMES, SHOPS, BLOCKS)
    for name, style in styles.items()
]
L_SHAPE = np.array([(0, 0), (14, 0), (14, 6), (6, 6), (6, 12), (0, 12)], float)
PANES = ("room", "bare", "shop")


def parts_of(style, seed, level, **how):
    return paint(style.build(seed, level), palette(style.colours, np.random.default_rng(1), **how))


def normals_of(quads):
    return np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])


def count(parts):
    return sum(len(part.mesh.faces) for part in parts)


def panes_of(shell, *words):
    some = [quads for role, quads in shell.items() if role.rstrip("0123456789") in words]
    return np.concatenate(some) if some else np.zeros((0, 4, 3))


def triangles_of(shell, without=()):
    quads = np.concatenate([quads for role, quads in shell.items() if role not in without])
    flat = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    area = np.linalg.norm(np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]), axis=1)
    return flat[area > 1e-8]


def first_hits(triangles, origins, directions):
    """Cosine between each ray and the normal of what it hits first; nan for misses.

    References: Moeller and Trumbore (1997).
    """
    a, e, f = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(e, f)
    found = []
    for origin, direction in zip(origins, directions, strict=True):
        p = np.cross(direction, f)
        det = (e * p).sum(1)
        det[np.abs(det) < 1e-12] = np.nan
        s = origin - a
        u = (s * p).sum(1) / det
        q = np.cross(s, e)
        v = (q @ direction) / det
        t = (f * q).sum(1) / det
        t = np.where((u > 1e-9) & (v > 1e-9) & (u + v < 1 - 1e-9) & (t > 0), t, np.inf)
        k = int(np.argmin(t))
        found.append(normal[k] @ direction if np.isfinite(t[k]) else np.nan)
    return np.array(found)


@pytest.mark.parametrize(("style", "seed", "most"), EVERY)
def test_budgets_foundations_and_colours(style, seed, most):
    for level in (NEAR, MIDDLE, FAR):
        parts = parts_of(style, seed, level)
        assert count(parts) <= most[level]
        points = np.concatenate([part.mesh.vertices for part in parts])
        assert points[:, 2].min() == FOUNDATION
        assert np.isfinite(points).all()
        for part in parts:
            assert part.tint is None or ((part.tint > 0) & (part.tint <= 0.85)).all()
            a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
            assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9).all()


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize("style", ONE_EACH)
def test_whoever_looks_at_a_building_sees_fronts_of_faces_and_no_gaps(style, level):
    shell = style.build(2, level)
    # Bars of balconies are flat and shown from the street alone.
    triangles = triangles_of(shell, without=("rail",))
    rng = np.random.default_rng(5)
    top = triangles[..., 2].max()
    aims = np.column_stack([rng.uniform(-3, 3, (60, 2)), rng.uniform(0.3, 0.6 * top, 60)])
    angle = rng.uniform(0, 2 * np.pi, 60)
    eyes = np.column_stack([60 * np.cos(angle), 60 * np.sin(angle), rng.uniform(1, 50, 60)])
    cosine = first_hits(triangles, eyes, aims - eyes)
    assert np.isfinite(cosine).all()
    assert (cosine < 0).mean() > 0.98


@pytest.mark.parametrize("style", ONE_EACH)
def test_levels_of_detail_have_one_shape_and_the_same_windows(style):
    shells = [style.build(1, level) for level in (NEAR, MIDDLE, FAR)]
    tops = [max(quads[..., 2].max() for quads in shell.values()) for shell in shells]
    assert tops[0] == pytest.approx(tops[1], abs=0.6)
    assert tops[0] == pytest.approx(tops[2], abs=1.8)
    for role in ("wall", "plinth"):
        lows = [shell[role][..., :2].min(axis=(0, 1)) for shell in shells]
        assert np.abs(lows[0] - lows[1]).max() < 0.15
        assert np.abs(lows[0] - lows[2]).max() < 0.15
    near, middle = (panes_of(shell, "room") for shell in shells[:2])
    assert len(near) == len(middle)
    if len(near):
        assert np.abs(near.mean(axis=1) - middle.mean(axis=1)).max() < 0.5


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize("style", ONE_EACH)
def test_panes_look_outwards_and_lie_within_the_walls(style, level):
    shell = style.build(3, level)
    panes = panes_of(shell, *PANES)
    flat = panes.mean(axis=1) * [1, 1, 0]
    assert ((normals_of(panes) * flat).sum(axis=1) > 0).mean() > 0.97
    walls = np.concatenate([shell[role] for role in ("wall", "base", "roof") if role in shell])
    low, high = walls.min(axis=(0, 1)), walls.max(axis=(0, 1))
    out = np.array([PROUD + 0.02, PROUD + 0.02, 0.0])
    assert (panes >= low - out).all()
    assert (panes <= high + out).all()


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize("row", ROWS)
def test_no_two_faces_share_a_place_on_a_wall_to_a_neighbour(row, level):
    """Which of two such faces is seen hangs on last bits: gables flickered below their cornices."""
    plan, walls = rectangle(11.0, 14.0), Walls((0,), (1, 3))
    for design in row.style.designs:
        shell = raised(plan, design, height=17.0, level=level, seed=3, walls=walls)
        quads = np.concatenate(list(shell.values()))
        on_wall = (np.abs(quads[..., 1] - 7.0) < 1e-6).all(axis=1)
        faces = shapely.make_valid(shapely.polygons(quads[on_wall][..., [0, 2]]))
        faces = faces[shapely.area(faces) > 1e-6]
        covered = shapely.area(shapely.unary_union(faces))
        assert covered > 11.0 * 16.0
        assert shapely.area(faces).sum() == pytest.approx(covered, rel=1e-6)


@pytest.mark.slow
def test_every_role_of_every_shell_has_a_colour():
    every = {style for some in SUITING.values() for style in some} | {row.style for row in ROWS}
    every |= {style for styles in (HOMES, SHOPS, BLOCKS) for style in styles.values()}
    for style in every:
        for dark in (False, True):
            colours = palette(style.colours, np.random.default_rng(0), dark=dark)
            for seed in range(style.variants):
                assert set(style.build(seed, NEAR)) <= set(colours)


def test_panes_of_a_facade_tilt_by_millimetres():
    facade = Facade(drapes=0.0, ajar=0.0)
    openings = np.concatenate([facade.openings(30.0, 3.0 * i) for i in range(20)])
    panes = panes_of(windows(openings, facade, level=NEAR, rng=np.random.default_rng(1)), "bare")
    off = panes[..., 1] - facade.inset
    assert 0.001 < off.std() < 0.01
    # Still plane: both diagonals meet.
    assert np.abs(off[:, 0] + off[:, 2] - off[:, 1] - off[:, 3]).max() < 1e-12


def test_blinds_and_rooms_fill_each_pane_once():
    facade = Facade(drapes=1.0)
    openings = facade.openings(60.0, 0.0)
    for level in (NEAR, MIDDLE, FAR):
        shell = windows(openings, facade, level=level, rng=np.random.default_rng(3))
        area = np.linalg.norm(normals_of(panes_of(shell, *PANES)), axis=1).sum() / 2
        each = facade.width * facade.height
        assert area == pytest.approx(len(openings) * each, rel=1e-3)


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize("length", [0.5, 1.4, 2.0, 4.0, 16.0])
def test_a_wall_covers_its_face_once(level, length):
    facade = Facade()
    floors = np.array([0.0, 3.0, 6.0])
    made = wall(length, floors, facade, level=level, rng=np.random.default_rng(0))
    area = np.linalg.norm(normals_of(panes_of(made, "wall", "wall_below")), axis=1).sum() / 2
    openings = facade.openings(length, 0.0)
    hole = 2 * len(openings) * facade.width * facade.height if level == NEAR else 0.0
    assert area + hole == pytest.approx(6.0 * length)
    assert len(openings) == 0 or length >= 1.5


@pytest.mark.parametrize("width", [0.0, 1.3])
@pytest.mark.parametrize("length", [1.5, 3.3, 9.7, 41.0])
def test_windows_keep_apart_and_within_their_wall(width, length):
    openings = Facade(width=width).openings(length, 3.0)
    u0, u1, z0, z1 = openings.T
    assert (u0 > 0).all()
    assert (u1 < length).all()
    assert (u1 > u0).all()
    assert (u0[1:] >= u1[:-1] - 1e-9).all()
    assert (z1 > z0).all()


def test_a_storey_without_openings_is_one_wall():
    quads = storey(5.0, 0.0, 3.0, np.zeros((0, 4)))["wall"]
    assert quads.shape == (1, 4, 3)


def test_boxes_are_closed_and_look_outwards():
    quads = box((-1, -2, -3), (1, 2, 3), skip="")
    assert len(quads) == 6
    assert ((normals_of(quads) * quads.mean(axis=1)).sum(axis=1) > 0).all()


def test_walls_stand_between_their_points_with_the_outside_right():
    placed = stood_up(
        storey(4.0, 0, 3, np.zeros((0, 4))), np.array([1.0, 1.0]), np.array([5.0, 1.0])
    )["wall"]
    assert placed[0, :, 0].tolist() == [1.0, 5.0, 5.0, 1.0]
    assert (normals_of(placed)[0] * [0, -1, 0]).sum() > 0


def test_variants_and_colours_differ_and_are_the_same_again():
    style = BLOCKS["plaster"]
    heights = {style.build(seed, FAR)["wall"][..., 2].max() for seed in range(style.variants)}
    walls = {
        palette(style.colours, np.random.default_rng(seed), textured=False)["wall"]
        for seed in range(8)
    }
    assert len(heights) > 3
    assert len(walls) > 4
    given = palette(style.colours, np.random.default_rng(0), (0.1, 0.2, 0.3))
    assert given["wall"] == ("wall", (0.1, 0.2, 0.3))
    one, other = style.build(3, NEAR), style.build(3, NEAR)
    assert all(np.array_equal(quads, other[role]) for role, quads in one.items())


def test_rooms_are_lit_at_night_only_and_differently_by_use():
    style = BLOCKS["plaster"]
    by_day = {material for material, _ in palette(style.colours, np.random.default_rng(1)).values()}
    assert not by_day & {WINDOWS, SHOP_LIGHTS}
    shares, means = {}, {}
    for use in ("home", "office"):
        lit = [lit_roles(use, SIGNS[:2], np.random.default_rng(seed)) for seed in range(60)]
        rooms = [r[f"room{k}"][1] for r in lit for k in range(CLASSES) if f"room{k}" in r]
        shares[use] = len(rooms) / (60 * CLASSES)
        means[use] = np.median(np.array(rooms) @ [0.2126, 0.7152, 0.0722])
    assert 0.3 < shares["home"] < 0.4
    # 100 lx on what reflects a half; offices' panes are tinted and their walls less lit.
    assert 4 < means["home"] < 10 < means["office"] < 20


def test_signs_shine_within_the_limits_of_cie_150():
    for seed in range(40):
        lit = lit_roles("shop", SIGNS[:3], np.random.default_rng(seed))
        for role, (material, colour) in lit.items():
            if role.startswith("sign"):
                assert material == SHOP_LIGHTS
                assert 8 < np.array(colour) @ [0.2126, 0.7152, 0.0722] <= 400


@pytest.mark.parametrize("level", [NEAR, MIDDLE, FAR])
@pytest.mark.parametrize(
    ("plan", "height"),
    [
        (L_SHAPE, 9.0),
        (np.array([(0, 0), (10, 0), (10, 8), (0, 8.0)]), 6.0),
        (np.array([(0, 0), (4, 0), (4, 3), (0, 3.0)]), 2.6),
        (L_SHAPE * 3, 15.0),
        (L_SHAPE * 3, 45.0),
        (np.array([(0, 0), (45, 0), (45, 40), (0, 40.0)]), 8.0),
    ],
)
def test_extruded_buildings_keep_to_their_footprint(plan, height, level):
    for share in (0.0, 0.35, 0.7, 0.95):
        style = style_for(plan, height, share=share)
        shell = extruded(plan, height, level=level, seed=1, style=style)
        walls = np.concatenate([shell[role] for role in ("wall", "base") if role in shell])
        assert (walls[..., :2].min(axis=(0, 1)) >= plan.min(axis=0) - 0.05).all()
        assert (walls[..., :2].max(axis=(0, 1)) <= plan.max(axis=0) + 0.05).all()
        top = max(quads[..., 2].max() for quads in shell.values())
        assert height < top < height + 9.5
        roof = shell.get("roof", shell.get("deck"))
        assert (normals_of(roof)[:, 2] > 0).all()


@pytest.mark.parametrize(
    ("size", "height", "expected"),
    [
        ((4, 5), 2.6, "shed"),
        ((10, 9), 3.5, "low_house"),
        ((10, 9), 6.0, "house"),
        ((20, 8), 6.0, "long_house"),
        ((20, 20), 6.0, "wide"),
        ((50, 40), 6.0, "large"),
        ((20, 12), 15.0, "block"),
        ((50, 12), 15.0, "long_block"),
        ((50, 12), 30.0, "tower"),
    ],
)
def test_footprints_are_told_apart_by_size_shape_and_height(size, height, expected):
    plan = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * np.array(size, float)
    assert footprint_of(plan, height) == expected
    assert style_for(plan, height, share=0.0) == SUITING[expected][0]


@pytest.mark.parametrize("pitch", [0.2, 0.8])
@pytest.mark.parametrize("plan", [L_SHAPE, L_SHAPE[[0, 1, 2, 5]], L_SHAPE[[0, 1, 5]]])
def test_gabled_roofs_cover_their_plan_and_meet_their_walls(plan, pitch):
    ridge = GableRidge(np.array([1.0, 0.2]))
    roof = gable_roof(plan, 5.0, pitch=pitch, ridge=ridge, level=MIDDLE)
    slopes = roof["roof"]
    flat = np.linalg.norm(normals_of(slopes * [1, 1, 0]), axis=1).sum() / 2
    wide = shapely.Polygon(plan).buffer(EAVES, join_style="mitre", mitre_limit=1.5).area
    assert flat == pytest.approx(wide, rel=1e-6)
    assert (normals_of(slopes)[:, 2] > 0).all()
    assert roof["wall"][..., 2].min() == 5.0
    assert slopes[..., 2].max() == pytest.approx(roof["wall"][..., 2].max() + 0.16)


def test_hipped_roofs_cover_a_convex_plan():
    plan = np.array([(0, 0), (12, 1), (13, 8), (5, 10), (-1, 7.0)])
    assert is_convex(plan)
    assert not is_convex(L_SHAPE)
    slopes = hip_roof(plan, 5.0, pitch=0.6, level=MIDDLE)["roof"]
    flat = np.linalg.norm(normals_of(slopes * [1, 1, 0]), axis=1).sum() / 2
    wide = shapely.Polygon(plan).buffer(EAVES, join_style="mitre").area
    assert flat == pytest.approx(wide, rel=1e-6)


def test_plans_move_inwards_or_say_that_they_cannot():
    moved = inset(L_SHAPE, 1.0)
    assert shapely.Polygon(moved).area == pytest.approx(12 * 4 + 4 * 6)
    assert inset(L_SHAPE, 3.5) is None
    assert inset(np.array([(0, 0), (20, 0), (0, 0.5)]), 0.1) is None


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


@pytest.mark.parametrize(
    "shape", [np.zeros((5, 2)), L_SHAPE[:2], L_SHAPE * 0.1, L_SHAPE * [10, 0.02]]
)
def test_outlines_without_area_are_nothing(shape):
    assert cleaned(shape) is None


def test_courses_of_neighbouring_walls_fit_together():
    quads = np.concatenate([*storey(6.0, 0.0, 3.0, np.array([[2.0, 3.0, 1.0, 2.0]])).values()])
    placed = stood_up({"wall": quads}, np.array([3.0, -1.0]), np.array([9.0, -1.0]))["wall"]
    uvs = upright_uvs(placed, tile=2.0)
    along, height = placed[..., 0].ravel() / 2, placed[..., 2].ravel() / 2
    assert np.ptp(np.abs(uvs[..., 0].ravel()) - along) == pytest.approx(0.0, abs=1e-9)
    assert uvs[..., 1].ravel() == pytest.approx(height)


def test_triangles_have_texture_coordinates_whichever_corner_is_double():
    corners = np.array([(0, 0, 5), (0, 0, 5), (4, 0, 5), (2, 0, 8)], float)
    assert np.isfinite(upright_uvs(corners[None], tile=2.0)).all()


def test_some_sashes_are_tipped_and_close_to_what_is_behind():
    facade = Facade(drapes=0.0)
    openings = np.concatenate([facade.openings(30.0, 3.0 * i) for i in range(20)])
    shell = windows(openings, facade, level=NEAR, rng=np.random.default_rng(1))
    tops = panes_of(shell, "bare")[:, 2:, 1].mean(axis=1) - facade.inset
    tipped = tops > 0.05
    assert 0.02 < tipped.mean() < 0.15 and tops.max() < 0.15
    behind = shell["gap"][..., 1].min(axis=1) > facade.inset + 0.12
    assert behind.sum() == tipped.sum(), "a dark room closes the gap over each"
    deepest = shell["reveal"][..., 1].max()
    assert deepest > shell["gap"][..., 1].max(), "and the reveal reaches it"


def test_shutters_vary_and_stay_on_their_side():
    facade = Facade(shutters=True, width=1.2, bay=3.1)
    openings = np.concatenate([facade.openings(60.0, 3.0 * i) for i in range(10)])
    rng = np.random.default_rng(4)
    boards = windows(openings, facade, level=NEAR, rng=rng)["shutter"]
    reach = boards[..., 1].min()
    assert -0.6 < reach < -0.3, "some leaves stand off the wall"
    middles = boards.mean(axis=1)
    inside = [(o[0] < middles[:, 0]) & (middles[:, 0] < o[1]) for o in openings]
    shut = np.any([at & (np.abs(middles[:, 2] - o[2:].mean()) < 1.2)
                   for at, o in zip(inside, openings, strict=True)], axis=0)  # fmt: skip
    assert 0.08 < shut.mean() < 0.35, "some are shut, most are not"
    faces = np.cross(boards[:, 1] - boards[:, 0], boards[:, 3] - boards[:, 0])[:, 1]
    front = len(boards) * 4 // 5
    assert (faces < 0.0).sum() == front, "boards and rails face the street, backs the wall"


def test_signs_that_stick_out_carry_a_mark_on_both_faces():
    rng = np.random.default_rng(2)
    shells = [blade_signs(30.0, 4.0, Boards(), level=NEAR, rng=rng) for _ in range(6)]
    for shell in shells:
        for number in range(3):
            if f"sign{number}" not in shell:
                continue
            face, marks = shell[f"sign{number}"], shell[f"letter{number}"]
            normal = np.cross(marks[:, 1] - marks[:, 0], marks[:, 3] - marks[:, 0])[:, 0]
            assert (normal > 0).sum() == (normal < 0).sum() > 0
            low, high = face.reshape(-1, 3).min(axis=0), face.reshape(-1, 3).max(axis=0)
            flat = marks.reshape(-1, 3)
            assert (flat[:, 1:] > low[1:]).all() and (flat[:, 1:] < high[1:]).all()
    assert any("letter0" in shell for shell in shells)


def test_nothing_painted_on_a_front_glows():
    for name in ("signs", "awnings"):
        for colour in getattr(palettes._ACCENTS, name):
            luminance = float(np.dot(colour, LUMINANCE))
            spread = max(colour) - min(colour)
            assert luminance < 0.55 and spread < 0.32, "faded paint, not pure colours"
