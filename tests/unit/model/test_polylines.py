"""Points along many polylines are those along each of them."""

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.model.geometry import arc_length, evenly_along, from_above


def lines():
    rng = np.random.default_rng(3)
    sizes = [2, 3, 2, 9, 3, 2, 40]
    made = [np.cumsum(rng.uniform(-1.0, 4.0, (size, 3)), axis=0) for size in sizes]
    return [*made, np.array([[5.0, 6.0, 7.0], [5.0, 6.0, 7.0]])]


def count(lengths):
    return np.maximum(np.ceil(lengths / 2.0).astype(np.int64) + 1, 2)


def test_they_divide_each_line_evenly_from_end_to_end():
    found = evenly_along(lines(), count)
    first = 0
    for line in lines():
        along = arc_length(line[:, :2])
        at = np.linspace(0.0, along[-1], int(count(along[-1:])[0]))
        own = slice(first, first + len(at))
        wanted = np.column_stack([np.interp(at, along, axis) for axis in line.T])
        # To the last bit: what stands beside a road must not move with how it is computed.
        assert np.array_equal(found.points[own], wanted)
        assert np.array_equal(found.points[own][[0, -1]], line[[0, -1]])
        first += len(at)
    assert first == len(found.points) == len(found.sides)


def test_each_lies_on_its_side():
    corner = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 1.0]])
    found = evenly_along([corner], lambda lengths: np.array([5]))
    assert found.points[:, :2].tolist() == [[0, 0], [2, 0], [4, 0], [4, 2], [4, 4]]
    assert found.sides.tolist() == [[4, 0, 0]] * 2 + [[0, 4, 1]] * 3


def test_no_lines_have_no_points():
    assert evenly_along([], count).points.shape == (0, 3)
    assert len(from_above([])) == 0


def test_geometries_have_the_vertices_of_their_lines():
    for line, shape in zip(lines(), from_above(lines()), strict=True):
        assert np.array_equal(shapely.get_coordinates(shape), line[:, :2])
        assert shape.length == pytest.approx(arc_length(line[:, :2])[-1])
