"""Laws of signal heads: every link has its own, no pole on a lane, all in view."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely
from needed import lacking

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.library.street.road_styles import STYLES
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.sumo import read_network
from sumo3dviz_pt.sumo.signals import read_signals
from sumo3dviz_pt.world.placement.lanes import build_lane_index
from sumo3dviz_pt.world.rails.ways import guard_of
from sumo3dviz_pt.world.signals.heads import ARM_BOTTOM, kind_of
from sumo3dviz_pt.world.signals.signals import RADIANCE, TRAM_RADIANCE, build_signals
from tests import rail_town

EXAMPLES = Path(__file__).resolve().parents[4] / "examples"
CAR, TRAM, CYCLE = frozenset({"passenger"}), frozenset({"tram"}), frozenset({"bicycle"})


@cache
def town(folder: Path) -> tuple[Network, dict[str, SignalPhases]]:
    """The rail town, and a log in which every light is green."""
    net = read_network(rail_town.build_network(folder))
    count = {c.tls: 1 + max(k.link_index for k in net.connections if k.tls == c.tls)
             for c in net.connections if c.tls}  # fmt: skip
    return net, {tls: SignalPhases(tls, (0.0,), ("G" * n,)) for tls, n in count.items()}


@pytest.fixture(params=["crossing", "ronda", pytest.param("town", marks=pytest.mark.slow)])
def place(request, tmp_path_factory):
    if request.param != "town":
        folder = EXAMPLES / request.param
        net = read_network(folder / f"{request.param}.net.xml.gz")
        return net, read_signals([folder / "signals.xml.gz"])
    if rail_town.missing():
        lacking("SUMO's programs are not installed")
    return town(tmp_path_factory.getbasetemp())


@pytest.mark.parametrize("style", sorted(STYLES))
def test_every_signalled_link_has_heads_of_its_own_kind_and_no_pole_stands_on_a_lane(place, style):
    net, log = place
    signals = build_signals(net, log, SignalSettings(), style=STYLES[style].signals)
    links = [c for c in net.connections if c.tls and c.link_index >= 0]
    for link in links:
        heads = [signals.heads[k] for k in signals.heads_of(link.tls, link.link_index)]
        if guard_of(net, link) == "level crossing":
            assert not heads
            continue
        assert heads
        assert {head.kind for head in heads} == {kind_of(net, link)}
        # All of them always show the same.
        assert len({id(head.course) for head in heads}) == 1
    feet = np.array([head.foot[:2] for head in signals.heads])
    assert not build_lane_index(net).covers(feet).any()


def lane(edge, index, y, allowed=CAR, x=(0.0, 100.0)) -> Lane:
    shape = np.array([(x[0], y, 0.0), (x[1], y, 0.0)])
    return Lane(f"{edge}_{index}", edge, index, shape, 3.2, 13.9, 100.0, allowed)


def approach(*classes, left=False) -> tuple[Network, dict[str, SignalPhases]]:
    """An edge to the east whose lanes lead over a junction of 20 m."""
    side = -1.0 if left else 1.0
    rows = [(k, 3.2 * side * k, allowed) for k, allowed in enumerate(classes)]
    came = Edge("in", "normal", "A", "B", tuple(lane("in", *row) for row in rows))
    goes = Edge("out", "normal", "B", "C", tuple(lane("out", *row, (120, 220)) for row in rows))
    low, high = sorted((-1.6 * side, 3.2 * side * (len(classes) - 0.5)))
    outline = np.array([(100, low, 0), (120, low, 0), (120, high, 0), (100, high, 0)])
    junction = Junction("B", "traffic_light", outline.mean(axis=0), outline)
    links = tuple(Connection(f"in_{k}", f"out_{k}", "", "B", k) for k in range(len(classes)))
    net = Network({"in": came, "out": goes}, {"B": junction}, links, Location(), left)
    return net, {"B": SignalPhases("B", (0.0,), ("G" * len(classes),))}


def far_heads(classes, style="european", *, left=False):
    net, log = approach(*classes, left=left)
    signals = build_signals(net, log, SignalSettings(), style=STYLES[style].signals)
    return [head for head in signals.heads if head.position[0] > 119.0]


@pytest.mark.parametrize("left", [False, True])
def test_wide_approaches_are_repeated_beyond_the_junction_and_narrow_ones_are_not(left):
    assert not far_heads([CAR], left=left)
    (head,) = far_heads([CAR] * 3, left=left)
    assert head.links == (0, 1, 2)
    assert head.foot[1] * (-1.0 if left else 1.0) < -1.6
    assert head.position[2] < ARM_BOTTOM


def test_american_signals_always_stand_beyond_the_junction_in_yellow():
    assert far_heads([CAR], "american")
    net, log = approach(CAR)
    made = build_signals(net, log, SignalSettings(), style=STYLES["american"].signals)
    materials = {part.part.material for part in made.static}
    assert "signal_housing_yellow" in materials
    assert "signal_border" not in materials


def test_a_waiting_driver_sees_a_head_within_25_degrees():
    for lanes in (1, 2, 3, 4, 5):
        net, log = approach(*[CAR] * lanes)
        signals = build_signals(net, log, SignalSettings(), style=STYLES["european"].signals)
        for k in range(lanes):
            eye = np.array([100.0 - 3.2, 3.2 * k, 1.2])
            towards = (
                np.array(
                    [
                        signals.heads[i].position + np.array([0, 0, 0.45])
                        for i in signals.heads_of("B", k)
                    ]
                )
                - eye
            )
            angle = np.degrees(np.arccos(towards[:, 0] / np.linalg.norm(towards, axis=1)))
            assert angle.min() < 25.0, (lanes, k)


def test_trams_and_cyclists_have_heads_of_their_own():
    net, log = approach(CYCLE, CAR, TRAM)
    signals = build_signals(net, log, SignalSettings())
    kinds = {head.links: head.kind for head in signals.heads if head.position[2] < 3.0}
    assert kinds == {(0,): "bicycle", (1,): "vehicle", (2,): "tram"}
    rows = signals.radiance_at(0.0)["signals"]
    names = signals.lamps[0].lamps
    shown = {tuple(row) for name, row in zip(names, rows, strict=True) if name.startswith("B/2/")}
    assert tuple(TRAM_RADIANCE["green"]) in shown


def test_poles_leave_joined_junctions_rather_than_stand_on_a_lane():
    net, log = approach(CAR)
    # Lanes all around: 30 m of carriageway beside the approach.
    rows = [lane("x", k, -3.2 * (k + 1) if k < 9 else 3.2 * (k - 8)) for k in range(18)]
    beyond = [lane("y", k, -28.8 + 3.2 * k, x=(100.0, 125.0)) for k in range(19)]
    extra = {"x": Edge("x", "normal", "P", "Q", tuple(rows)),
             "y": Edge("y", "normal", "P", "Q", tuple(beyond))}  # fmt: skip
    wide = Network({**net.edges, **extra}, net.junctions, net.connections, net.location)
    (head,) = build_signals(wide, log, SignalSettings()).heads
    lanes = shapely.union_all(build_lane_index(wide).areas.geometries)
    assert not lanes.contains(shapely.Point(head.foot[:2]))


def test_lenses_have_the_colours_of_signals():
    """Red without blue, amber, and a green that leans to blue, so that few confuse it with red."""
    assert (np.argsort(RADIANCE["red"])[::-1] == [0, 1, 2]).all()
    assert (np.argsort(RADIANCE["yellow"])[::-1] == [0, 1, 2]).all()
    assert (np.argsort(RADIANCE["green"])[::-1] == [1, 2, 0]).all()
