"""The ground where the land's heights, or its picture, are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import GroundSettings, RoadSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import (
    Edge,
    GroundPicture,
    Heights,
    Lane,
    Location,
    Network,
)
from sumo3dviz_pt.world.land.ground import GroundParts, build_ground
from sumo3dviz_pt.world.land.terrain import road_samples
from sumo3dviz_pt.world.roads.layout import RoadLayout, layout_roads

CARS = frozenset({"passenger"})


def hill(places: Floats) -> Floats:
    """The land of these tests [m]."""
    x, y = places[:, 0], places[:, 1]
    return 0.03 * x + 8.0 * np.exp(-((x - 150) ** 2 + (y - 60) ** 2) / 3e4)


def heights() -> Heights:
    """The same on a grid, far beyond the roads."""
    x = np.arange(-1500.0, 1800.0, 5.0)
    places = np.column_stack([each.ravel() for each in np.meshgrid(x, x)])
    return Heights((x[0], x[0]), (5.0, 5.0), hill(places).reshape(len(x), len(x)))


def network(*, on_land: bool, over: float | None = None) -> Network:
    """Return a street over the hill, and another one across it so high above the land [m]."""

    def street(name: str, start: tuple[float, float], end: tuple[float, float], up: float) -> Edge:
        share = np.linspace(0.0, 1.0, 61)[:, None]
        flat = np.array(start) + share * (np.array(end) - start)
        z = hill(flat) + up if on_land else np.full(len(flat), up)
        shape = np.column_stack([flat, z])
        lane = Lane(f"{name}_0", name, 0, shape, 3.5, 13.9, 300.0, CARS)
        return Edge(name, "normal", "a", "b", (lane,))

    edges = {"a": street("a", (0.0, 0.0), (300.0, 0.0), 0.0)}
    if over is not None:
        edges["b"] = street("b", (150.0, -150.0), (150.0, 150.0), over)
    place = Location(boundary=(0.0, -150.0, 300.0, 150.0))
    return Network(edges, {}, (), place, heights=heights())


def ground_of(net: Network) -> tuple[GroundParts, RoadLayout]:
    roads = layout_roads(net, RoadSettings())
    return build_ground(GroundSettings(), net, roads=roads, textured=False), roads


def away(roads: RoadLayout, least: float) -> Floats:
    """Return places that are so far from all roads [m]."""
    places = np.random.default_rng(1).uniform([-100, -150], [400, 150], (4000, 2))
    area = shapely.union_all(roads.outline)
    return places[shapely.distance(area, shapely.points(places)) > least]


def test_the_ground_is_the_land_beside_roads_that_follow_it() -> None:
    """Within 5 cm a few metres beside the road; below it everywhere under it."""
    ground, roads = ground_of(network(on_land=True))
    places = away(roads, 6.0)
    assert np.abs(ground.height_at(places) - hill(places)).max() < 0.05
    samples = road_samples(roads)
    assert (ground.height_at(samples[:, :2]) < samples[:, 2]).all()


def test_a_level_road_lies_in_hills() -> None:
    """A road with a height of its own is met in slopes, and the land is its own farther off."""
    ground, roads = ground_of(network(on_land=False))
    far = away(roads, 40.0)
    assert np.abs(ground.height_at(far) - hill(far)).max() < 0.05
    samples = road_samples(roads)
    assert (ground.height_at(samples[:, :2]) < samples[:, 2]).all()
    assert np.abs(ground.height_at(samples[::7, :2])).max() < 1.0


def test_a_bridge_leaves_the_land_below_it() -> None:
    """An interchange on real heights: the upper road is 10 m above the lower one's land."""
    ground, roads = ground_of(network(on_land=True, over=10.0))
    under = np.array([[150.0, -12.0], [150.0, 14.0], [140.0, 0.0], [160.0, 0.0]])
    assert (ground.height_at(under) < hill(under) + 4.0).all()
    samples = road_samples(roads)
    low = samples[np.abs(samples[:, 1]) < 1.5]
    assert (ground.height_at(low[:, :2]) < np.fmax(low[:, 2], hill(low) + 10.1)).all()


def test_beyond_what_is_known_the_land_goes_on_without_a_step() -> None:
    part = heights()
    small = replace(part, values=part.values[240:420, 240:420], corner=(-300.0, -300.0))
    net = replace(network(on_land=True), heights=small)
    ground, _ = ground_of(net)
    line = np.column_stack([np.arange(300.0, 700.0, 2.0), np.full(200, 30.0)])
    z = ground.height_at(line)
    assert np.isfinite(z).all() and np.abs(np.diff(z)).max() < 1.0


@pytest.mark.parametrize("textured", [True, False])
def test_a_picture_is_laid_where_it_belongs(tmp_path: Path, textured: bool) -> None:
    """Texture coordinates are those of the picture's box, within a millimetre on the ground."""
    file = tmp_path / "land.png"
    from PIL import Image

    Image.fromarray(np.full((8, 8, 3), 90, np.uint8)).save(file)
    box = (-60.0, -110.0, 350.0, 120.0)
    net = replace(network(on_land=True), picture=GroundPicture(file, box))
    roads = layout_roads(net, RoadSettings())
    ground = build_ground(GroundSettings(), net, roads=roads, textured=textured)
    shown = [each.part for each in ground.static if each.id == "ground/picture"]
    if not textured:
        assert not shown
        return
    (part,) = shown
    assert part.material in ground.materials
    x0, y0, x1, y1 = box
    uvs, places = part.mesh.uvs, part.mesh.vertices[:, :2]
    assert uvs is not None and uvs.min() >= 0.0 and uvs.max() <= 1.0
    np.testing.assert_allclose(uvs * [x1 - x0, y1 - y0] + [x0, y0], places, atol=1e-3)
    (plain,) = (each.part.mesh for each in ground.static if each.id == "ground")
    corners = plain.vertices[plain.faces][:, :, :2].mean(axis=1)
    inside = ((corners > [x0 + 15, y0 + 15]) & (corners < [x1 - 15, y1 - 15])).all(axis=1)
    assert not inside.any()
