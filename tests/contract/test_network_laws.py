"""The bundled examples keep the laws of generated networks; laws see what breaks them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from any_network.ageing import aged
from any_network.known import EXAMPLES_KNOWN
from any_network.laws import (
    Drawn,
    before_camera,
    floating_users,
    gaps,
    kerbs_in_the_way,
    overlaps,
    standing_on_roads,
    wrong_area,
    wrong_heads,
)
from any_network.recipes import RECIPES
from any_network.towns import Town, town_in
from builders import box, network_xml, write_scenario

from sumo3dviz_pt.job.settings import RoadSettings, SignalSettings
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.world.roads.cells import Cells
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.signals.signals import build_signals

ROOT = Path(__file__).parents[2]
DATA, EXAMPLES = ROOT.parent / "shared" / "data", ROOT / "examples"
absent = pytest.mark.skipif(not DATA.is_dir(), reason="the shared scenarios are not here")
SHARED = ["barcelona", "doerpfeldstr", "bologna_acosta", "badhersfeld", "monaco_west_hills"]
NAMES = [
    *("crossing", pytest.param("ronda", marks=pytest.mark.slow)),
    *(pytest.param(name, marks=[absent, pytest.mark.slow]) for name in SHARED),
]
LAWS = {
    "wrong_area": lambda town: wrong_area(town.drawn),
    "gaps": lambda town: gaps(town.drawn),
    "overlaps": lambda town: overlaps(town.drawn),
    "kerbs_in_the_way": lambda town: kerbs_in_the_way(town.drawn),
    "floating_users": lambda town: floating_users(town.drawn, town.scenario),
    "wrong_heads": lambda town: wrong_heads(
        town.scenario.network,
        build_signals(town.scenario.network, town.scenario.signals, SignalSettings()),
    ),
}


@cache
def town(name: str) -> Town:
    return town_in((DATA if name in SHARED else EXAMPLES) / name)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", NAMES)
def test_real_networks_keep_the_laws(name, law, request):
    if law == "wrong_heads" and not town(name).scenario.signals:
        pytest.skip("it has no signal log")
    if (law, name) in EXAMPLES_KNOWN:
        reason = EXAMPLES_KNOWN[law, name]
        request.applymarker(pytest.mark.xfail(reason=reason, strict=True))
    faults = list(LAWS[law](town(name)))
    assert not faults, f"{len(faults)} faults\n" + "\n".join(faults[:10])


# What breaks a law is seen ------------------------------------------------------------------


@pytest.fixture
def road(tmp_path) -> Town:
    """A straight road of two edges with a signal between them, and its traffic."""
    write_scenario(tmp_path, signals=True)
    (tmp_path / "scene.yaml").unlink()
    return town_in(tmp_path)


def changed(town: Town, cell: int, **values) -> Drawn:
    """The same roads with another value in one cell."""
    layout = town.drawn.layout
    arrays = {key: getattr(layout.cells, key).copy() for key in values}
    for key, value in values.items():
        arrays[key][cell] = value
    return Drawn(town.drawn.network, replace(layout, cells=replace(layout.cells, **arrays)))


def without(town: Town, cell: int) -> Drawn:
    """The same roads without a cell."""
    cells = town.drawn.layout.cells
    kept = np.flatnonzero(np.arange(len(cells.polygons)) != cell)
    number = {int(old): new for new, old in enumerate(kept)}
    fewer = Cells(
        cells.polygons[kept],
        cells.quads[kept],
        {number[k]: v for k, v in cells.knots.items() if k in number},
        tuple(cells.surfaces[k] for k in kept),
        cells.raised[kept],
        tuple(cells.owners[k] for k in kept),
        {},
    )
    return Drawn(town.drawn.network, replace(town.drawn.layout, cells=fewer))


def test_a_lawful_road_breaks_no_law(road):
    for law in LAWS.values():
        assert not list(law(road))


def test_missing_lanes_are_seen(road):
    lane = road.drawn.layout.cells.owners.index("w")
    drawn = without(road, lane)
    assert any("is missing" in fault for fault in wrong_area(drawn))
    assert any("beside" in fault for fault in gaps(drawn))
    assert any("no surface" in fault for fault in floating_users(drawn, road.scenario))


def test_overlaps_and_areas_beyond_the_network_are_seen(road):
    cells = road.drawn.layout.cells
    wider = cells.polygons[0].buffer(1.5, join_style="mitre")
    drawn = changed(road, 0, polygons=wider)
    assert list(overlaps(drawn))
    assert any("beyond" in fault for fault in wrong_area(drawn))


def test_surfaces_at_another_height_or_of_another_kind_are_seen(road):
    owners = road.drawn.layout.cells.owners
    cell = owners.index("w")
    below = road.drawn.layout.cells.quads[cell] - [0.0, 0.0, 4.0]
    for values in ({"quads": below}, {"raised": 1}):
        drawn = changed(road, cell, **values)
        assert any("(passenger)" in fault for fault in floating_users(drawn, road.scenario))


def test_road_users_follow_a_surface_that_lies_a_little_lower(road):
    cell = road.drawn.layout.cells.owners.index("w")
    lower = road.drawn.layout.cells.quads[cell] - [0.0, 0.0, 0.06]
    assert not list(floating_users(changed(road, cell, quads=lower), road.scenario))


def test_missing_and_doubled_heads_are_seen(road):
    network, phases = road.scenario.network, road.scenario.signals
    signals = build_signals(network, phases, SignalSettings())
    assert not list(wrong_heads(network, signals))
    first = signals.heads[0]
    without = tuple(head for head in signals.heads if not set(head.links) & set(first.links))
    for heads in (without, (*signals.heads, first)):
        assert list(wrong_heads(network, replace(signals, heads=heads)))


def across(*ways, walks="8,-20 8,20") -> str:
    """A road of some lanes through a junction 16 m long, and a footway across it, as XML."""
    normal, inner, links = [], [], []
    for number, y in enumerate(ways):
        for edge, lane, line in (
            ("w", f"w_{number}", f"-90,{y} 0,{y}"),
            (":j_0", f":j_0_{number}", f"0,{y} 16,{y}"),
            ("e", f"e_{number}", f"16,{y} 90,{y}"),
        ):
            text = f'<lane id="{lane}" index="{number}" disallow="pedestrian" shape="{line}"/>'
            (inner if edge == ":j_0" else normal).append((edge, text))
        links.append(
            f'<connection from="w" to="e" fromLane="{number}" toLane="{number}"'
            f' via=":j_0_{number}" dir="s" state="M"/>'
        )
    lanes = {key: "".join(t for edge, t in normal if edge == key) for key in ("w", "e")}
    within = "".join(text for _, text in inner)
    into, through = (" ".join(f"{key}_{k}" for k in range(len(ways))) for key in ("w", ":j_0"))
    return f"""<net version="1.20"><location netOffset="0,0" convBoundary="-90,-20,90,20"
 origBoundary="-90,-20,90,20" projParameter="!"/>
