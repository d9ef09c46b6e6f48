"""Static objects: which are chosen, where they stand, how detailed they are."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import ObjectSettings, ObjectsSettings
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.houses import height_of, street_walls
from sumo3dviz_pt.world.objects.kinds import KINDS, kind_of
from sumo3dviz_pt.world.objects.lines import guarded_sides
from sumo3dviz_pt.world.objects.objects import build_scenery
from sumo3dviz_pt.world.placement.lanes import build_lane_index, facing_roads
from sumo3dviz_pt.world.placement.surroundings import surroundings

CAR = frozenset({"passenger"})
OFF = {kind.name: None for kind in KINDS}


def road(z=0.0, empty=False):
    """A road from (0, 0) to (400, 0)."""
    if empty:
        return Network({}, {}, (), Location())
    shape = np.array([(0.0, 0.0, z), (400.0, 0.0, z)])
    lane = Lane("e_0", "e", 0, shape, 3.2, 14, 400, CAR)
    walk = Lane("e_1", "e", 1, shape - np.array([0, 4, 0]), 2.0, 1, 400, frozenset({"pedestrian"}))
    edges = {"e": Edge("e", "normal", "A", "B", (lane, walk))}
    return Network(edges, {"A": Junction("A", "x", np.zeros(3), np.zeros((0, 3)))}, (), Location())


def poi(kind, x, y, *, name=None, yaw=None, source="objects.add.xml"):
    return Poi(name or f"{kind}_{x}_{y}", kind, (x, y), yaw, (1.0, 0.0, 0.0), source)


def polygon(kind, points, *, fill=True, name="p", source="x.add.xml", **params):
    return Polygon(name, kind, np.array(points, float), fill, None, source, params)


def build(
    pois=(),
    polygons=(),
    settings=None,
    *,
    network=None,
    seed=7,
    budget=700_000,
    textured=True,
    dark=False,
    **around,
):
    where = replace(surroundings(network or road(), seed=seed, **around), dark=dark)
    settings = settings or ObjectsSettings()
    return build_scenery(pois, polygons, settings, around=where, budget=budget, textured=textured)


def of(scenery, family):
    return [part for part in scenery.static if part.family == family]


def triangles(scenery):
    return sum(len(part.part.mesh.faces) for part in scenery.static)


def triangles_of(scenery):
    """By family."""
    counts: dict[str, int] = {}
    for part in scenery.static:
        counts[part.family] = counts.get(part.family, 0) + len(part.part.mesh.faces)
    return counts


def bounds(scenery, family):
    points = np.concatenate([part.part.mesh.vertices for part in of(scenery, family)])
    return points.min(axis=0), points.max(axis=0)


@pytest.mark.parametrize(
    ("kind", "source", "expected"),
    [
        ("tree", "any.xml", "trees"),
        ("TREES", "any.xml", "trees"),
        ("House", "", "homes"),
        ("shop", "", "shops"),
        ("block", "", "blocks"),
        ("building.church", "", "buildings"),
        ("guardrail", "", "fences"),
        ("", "dir/trees.add.xml", "trees"),
        ("", r"C:\x\buildings_homes.add.xml", "homes"),
        ("", "buildings_shops.add.xml", "shops"),
        ("", "buildings_blocks.add.xml", "blocks"),
        ("", "fences.add.xml", "fences"),
        ("", "town_buildings.poly.xml", "buildings"),
        ("unknown", "trees.add.xml", "trees"),
        ("bench", "trees.add.xml", None),
        ("", "misc.add.xml", None),
    ],
)
def test_kind_by_type_else_by_file_name(kind, source, expected):
    assert kind_of(kind, source) == expected


@pytest.mark.parametrize("kind", ["tree", "home", "shop", "block"])
def test_point_objects_stand_at_their_place_and_reach_into_the_ground(kind):
    scenery = build([poi(kind, 100.0, 30.0)])
    family = f"{kind}s"
    assert {part.family for part in scenery.static} == {family}
    low, high = bounds(scenery, family)
    assert abs((low + high)[0] / 2 - 100.0) < 3.0
    assert low[2] < -0.25
    assert high[2] > 3.0
    assert set(scenery.materials) == {part.part.material for part in scenery.static}
    assert len({part.id for part in scenery.static}) == len(scenery.static)


def test_a_scene_without_objects_has_none_and_says_so():
    scenery = build()
    assert scenery.static == ()
    assert {item.what for item in scenery.left_out} == {kind.name for kind in KINDS}
    assert {item.why for item in scenery.left_out} == {"the scenario has none"}


def test_kinds_can_be_switched_off():
    scenery = build([poi("tree", 50, 20)], settings=ObjectsSettings(trees=None))
    assert scenery.static == ()
    assert any("switched off" in item.why for item in scenery.left_out)


def test_a_file_alone_says_what_belongs_to_a_kind(tmp_path):
    file = tmp_path / "mine.add.xml"
    pois = [poi("", 50, 20, source=str(file)), poi("tree", 200, 20)]
    scenery = build(pois, settings=ObjectsSettings(trees=ObjectSettings(file=file)))
    low, high = bounds(scenery, "trees")
    assert 40 < low[0] < high[0] < 60


def test_the_poi_colour_does_not_paint_houses_but_the_setting_does():
    plain = build([poi("home", 50, 20)])
    red = build([poi("home", 50, 20)], settings=ObjectsSettings(homes={"colour": "#ff0000"}))
    for scenery, expected in ((plain, False), (red, True)):
        tints = np.concatenate(
            [p.part.tint for p in of(scenery, "homes") if p.part.tint is not None]
        )
        assert bool(((tints[:, 0] > 0.7) & (tints[:, 1] < 0.01)).any()) is expected
        assert tints.max() <= 0.85


def test_tree_colour_and_model():
    settings = ObjectsSettings(trees={"model": "pine", "colour": "#3050ff"})
    leaf = next(
        p
        for p in of(build([poi("tree", 50, 20)], settings=settings), "trees")
        if p.part.material == "leaf"
    )
    assert leaf.part.tint[:, 2].mean() > 3 * leaf.part.tint[:, 0].mean()


@pytest.mark.parametrize(
    ("settings", "key", "word"),
    [
        ({"trees": {"model": "mapel"}}, "objects.trees.model", "maple"),
        ({"homes": {"model": ["plaster", "x"]}}, "objects.homes.model", "known"),
    ],
)
def test_unknown_models_are_errors(settings, key, word):
    pois = [poi("tree", 50, 20), poi("home", 90, 20)]
    with pytest.raises(ConfigError, match=word) as error:
        build(pois, settings=ObjectsSettings(**settings))
    assert error.value.key == key


def test_scale_and_variation():
    def heights(**settings):
        built = [
            build(
                [poi("tree", 50, 20, name=str(i))],
                settings=ObjectsSettings(trees={"model": "maple", **settings}),
            )
            for i in range(6)
        ]
        return np.array([bounds(one, "trees")[1][2] for one in built])

    same = heights(variation=0)
    assert heights(variation=0, scale=2.0) == pytest.approx(2 * same + 0.05, rel=0.01)
    ratio = (heights(variation=0.3) + 0.05) / (same + 0.05)
    assert ratio.std() > 0.03
    assert (ratio > 0.69).all()
    assert (ratio < 1.31).all()


def test_the_same_seed_and_id_give_the_same_object_whatever_else_there_is():
    alone = build([poi("tree", 50, 20, name="a")])
    among = build([poi("tree", 300, 20, name="b"), poi("tree", 50, 20, name="a")])
    other = build([poi("tree", 50, 20, name="a")], seed=8)
    mesh = {p.id: p.part.mesh.vertices for p in alone.static}
    for part in among.static:
        near = part.part.mesh.vertices[part.part.mesh.vertices[:, 0] < 150]
        if part.id in mesh:
            assert np.array_equal(near, mesh[part.id])
    assert not all(np.array_equal(p.part.mesh.vertices, mesh.get(p.id)) for p in other.static)


def test_buildings_face_the_nearest_road_unless_told():
    index = build_lane_index(road())
    yaws = facing_roads(np.array([(100.0, 30.0), (100.0, -30.0)]), index)
    assert np.sin(yaws) == pytest.approx([-1.0, 1.0])
    assert facing_roads(np.zeros((1, 2)), build_lane_index(road(empty=True))) == [0.0]
    settings = ObjectsSettings(shops={"variation": 0})
    south = bounds(build([poi("shop", 100, 30)], settings=settings), "shops")
    east = bounds(build([poi("shop", 100, 30, yaw=0.0)], settings=settings), "shops")
    assert (south[1] - south[0])[0] == pytest.approx((east[1] - east[0])[1], abs=1e-6)
    # The awning reaches out of the front.
    assert south[0][1] - 30 < -(south[1][1] - 30) - 0.5


def test_objects_on_a_carriageway_are_left_out_with_one_warning(caplog):
    pois = [poi("tree", 50, 0.5), poi("tree", 80, -1.0), poi("tree", 50, 20), poi("tree", 50, -4)]
    with caplog.at_level(logging.WARNING):
        scenery = build(pois)
    assert [r.message for r in caplog.records] == ["left out 2 trees: they stand on a carriageway"]
    assert any(item.what == "2 trees" for item in scenery.left_out)


def test_objects_around_a_camera_far_away_or_in_a_building_are_left_out():
    eye = np.array([(50.0, 20.0, 3.0)])
    pois = [poi("home", 52, 22), poi("home", 6000, 20), poi("home", 200, 40), poi("home", 90, 40)]
    area = polygon("building", [(190, 30), (210, 30), (210, 50), (190, 50)])
    scenery = build(pois, [area], viewpoints=eye)
    whys = {item.why for item in scenery.left_out if item.what == "1 homes"}
    assert len(whys) == 3
    assert bounds(scenery, "homes")[1][0] < 110


def test_a_camera_below_a_crown_keeps_the_tree():
    below = build([poi("tree", 50, 20)], viewpoints=np.array([(51.0, 20.0, 1.2)]))
    within = build([poi("tree", 50, 20)], viewpoints=np.array([(51.0, 20.0, 5.0)]))
    assert of(below, "trees")
    assert not of(within, "trees")


def test_what_no_camera_sees_is_left_out():
    camera_path = CameraPath(
        np.array([(0.0, 0.0, 2.0)]), np.array([(1.0, 0.0, 0.0)]), np.array([0.5])
    )
    trees = [poi("tree", 300, 20), poi("tree", -300, 20)]
    scenery = build(trees, camera_path=camera_path, textured=False)
    assert bounds(scenery, "trees")[0][0] > 0
    assert any("no camera" in item.why for item in scenery.left_out)


def test_levels_of_detail_fall_with_distance():
    eye = np.array([(0.0, 100.0, 2.0)])
    counts = [triangles(build([poi("tree", x, 100)], viewpoints=eye)) for x in (10, 50, 180, 400)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 20_000 > 14_000 > counts[1] > 5_000
    assert counts[2] < 2800
    assert counts[3] < 280


@pytest.mark.slow
def test_the_budget_draws_the_levels_in():
    pois = [poi("tree", 5.0 * i, 20 + 6.0 * j) for i in range(12) for j in range(6)]
    eye = np.array([(30.0, 0.0, 1.5)])
    free = triangles(build(pois, viewpoints=eye))
    tight = triangles(build(pois, viewpoints=eye, budget=free // 3))
    assert tight < 1.25 * free / 3


@pytest.mark.parametrize(("own", "alike"), [(None, False), (60_000, True)])
def test_kinds_with_triangles_of_their_own_do_not_mind_other_kinds(own, alike):
    """Films of a street with and without trees must show the same houses."""
    homes = [poi("home", 40.0 * i, 30) for i in range(8)]
    trees = [poi("tree", 5.0 * i, -30 - 6.0 * j) for i in range(12) for j in range(6)]
    settings = ObjectsSettings(triangles=own)
    eye = np.array([(30.0, 0.0, 1.5)])
    with_trees, without = (
        triangles_of(build([*homes, *some], settings=settings, viewpoints=eye, budget=50_000))
        for some in (trees, [])
    )
    assert (with_trees["homes"] == without["homes"]) is alike
    assert with_trees["trees"] > 10_000


def test_objects_follow_the_road_up_and_a_given_ground():
    low, _ = bounds(build([poi("home", 50, 20)], network=road(z=120.0)), "homes")
    assert low[2] == pytest.approx(120.0 - 0.05 - 1.0, abs=0.2)
    scenery = build([poi("home", 50, 20)], height_at=lambda places: np.full(len(places), 33.0))
    assert bounds(scenery, "homes")[0][2] == pytest.approx(32.0, abs=0.2)


def test_fences_follow_their_line_and_look_at_the_road():
    line = polygon("", [(0, 5), (100, 5), (200, 8)], fill=False, source="fences.add.xml")
    scenery = build(polygons=[line])
    low, high = bounds(scenery, "fences")
    assert low[0] == pytest.approx(0.0, abs=0.2)
    assert high[0] == pytest.approx(200.0, abs=0.2)
    assert 0.6 < high[2] < 0.9
    assert low[2] < -0.3
    assert triangles(scenery) / 200 * 4 < 60
    index = build_lane_index(road())
    west = np.array([(100.0, 5.0), (50.0, 5.0), (0.0, 5.0)])
    assert guarded_sides(west, index) == (1,)
    assert guarded_sides(west[::-1], index) == (-1,)
    assert guarded_sides(west + np.array([0, 500]), index) == (1,)
    assert guarded_sides(west * [1, 0] + [0, 0.01] * (np.arange(3)[:, None] - 1), index) == (1, -1)


def test_fences_on_a_road_stay_and_can_be_painted_and_tiny_ones_go():
    lines = [
        polygon("fence", [(0, 0), (40, 0)], fill=False, name="a"),
        polygon("fence", [(0, 0), (0.1, 0)], fill=False, name="b"),
        polygon("fence", [(0, 9), (9, 9), (9, 18)], fill=True, name="c"),
    ]
    scenery = build(polygons=lines, settings=ObjectsSettings(fences={"colour": "#202020"}))
    (part,) = of(scenery, "fences")
    assert part.part.tint is not None
    assert np.allclose(part.part.tint, part.part.tint[0])


def test_building_polygons_rise_over_their_outline():
    shape = [(100, 20), (112, 20), (112, 30), (100, 30), (100, 20)]
    scenery = build(polygons=[polygon("building", shape, height="9 m")])
    low, high = bounds(scenery, "buildings")
    assert high[2] > 9.0
    assert low[2] == pytest.approx(-1.05, abs=0.1)
    # Steps, canopies and balconies reach out.
    assert (np.abs(low[:2] - [100, 20]) < 1.4).all()
    assert (np.abs(high[:2] - [112, 30]) < 1.4).all()


def test_building_polygons_around_a_camera_or_of_no_area_are_not_drawn():
    shape = [(100, 20), (112, 20), (112, 30), (100, 30)]
    line = [(0, 20), (10, 20), (20, 20)]
    eye = np.array([(105.0, 25.0, 2.0)])
    polygons = [polygon("building", shape), polygon("building", line, name="q")]
    assert build(polygons=polygons, viewpoints=eye).static == ()


@pytest.mark.parametrize(
    ("params", "height"),
    [
        ({"height": "12"}, 12.0),
        ({"height": "7.5 m"}, 7.5),
        ({"levels": "4"}, 12.0),
        ({"building:levels": "2"}, 6.0),
        ({"height": "high", "levels": "3"}, 9.0),
    ],
)
def test_heights_come_from_params(params, height):
    assert height_of(polygon("building", np.zeros((3, 2)), **params), 100.0, 1) == height


@pytest.mark.parametrize(
    ("params", "eaves", "top"),
    [
        ({"height": "9", "roof:shape": "gabled", "roof:height": "3"}, 6.0, 9.0),
        ({"height": "9", "roof:shape": "hipped", "building:levels": "2"}, 6.0, 9.0),
        ({"height": "9", "roof:shape": "mansard"}, 6.3, 9.0),
        ({"height": "9", "roof:shape": "flat", "roof:height": "3"}, 9.0, 9.0),
        ({"building:levels": "2", "roof:shape": "pyramidal", "roof:levels": "1"}, 6.0, 8.7),
        ({"height": "9", "roof:shape": "gabled", "roof:height": "30"}, 4.05, 9.0),
        ({"height": "9", "roof:shape": "skillion", "roof:height": "2"}, 7.0, 9.0),
    ],
)
def test_roofs_have_the_shape_and_height_that_openstreetmap_says(params, eaves, top):
    plan = [(100, 20), (116, 20), (116, 30), (100, 30)]
    scenery = build(polygons=[polygon("building", plan, **params)])
    roof = [part.part.mesh.vertices for part in of(scenery, "buildings")]
    ground = -0.05
    eaves, top, heights = eaves + ground, top + ground, np.concatenate(roof)[:, 2]
    corner = np.concatenate([v[np.hypot(*(v[:, :2] - [100, 20]).T) < 0.02] for v in roof])[:, 2]
    assert np.abs(corner - eaves).min() < 0.03, "walls end at the eaves"
    # Slabs, parapets, chimneys and machines stand above.
    assert np.abs(heights - top).min() < 0.02 and heights.max() < top + 4.0


def test_roofs_that_are_not_built_as_told_are_noted(caplog):
    plan = np.array([(100, 20), (116, 20), (116, 30), (100, 30)])
    kinds = ("dome", "gabled", "dome", "", "onion")
    some = [
        polygon("building", plan + np.array([40 * k, 0]), name=f"b{k}", **{"roof:shape": kind})
        for k, kind in enumerate(kinds)
    ]
    build(polygons=some)
    assert "as suits the plan: dome (2), onion (1)" in caplog.text


@pytest.mark.parametrize("area", [20.0, 150.0, 500.0, 3000.0])
def test_heights_are_plausible_without_params(area):
    item = polygon("building", np.zeros((3, 2)), height="-5")
    heights = {height_of(item, area, seed) for seed in range(20)}
    assert len(heights) > 10
    assert 2.4 < min(heights) < max(heights) <= 18.0


def test_a_network_without_roads_still_shows_objects():
    scenery = build([poi("home", 50, 20)], network=road(empty=True))
    assert bounds(scenery, "homes")[0][2] == pytest.approx(-1.05, abs=0.1)


def test_houses_shrink_until_they_clear_the_road_and_each_other():
    tight = [poi("shop", 100.0, 7.0), poi("shop", 110.0, 7.0), poi("shop", 200.0, 40.0)]
    scenery = build(tight, settings=ObjectsSettings(shops={"variation": 0}))
    walls = next(p.part.mesh.vertices for p in of(scenery, "shops") if p.part.material == "wall")
    at_road = walls[walls[:, 0] < 150]
    assert at_road[:, 1].min() > 1.6
    free = walls[walls[:, 0] > 150]
    assert np.ptp(at_road[at_road[:, 0] < 105.0][:, 0]) < np.ptp(free[:, 0])


def test_near_walls_and_roofs_show_surfaces_and_far_ones_their_mean_colours():
    pois = [poi("home", 30.0 * i, 30) for i in range(10)]
    near, far = (build(pois, viewpoints=np.array([(150.0, y, 2.0)])) for y in (0, 900))
    textured = [p.part for p in near.static if p.part.material.startswith("cladding:")]
    names = {part.material for part in textured}
    assert names >= {"cladding:plaster", "cladding:roof_tiles"}
    assert all(part.mesh.uvs is not None and part.tint is not None for part in textured)
    assert not any(name.startswith("cladding:") for name in far.materials)
    plain = build(pois, viewpoints=np.array([(150.0, 0.0, 2.0)]), textured=False)
    assert not any(bsdf["base_color"].get("type") == "stained" for bsdf in plain.materials.values())


def town(dark):
    pois = [
        poi(kind, 60.0 * i + 30, 40) for i, kind in enumerate(("home", "shop", "block", "shop"))
    ]
    area = polygon("building", [(250, 20), (280, 20), (280, 40), (250, 40)], height="14")
    return build(pois, [area], dark=dark, viewpoints=np.array([(100.0, 0.0, 2.0)]))


def test_windows_and_signs_shine_when_it_is_dark_and_not_by_day():
    day, night = town(dark=False), town(dark=True)
    assert day.lamps == ()
    assert any(item.what == "lit windows" for item in day.left_out)
    assert not any(item.what == "lit windows" for item in night.left_out)
    assert {lamps.id for lamps in night.lamps} == {"buildings_windows", "buildings_shops"}
    # What shines has left the static parts, and nothing else has.
    shining = sum(len(lamps.mesh.faces) for lamps in night.lamps)
    assert triangles(night) + shining == triangles(day)
    assert 40 < shining < 2000
    for lamps in night.lamps:
        assert lamps.sampled == (lamps.weight > 0) == (lamps.id == "buildings_shops")
        assert lamps.radiance.shape == (len(lamps.lamps), 3)
        assert lamps.lamp_of_face.max() < len(lamps.lamps)
        assert (lamps.radiance >= 0).all()
        # Lit rooms from 2 cd/m2, shops about 10, signs below 500, at 32,000 cd/m2 per unit.
        assert 2e-5 < np.median(lamps.radiance) < 1e-3
        assert 3e-4 < lamps.radiance.max() < 0.03


def test_the_same_windows_shine_every_night():
    one, other = town(dark=True), town(dark=True)
    for lamps, again in zip(one.lamps, other.lamps, strict=True):
        assert np.array_equal(lamps.mesh.vertices, again.mesh.vertices)
        assert np.array_equal(lamps.radiance, again.radiance)


def test_polygons_have_their_shops_and_doors_at_the_street():
    around = surroundings(road(), seed=1)
    plan = np.array([(100, 20), (130, 20), (130, 40), (100, 40)], float)
    assert street_walls(plan, around) == (0,)
    assert street_walls(plan + np.array([0, 200]), around) == ()
    assert street_walls(plan, surroundings(road(empty=True), seed=1)) == ()


def leaves_of(scenery):
    (part,) = [one.part for one in scenery.static if one.id == "trees/leaf"]
    corners = part.mesh.vertices[part.mesh.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return len(part.mesh.faces), 0.5 * area.sum(), (area @ part.tint) / area.sum()


def looking_along(x):
    """A camera over the road that looks to the east, and one that looks everywhere."""
    place, ahead = np.array([[x, 0.0, 6.0]]), np.array([[1.0, 0.0, 0.0]])
    return CameraPath(place, ahead, np.array([1.3])), CameraPath.all_round(place)


def test_far_crowns_have_half_the_leaves_where_the_camera_is_known():
    one, anywhere = looking_along(100.0)
    trees = [poi("tree", 100.0 + away, 20.0) for away in (70.0, 120.0, 200.0)]
    seen, whole = (
        leaves_of(build(trees, camera_path=path, textured=False)) for path in (one, anywhere)
    )
    assert seen[0] < 0.65 * whole[0]
    assert seen[1] == pytest.approx(whole[1], rel=1e-6)
    assert seen[2] == pytest.approx(whole[2], rel=1e-6)


def test_near_crowns_keep_every_leaf():
    one, anywhere = looking_along(100.0)
    trees = [poi("tree", 112.0, 8.0, name="near")]
    seen, whole = (build(trees, camera_path=path, textured=False) for path in (one, anywhere))
    (a,), (b,) = ([s.part for s in one.static if s.id == "trees/leaf"] for one in (seen, whole))
    assert np.array_equal(a.mesh.vertices, b.mesh.vertices)
    assert np.array_equal(a.tint, b.tint)


def test_merged_objects_keep_their_names():
    pois = [poi(kind, 30.0 * k, 25) for k, kind in enumerate(("tree", "shrub", "house", "shop"))]
    pois += [poi("tree", 15, 40), poi("house", 100, 60)]
    shapes = [
        polygon("hedge", [(0, 70), (30, 70)], fill=False, name="h"),
        polygon("fence", [(0, 80), (30, 80)], fill=False, name="f"),
        polygon("building", [(50, 70), (70, 70), (70, 90), (50, 90)], name="b"),
    ]
    found = {}
    for part in build(pois, shapes).static:
        mesh = part.part.mesh
        first = 0
        for thing, count in mesh.things:
            corners = mesh.vertices[mesh.faces[first : first + count]].reshape(-1, 3)
            found.setdefault(thing, []).append(corners)
            first += count
        assert first == len(mesh.faces)
    wanted = {f"{p.type}:{p.id}": np.array(p.position) for p in pois}
    wanted = {name.replace("house", "home", 1): place for name, place in wanted.items()}
    wanted |= {"hedge:h": (15, 70), "fence:f": (15, 80), "building:b": (60, 80)}
    assert set(found) == set(wanted)
    for name, place in wanted.items():
        middle = np.concatenate(found[name])[:, :2]
        middle = 0.5 * (middle.min(axis=0) + middle.max(axis=0))
        assert np.linalg.norm(middle - place) < 3.0, name
