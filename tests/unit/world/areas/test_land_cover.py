"""Land covers: what types mean, which area is on top, and how areas lie on the ground."""

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.library.mesh.planar import grid_faces
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.areas.covers import AS_IS, Area, Pool, areas_of, land_covers, water_parts
from sumo3dviz_pt.world.areas.drape import GroundFaces, without
from sumo3dviz_pt.world.areas.patterns import drawn_on
from sumo3dviz_pt.world.areas.planting import _hashed, built_up, houses_of
from sumo3dviz_pt.world.placement.surroundings import Tile

COVERS = land_covers()


def square(name, type_, x0, y0, size, *, layer=None, fill=True):
    shape = np.array([(x0, y0), (x0 + size, y0), (x0 + size, y0 + size), (x0, y0 + size)])
    params = {} if layer is None else {"layer": str(layer)}
    return Polygon(name, type_, shape.astype(float), fill, None, "a.add.xml", params)


def hilly():
    """Ground that no plane fits, in cells of 10 m."""
    x, y = np.arange(-50.0, 160.0, 10.0), np.arange(-50.0, 160.0, 10.0)
    z = 2.0 * np.sin(x / 17.0)[None, :] + 1.5 * np.cos(y / 23.0)[:, None]
    xx, yy = np.meshgrid(x, y)
    return Mesh(np.stack([xx, yy, z], axis=-1).reshape(-1, 3), grid_faces(*z.shape))


def area_of(mesh: Mesh) -> float:
    """In plan [m2]."""
    a, b, c = (mesh.vertices[mesh.faces[:, k], :2] for k in range(3))
    u, v = b - a, c - a
    return float(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum() / 2.0)


# Types -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("type_", "cover"),
    [
        ("natural.water", "water"),
        ("waterway.stream", "water"),
        ("water", "water"),
        ("natural.wood", "wood"),
        ("landuse.forest", "wood"),
        ("forest", "wood"),
        ("landuse.grass", "lawn"),
        ("landuse.meadow", "meadow"),
        ("landuse.farmland", "field"),
        ("landuse.farm", "field"),
        ("farm", "field"),
        ("landuse.residential", "built_up"),
        ("landuse.commercial", AS_IS),
        ("landuse.industrial", "yard"),
        ("landuse.railway", "railway"),
        ("landuse.cemetery", "cemetery"),
        ("landuse.allotments", "garden"),
        ("landuse.construction", "soil"),
        ("leisure.park", "park"),
        ("park", "park"),
        ("leisure.pitch", "pitch"),
        ("leisure.playground", "sand"),
        ("leisure.garden", "garden"),
        ("leisure.golf_course", "lawn"),
        ("amenity.parking", "parking"),
        ("parking", "parking"),
        ("amenity.school", AS_IS),
        ("power", AS_IS),
        ("railway", AS_IS),
        ("highway.pedestrian", "square"),
        ("place=square", "square"),
        ("aeroway.apron", "airfield"),
    ],
)
def test_types_of_sumo_and_openstreetmap_have_a_cover(type_, cover):
    row = COVERS.row_of(type_)
    assert row is not None and row.cover == cover


def test_every_row_names_a_cover_and_no_row_hides_another():
    assert {row.cover for row in COVERS.types} <= set(COVERS.covers)
    for number, row in enumerate(COVERS.types):
        word = row.type.replace("*", "")
        first = COVERS.row_of(word)
        assert first is not None
        assert COVERS.types.index(first) == number, f"{row.type} is hidden by {first.type}"


def test_types_that_polyconvert_writes_are_known():
    names = "water natural bay strait forest land landuse park residential commercial industrial"
    names += " military farm harbour tourism sport leisure aeroway aerialway services kindergarten"
    names += " school college university clinic graveyard shop historic man_made pipeline amenity"
    names += " parking barrier power highway boundary admin_level railway railway.position inner"
    assert [name for name in names.split() if COVERS.row_of(name) is None] == []