<edge id=":j_0" function="internal">{within}</edge>
<edge id="w" from="a" to="j">{lanes["w"]}</edge><edge id="e" from="j" to="b">{lanes["e"]}</edge>
<edge id="f" from="c" to="d"><lane id="f_0" index="0" allow="pedestrian" width="2"
 shape="{walks}"/></edge>
<junction id="a" type="dead_end" x="-90" y="0" incLanes="" shape=""/>
<junction id="j" type="priority" x="8" y="0" incLanes="{into}"
 intLanes="{through}" shape="0,-6 16,-6 16,6 0,6"/>
<junction id="b" type="dead_end" x="90" y="0" incLanes="" shape=""/>
{"".join(links)}</net>"""


@pytest.mark.parametrize("ways", [(0.0,), (-3.2, 0.0, 3.2), (-3.0, 0.1, 3.3)])
def test_a_footway_across_a_junction_leaves_no_crumbs(tmp_path, ways):
    path = tmp_path / "net.net.xml"
    path.write_text(across(*ways), encoding="utf-8")
    network = read_network(path)
    drawn = Drawn(network, layout_roads(network, RoadSettings()))
    for law in (kerbs_in_the_way, gaps, overlaps):
        assert not list(law(drawn))
    assert len(drawn.layout.raised) == 2


@pytest.mark.parametrize(
    ("low", "high", "on_road", "in_view"),
    [
        ((-50.0, -3.5, 0.0), (-49.8, -3.3, 1.5), True, False),
        ((-50.0, 3.0, 0.0), (-49.8, 3.2, 1.5), False, False),
        ((-50.0, -3.5, 4.5), (-49.8, -3.3, 5.0), False, False),
        ((18.0, -3.5, 6.0), (18.4, -3.3, 7.0), False, True),
    ],
)
def test_things_on_roads_and_before_cameras_are_seen(road, low, high, on_road, in_view):
    static = (StaticPart("furniture/post", "furniture", Part(box(low, high), "galvanised")),)
    eye, target = np.array([38.0, -9.0, 11.0]), np.array([0.0, -3.2, 1.0])
    assert bool(list(standing_on_roads(road.drawn, static))) == on_road
    assert bool(list(before_camera(eye, target, static))) == in_view
    ground = tuple(replace(part, family="ground") for part in static)
    assert not list(standing_on_roads(road.drawn, ground))


# The table of networks ----------------------------------------------------------------------


def test_numbers_mean_forty_different_networks():
    assert len({recipe.title for recipe in RECIPES}) == len(RECIPES) >= 40
    assert len({(recipe.options, repr(recipe.plain), recipe.after) for recipe in RECIPES}) == len(
        RECIPES
    )


@pytest.mark.parametrize("bare", [False, True])
def test_aged_networks_can_be_read(tmp_path, bare):
    path = tmp_path / "old.net.xml"
    text = aged(network_xml(signals=True), bare=bare)
    assert ("version" in text.split(">", 2)[1]) != bare and ("dir=" in text) != bare
    path.write_text(text, encoding="utf-8")
    network = read_network(path)
    assert len(layout_roads(network, RoadSettings()).cells.polygons) >= 4
