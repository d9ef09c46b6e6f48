"""The rounded centre line: against a brute-force average twice over, 2 K - K * K."""

from functools import cache

import numpy as np
import pytest
from drives import arc, network_of

from sumo3dviz_pt.motion.lanes import REACH, TIGHTEST, WIDEST, LaneGraph, Polyline, Tracks

GRAIN = 0.005


def line_of(points):
    """A polyline by its own arc length."""
    shape = np.zeros((len(points), 3))
    shape[:, : np.shape(points)[1]] = points
    steps = np.linalg.norm(np.diff(shape, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return Polyline(along, shape)


def twiced(line, width):
    """Stations and points of the polyline averaged numerically, far from the ends of the grid."""
    reach = 2.0 * width + 1.0
    stations = np.arange(-reach - 8.0, line.stations[-1] + reach + 8.0, GRAIN)
    points = line.corners_at(stations)[0]
    half = round(width / GRAIN)
    kernel = 1.0 - np.abs(np.arange(-half, half + 1)) / (width / GRAIN)
    kernel /= kernel.sum()

    def averaged(values):
        return np.column_stack([np.convolve(axis, kernel, mode="same") for axis in values.T])

    once = averaged(points)
    shown = 2.0 * once - averaged(once)
    inner = slice(2 * half + 2, -2 * half - 2)
    return stations[inner], shown[inner]


BENDS = {
    # Points, and half the width of the triangle that suits them by the module's rules.
    "one corner": ([(0, 0), (30, 0), (60, 15)], TIGHTEST),
    "steep corner": ([(0, 0), (30, 0), (60, 15)], TIGHTEST),
    "square corner": ([(0, 0), (30, 0), (30, 30)], TIGHTEST / np.sqrt(2.0)),
    "corner and ramp": ([(0, 0, 0), (30, 0, 0), (60, 10, 3)], TIGHTEST),
    "three corners": ([(0, 0), (30, 0), (45, 5), (55, 15), (60, 40)], TIGHTEST),
    "faint bend": ([(0, 0), (60, 0), (120, 1.2)], WIDEST),
}


@pytest.mark.parametrize("name", BENDS)
def test_rounding_is_the_average_twice_over(name):
    points, width = BENDS[name]
    line = line_of(points)
    stations, expected = twiced(line, width)
    shown, _ = line.at(stations)
    assert np.abs(shown - expected).max() < 5e-4


@pytest.mark.parametrize("turn", [0.05, 0.1, 0.3, 0.9])
def test_corners_are_cut_by_a_few_centimetres(turn):
    # The triangle of half width w cuts a corner by w / 6 of its turn, twicing by a tenth.
    line = line_of([(0, 0), (60, 0), 60.0 * np.array([1.0 + np.cos(turn), np.sin(turn)])])
    around = 2.0 * np.sin(turn / 2.0)
    width = min(max(0.3 / around, TIGHTEST), WIDEST)
    cut = np.linalg.norm(line.at(np.array([60.0]))[0][0] - [60.0, 0.0, 0.0])
    assert cut == pytest.approx(0.1 * width * around, abs=5e-4)
    assert cut < 0.04 or width == TIGHTEST


def test_a_jog_is_no_bend():
    # A lane that leads aside by 0.4 m within 2 m is crossed straighter than a corner alike.
    jog = line_of([(0, 0), (40, 0), (42, 0.4), (90, 0.4)])
    corner = line_of([(0, 0), (40, 0), (90, 10)])

    def sharpest(line):
        asked = np.arange(0.0, 90.0, 0.1)
        return np.abs(np.diff(line.at(asked)[1], axis=0)).max() / 0.1

    assert sharpest(jog) < 0.5 * sharpest(corner)
    asked = np.array([0.0, 15.0, 70.0])
    np.testing.assert_allclose(jog.at(asked)[0][:, 1], [0.0, 0.0, 0.4], atol=1e-6)


@pytest.mark.parametrize("radius", [8.0, 16.0, 40.0])
def test_arcs_stay_where_they_are(radius):
    line = line_of(arc((0, 0), radius, 0, 180, 60))
    inner = np.linspace(2.5 * WIDEST if radius > 30 else 6.0, line.stations[-1] - 6.0, 300)
    inner = inner[inner < line.stations[-1] - (2.5 * WIDEST if radius > 30 else 6.0)]
    away = np.linalg.norm(line.at(inner)[0][:, :2], axis=1)
    assert np.abs(away - radius).max() < 0.02


def test_straight_lines_are_kept_and_go_on():
    line = line_of([(0, 0, 1), (10, 0, 2), (40, 0, 5)])
    asked = np.array([-500.0, -3.0, 0.0, 7.7, 40.0, 900.0])
    ahead = np.array([10.0, 0.0, 1.0]) / np.sqrt(101.0)
    shown, tangents = line.at(asked)
    np.testing.assert_allclose(shown, [0, 0, 1] + asked[:, None] * ahead, atol=1e-9)
    np.testing.assert_allclose(tangents, np.tile(ahead, (6, 1)), atol=1e-9)


@pytest.mark.parametrize("name", BENDS)
def test_tangents_are_derivatives(name):
    line = line_of(BENDS[name][0])
    asked = np.linspace(-REACH - 5.0, line.stations[-1] + REACH + 5.0, 700)
    slope = (line.at(asked + 1e-5)[0] - line.at(asked - 1e-5)[0]) / 2e-5
    np.testing.assert_allclose(line.at(asked)[1], slope, atol=1e-6)


def test_corners_are_those_of_the_polyline():
    points = np.array([(0, 0, 0), (30, 0, 0), (45, 5, 2), (60, 40, 2)], dtype=float)
    line = line_of(points)
    asked = np.linspace(0.0, line.stations[-1], 200)
    shown, tangents = line.corners_at(asked)
    expected = np.column_stack([np.interp(asked, line.stations, axis) for axis in points.T])
    np.testing.assert_allclose(shown, expected, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1.0)


@pytest.mark.parametrize("far", [1e4, 5e6])
def test_far_from_the_origin_the_line_is_the_same(far):
    points = np.array([(0, 0), (30, 0), (45, 5), (60, 40)], dtype=float)
    asked = np.linspace(-5.0, 80.0, 300)
    near, away = line_of(points).at(asked)[0], line_of(points + far).at(asked)[0]
    np.testing.assert_allclose(away[:, :2] - far, near[:, :2], atol=1e-7)


# Chains ------------------------------------------------------------------------------------


@cache
def gap_tracks():
    """Two lanes that miss each other by 1 m to the side."""
    shapes = {"a_0": [(0, 0), (50, 0)], "b_0": [(50, 1), (100, 1)]}
    return Tracks(LaneGraph(network_of(shapes, [("a_0", "b_0", "")])))


def test_a_track_counts_from_its_own_beginning():
    track = gap_tracks().along([("a_0", 130.0)])
    asked = np.array([130.0, 142.0, 180.0])
    for shown, _ in (track.at(asked), track.corners_at(asked)):
        np.testing.assert_allclose(shown, [[0, 0, 0], [12, 0, 0], [50, 0, 0]], atol=1e-9)


def test_lines_are_made_once():
    tracks = gap_tracks()
    one, two = (
        tracks.along([("a_0", 0.0), ("b_0", 50.0)]),
        tracks.along([("a_0", 70.0), ("b_0", 120.0)]),
    )
    assert one.line is two.line
    np.testing.assert_allclose(one.at(np.array([60.0]))[0], two.at(np.array([130.0]))[0])


def test_lanes_that_do_not_join_meet_in_the_middle():
    track = gap_tracks().along([("a_0", 0.0), ("b_0", 50.0)])
    shown, _ = track.corners_at(np.array([0.0, 45.9, 50.0, 54.1, 100.0]))
    np.testing.assert_allclose(shown[:, 1], [0.0, 0.0, 0.5, 1.0, 1.0], atol=1e-9)
    asked = np.linspace(0.0, 100.0, 4001)
    steps = np.linalg.norm(np.diff(track.at(asked)[0], axis=0), axis=1)
    assert steps.max() < 1.05 * 0.025


def test_lanes_of_a_bend_join_without_a_seam():
    whole = arc((0, 12), 12.0, -90, 90, 41)
    shapes = {"a_0": whole[:15], "b_0": whole[14:28], "c_0": whole[27:]}
    graph = LaneGraph(network_of(shapes, [("a_0", "b_0", ""), ("b_0", "c_0", "")]))
    begins = np.cumsum([0.0, graph.length("a_0"), graph.length("b_0")])
    track = Tracks(graph).along(list(zip(shapes, begins.tolist(), strict=True)))
    asked = np.linspace(0.0, begins[2] + graph.length("c_0"), 300)
    np.testing.assert_allclose(track.at(asked)[0], line_of(whole).at(asked)[0], atol=1e-6)