def test_unknown_types_are_named_once():
    items = [square(f"u{k}", "moon.crater", 0, 0, 5) for k in range(3)]
    found = areas_of([*items, square("w", "water", 20, 0, 5)], COVERS, seed=1)
    assert [area.cover for area in found.all] == ["water"]
    assert [out.what for out in found.left_out] == ["3 polygons of type 'moon.crater'"]


def test_buildings_trees_and_fences_are_no_areas():
    words = ("building", "building.house", "fence", "hedge", "tree", "homes")
    found = areas_of([square(w, w, 0, 0, 9) for w in words], COVERS, seed=1)
    assert found.all == () and found.left_out == ()


def test_streams_are_as_wide_as_the_table_says_and_other_lines_cover_nothing():
    line = np.array([(0.0, 0.0), (100.0, 0.0)])
    lines = [
        Polygon("s", "waterway.river", line, False, None, "a"),
        Polygon("g", "landuse.grass", line, False, None, "a"),
        Polygon("r", "aeroway", line, False, None, "a"),
    ]
    found = {area.cover: area for area in areas_of(lines, COVERS, seed=1).all}
    assert set(found) == {"water", "airfield"}
    assert np.ptp(found["water"].shape.bounds[1::2]) == pytest.approx(12.0)


# Order -------------------------------------------------------------------------------------


def visible(items):
    areas = areas_of(items, COVERS, seed=1)
    return {a.id.split(":")[1]: areas.visible(a, ()).area for a in areas.all}


def test_higher_layers_hide_lower_ones_whatever_their_order():
    low, high = square("low", "forest", 0, 0, 10, layer=-3), square("h", "park", 5, 0, 10, layer=-2)
    for items in ([low, high], [high, low]):
        assert visible(items) == pytest.approx({"low": 50.0, "h": 100.0})


def test_within_a_layer_the_later_one_is_on_top():
    one, two = square("a", "forest", 0, 0, 10), square("b", "park", 5, 0, 10)
    assert visible([one, two]) == pytest.approx({"a": 50.0, "b": 100.0})
    assert visible([two, one]) == pytest.approx({"a": 100.0, "b": 50.0})


def test_a_pond_in_a_wood_stays_on_top_of_it():
    wood, pond = square("wood", "forest", 0, 0, 10), square("pond", "water", 3, 3, 2)
    assert visible([pond, wood]) == pytest.approx({"wood": 96.0, "pond": 4.0})


def test_nothing_lies_on_what_is_paved():
    areas = areas_of([square("f", "landuse.farmland", 0, 0, 100)], COVERS, seed=1)
    road = shapely.box(-10, 40, 110, 47)
    shape = areas.visible(areas.all[0], [road])
    assert shape.intersection(road).area == pytest.approx(0.0, abs=1e-6)
    assert shape.area == pytest.approx(9300.0)


# On the ground -----------------------------------------------------------------------------


def test_areas_follow_every_triangle_of_the_ground():
    ground = GroundFaces.of([hilly()])
    shape = shapely.Point(40, 50).buffer(37.0).difference(shapely.Point(50, 50).buffer(9.0))
    mesh = ground.draped([shape], lift=0.5).mesh
    assert area_of(mesh) == pytest.approx(shape.area, rel=1e-6)
    spots = mesh.vertices[mesh.faces].mean(axis=1)
    face = ground.tree.query(shapely.points(spots[:, :2]), predicate="intersects")
    home = dict(zip(*(side.tolist() for side in face), strict=True))
    index = np.array([home[k] for k in range(len(spots))])
    shares = ground.shares(index, spots[:, :2])
    below = (shares * ground.corners[index, :, 2]).sum(axis=1)
    assert spots[:, 2] - below == pytest.approx(0.5, abs=1e-6)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()


def test_a_hole_leaves_the_rest_of_the_ground_where_it_was():
    ground = hilly()
    hole = shapely.box(12.0, 13.0, 61.0, 47.0)
    cut = without(ground, hole)
    assert area_of(cut.mesh) == pytest.approx(area_of(ground) - hole.area, rel=1e-9)
    assert len(cut.sources) == len(cut.mesh.faces)
    old = GroundFaces.of([ground])
    spots = cut.mesh.vertices[cut.mesh.faces].mean(axis=1)
    shares = old.shares(cut.sources, spots[:, :2])
    assert (shares > -1e-9).all()
    assert (shares * old.corners[cut.sources, :, 2]).sum(axis=1) == pytest.approx(spots[:, 2])
    assert without(ground, shapely.Polygon()).mesh is ground


