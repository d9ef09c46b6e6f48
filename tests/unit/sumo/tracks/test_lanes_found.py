"""Roads that are found where nothing but tracks is known.

Truths are ways of our own making: lanes of a known place and width. Whoever drives must drive on
something, lanes must lie where they were, and where ways cross there must be none.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.sumo.tracks.paving import network_text
from sumo3dviz_pt.sumo.tracks.users import Track


def drive(line: Floats, number: int, speed: float = 12.0, side: float = 0.0) -> Track:
    """Return somebody whose middle follows a line [m], beside it by `side`."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    times = np.arange(0.0, along[-1] / speed, 0.2)
    x, y = (np.interp(times * speed, along, axis) for axis in line.T)
    headings = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
    ahead = np.column_stack([np.cos(headings), np.sin(headings)])
    left = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    fronts = np.column_stack([x, y]) + 2.25 * ahead + side * left
    fronts = np.column_stack([fronts, np.zeros(len(x))])
    size = (4.5, 1.8, 1.5)
    return Track(f"v{number}", "passenger", size, times, fronts, headings, np.full(len(x), speed))


def network_of(tracks: list[Track], folder: Path) -> Network:
    """Return the network that is made of tracks."""
    file = folder / "ways.net.xml"
    file.write_text(network_text(tracks, file=file), encoding="utf-8")
    return read_network(file)


def paved(network: Network) -> shapely.Geometry:
    """Return all that is paved."""
    lanes = [
        shapely.LineString(lane.shape[:, :2]).buffer(lane.width / 2, cap_style="flat")
        for lane in network.lanes.values()
    ]
    areas = [
        shapely.Polygon(junction.outline[:, :2])
        for junction in network.junctions.values()
        if len(junction.outline) > 2
    ]
    return shapely.union_all([*lanes, *areas])


def share_on(tracks: list[Track], network: Network) -> float:
    """Return the share of places of middles that are paved."""
    area = paved(network).buffer(0.3)
    places = np.concatenate(
        [
            t.fronts[:, :2] - 2.25 * np.column_stack([np.cos(t.headings), np.sin(t.headings)])
            for t in tracks
        ]
    )
    return float(shapely.contains_xy(area, places[:, 0], places[:, 1]).mean())


WIDTH = 3.5


def motorway(rng: np.random.Generator) -> list[Track]:
    """Return 90 drives on three lanes in a wide bend, each a little beside the middle."""
    turn = np.linspace(0.0, 0.6, 200)
    tracks = []
    for number in range(90):
        radius = 800.0 + WIDTH * (number % 3)
        line = np.column_stack([radius * np.sin(turn), 800.0 - radius * np.cos(turn)])
        tracks.append(drive(line, number, 30.0, float(rng.normal(0.0, 0.25))))
    return tracks


def test_lanes_of_a_motorway(tmp_path: Path) -> None:
    """Three lanes, as wide as they are apart, within a quarter of a metre of where they are."""
    tracks = motorway(np.random.default_rng(3))
    network = network_of(tracks, tmp_path)
    longest = max(network.edges.values(), key=lambda edge: edge.lanes[0].length)
    assert len(longest.lanes) == 3
    assert longest.lanes[0].length > 400.0
    for index, lane in enumerate(longest.lanes):
        radii = np.linalg.norm(lane.shape[:, :2] - [0.0, 800.0], axis=1)
        # Lane 0 is the right-most, which is the outer one of a bend to the left.
        assert np.abs(radii - (800.0 + WIDTH * (2 - index))).max() < 0.25
        assert lane.width == pytest.approx(WIDTH, abs=0.25)
    assert share_on(tracks, network) > 0.99


def test_no_lanes_where_ways_cross(tmp_path: Path) -> None:
    """A crossing of two streets: pavement in the middle, lanes on all four arms."""
    rng = np.random.default_rng(4)
    out = np.linspace(-150.0, 150.0, 151)
    tracks = []
    for number in range(40):
        sign = 1.0 if number % 2 else -1.0
        straight = np.column_stack([sign * out, np.full(151, -1.75 * sign)])
        line = straight if number % 4 < 2 else straight[:, ::-1] * [-1.0, 1.0]
        tracks.append(drive(line, number, 12.0, float(rng.normal(0.0, 0.2))))
    network = network_of(tracks, tmp_path)
    assert len([edge for edge in network.edges.values() if edge.function == "normal"]) == 8
    for lane in network.lanes.values():
        assert np.abs(lane.shape[:, :2]).max(axis=1).min() > 3.0
    assert share_on(tracks, network) > 0.99
    assert paved(network).contains(shapely.Point(0.0, 0.0))


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_the_side_of_the_road_is_found(tmp_path: Path, hand: float) -> None:
    out = np.linspace(-100.0, 100.0, 101)
    tracks = []
    for number in range(20):
        sign = 1.0 if number % 2 else -1.0
        line = np.column_stack([sign * out, np.full(101, -1.75 * sign * hand)])
        tracks.append(drive(line, number))
    assert network_of(tracks, tmp_path).left_hand == (hand < 0)


def test_people_alone_have_a_floor(tmp_path: Path) -> None:
    """An experiment with people on foot: one floor that holds everybody."""
    rng = np.random.default_rng(6)
    tracks = []
    for number in range(12):
        line = np.cumsum(rng.normal([0.5, 0.1], 0.3, (40, 2)), axis=0) + rng.normal(0.0, 3.0, 2)
        track = drive(line, number, 1.3)
        tracks.append(replace(track, vclass="pedestrian"))
    network = network_of(tracks, tmp_path)
    assert all(lane.allowed == {"pedestrian"} for lane in network.lanes.values())
    assert share_on(tracks, network) == 1.0


def test_an_island_stays(tmp_path: Path) -> None:
    """A roundabout's middle is not paved."""
    turn = np.linspace(0.0, 2 * np.pi, 200)
    ring = 20.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    arm = np.column_stack([np.full(30, 20.0), np.linspace(-90.0, 0.0, 30)])
    tracks = [drive(np.vstack([arm, ring[1 : 60 + 10 * (n % 12)]]), n) for n in range(24)]
    network = network_of(tracks, tmp_path)
    assert not paved(network).contains(shapely.Point(0.0, 0.0))
    assert share_on(tracks, network) > 0.98


def test_the_same_tracks_give_the_same_network(tmp_path: Path) -> None:
    tracks = motorway(np.random.default_rng(5))
    assert network_text(tracks, file=tmp_path) == network_text(tracks, file=tmp_path)


def test_who_stands_tells_no_road(tmp_path: Path) -> None:
    line = np.array([[0.0, 0.0], [1.0, 0.0]])
    with pytest.raises(InputError, match="too short or too few to tell where roads are"):
        network_text([drive(line, 0, 0.5)], file=tmp_path)