def test_still_water_is_level_and_lies_in_a_bank():
    shape = shapely.Point(0, 0).buffer(20.0)
    surface, bank = water_parts(
        Pool("p", shape),
        COVERS.water,
        height_at=lambda places: 0.02 * places[:, 0],
        near=(0.0, 0.0),
    )
    levels = surface.mesh.vertices[:, 2]
    assert np.ptp(levels) < 1e-9 and levels[0] == pytest.approx(-0.4 - COVERS.water.depth, abs=1e-6)
    assert bank.mesh.vertices[:, 2].max() == pytest.approx(0.41, abs=1e-3)
    assert bank.mesh.vertices[:, 2].min() < levels[0]


# On areas ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pattern", "size"), [("bays", 40.0), ("pitch", 80.0), ("court", 24.0), ("tramlines", 90.0),
                          ("vines", 40.0), ("paths", 90.0), ("graves", 40.0)]
)  # fmt: skip
def test_what_is_drawn_stays_on_its_area(pattern, size):
    shape = shapely.affinity.rotate(shapely.box(0, 0, 1.4 * size, size), 31.0)
    found = drawn_on(pattern, Area("x", "park", shape), shape, seed=3)
    assert found
    for some in found:
        for one in some.shapes:
            assert shapely.covers(shape.buffer(1e-4), one)
    again = drawn_on(pattern, Area("x", "park", shape), shape, seed=3)
    assert [one.shapes for one in again] == [one.shapes for one in found]


def test_bays_are_of_their_real_size():
    shape = shapely.box(0, 0, 50, 17)
    (lines,) = drawn_on("bays", Area("x", "parking", shape), shape, seed=1)
    left = sorted({round(float(one.centroid.x), 2) for one in lines.shapes})
    assert np.diff(left) == pytest.approx(2.5, abs=0.02)
    assert len(left) == 20


def test_places_of_plants_are_spread_evenly_and_depend_on_nothing_else():
    cells = np.stack(np.meshgrid(np.arange(-40, 40), np.arange(-40, 40)), -1).reshape(-1, 2)
    one = _hashed(cells, 14)
    assert np.array_equal(one[::-1], _hashed(cells[::-1], 14))
    assert one.mean() == pytest.approx(0.5, abs=0.02) and one.std() == pytest.approx(
        0.289, abs=0.02
    )
    assert abs(np.corrcoef(one[:-1], one[1:])[0, 1]) < 0.05


# Between houses ----------------------------------------------------------------------------


def test_gaps_between_fronts_and_sidewalks_are_paved_and_the_rest_is_lawn():
    tile = Tile(250.0, 0, 0)
    x, y = tile.middle
    road = shapely.box(x - 80, y - 5, x + 80, y + 5)
    houses = [square(f"h{k}", "building", x - 40 + 20 * k, y + 8, 12) for k in range(4)]
    houses += [square("far", "building", x, y - 40, 12)]
    found = built_up(tile, houses_of(houses), paved=[road], covered=[])
    assert found is not None
    front = shapely.box(x - 38, y + 5.2, x - 30, y + 7.8)
    assert found.pavement.contains(front)
    assert found.pavement.intersection(shapely.box(x - 5, y - 30, x + 20, y - 5.5)).area < 1e-6
    behind = shapely.Point(x + 6, y - 40 - 0.3)
    assert found.apron.contains(behind) and found.lawn.contains(shapely.Point(x + 6, y - 44))
    whole = [found.pavement, found.apron, found.lawn, road, *houses_of(houses).shapes]
    overlap = sum(shape.area for shape in whole) - shapely.union_all(whole).area
    assert overlap == pytest.approx(0.0, abs=1e-4)
    assert built_up(Tile(250.0, 9, 9), houses_of(houses), paved=[road], covered=[]) is None
