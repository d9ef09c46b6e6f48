"""Polylines, bands, walls, grids and plane geometry."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.library.mesh.bands import (
    band_along,
    between,
    mitres,
    offset,
    walls,
    with_split_bends,
    without_repeats,
)
from sumo3dviz_pt.library.mesh.planar import (
    closing,
    polygon_parts,
    subtract,
    triangulate,
    triangulate_many,
    union,
)

CORNER = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 1.0], [10.0, 10.0, 2.0]])


def areas(mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def test_repeats_go_but_the_end_stays():
    line = np.array([[0.0, 0, 0], [0.001, 0, 0], [5, 0, 0], [5.001, 0, 7]])
    kept = without_repeats(line)
    assert len(kept) == 2
    assert kept[-1] == pytest.approx([5.001, 0, 7])


def test_offset_meets_at_the_mitre():
    left = offset(CORNER, 1.0)
    assert left[:, :2] == pytest.approx(np.array([[0, 1], [9, 1], [9, 10]]))
    assert left[:, 2] == pytest.approx(CORNER[:, 2])


def test_closed_mitres_go_around():
    square = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
    inward = square + mitres(square, closed=True)
    assert inward == pytest.approx(np.array([[1, 1], [3, 1], [3, 3], [1, 3]]))


def test_sharp_bends_are_split_so_that_strips_keep_their_width():
    hairpin = np.array([[0.0, 0, 0], [20, 0, 0], [0, 3, 0]])
    split = with_split_bends(hairpin)
    assert len(split) == 4
    assert np.linalg.norm(mitres(split), axis=1) == pytest.approx(np.ones(4))
    assert len(with_split_bends(np.array([[0.0, 0, 0], [5, 0, 0], [10, 1, 0]]))) == 3


def test_turning_back_on_the_spot_has_finite_mitres():
    assert np.isfinite(mitres(np.array([[0.0, 0, 0], [5, 0, 0], [0, 0, 0]]))).all()


def test_dashes_have_their_length_and_phase():
    line = np.array([[0.0, 0, 0], [10, 0, 0], [40, 0, 3]])
    quads = band_along(line, right=-0.1, left=0.1).dashes(dash=3.0, gap=3.0)
    starts = np.sort(quads[:, 0, 0])
    assert starts[0] == pytest.approx(1.5)
    area = sum(shapely.Polygon(quad[:, :2]).area for quad in quads)
    assert area == pytest.approx((6 * 3.0 + 2.5) * 0.2)


def test_bands_keep_to_a_reference_line():
    outer = np.array([[0.0, 0, 0], [20, 0, 0]])
    inner = np.array([[0.0, 0, 0], [10, 0, 0]])
    assert band_along(inner, right=-1, left=1, reference=outer).stations[-1] == pytest.approx(20)
    assert len(band_along(inner, right=-1, left=1).quads(9.999, 12.0)) == 0


def test_triangles_fill_a_polygon_with_a_hole():
    shape = shapely.box(1e6, 0, 1e6 + 10, 10).difference(shapely.box(1e6 + 4, 4, 1e6 + 6, 6))
    vertices, faces = triangulate(shape)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (twice > 0).all()
    assert twice.sum() / 2 == pytest.approx(96.0)


def test_many_polygons_know_their_vertices():
    boxes = [shapely.box(k, 0, k + 1, 1) for k in range(3)]
    vertices, faces, owner = triangulate_many(boxes)
    assert len(vertices) == 12 and len(faces) == 6
    assert (np.diff(owner[faces], axis=1) == 0).all()
    assert len(triangulate_many([])[1]) == 0


def test_polygon_parts_drop_lines_and_crumbs():
    mixed = shapely.GeometryCollection(
        [shapely.box(0, 0, 1, 1), shapely.LineString([(0, 0), (9, 9)]), shapely.box(5, 5, 5.001, 5)]
    )
    assert [part.area for part in polygon_parts(mixed)] == [1.0]
    bow_tie = shapely.Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])
    assert sum(part.area for part in polygon_parts(bow_tie)) == pytest.approx(2.0)
    assert polygon_parts(shapely.Polygon()) == []


def test_a_sliver_without_area_is_closed_without_a_word():
    """Pytest makes errors of warnings."""
    sliver = shapely.Polygon([(77.29, 13.14), (71.45, 15.78), (74.37, 14.46)])
    assert closing(sliver, 0.25).area < 1e-6


def test_union_subtract_and_closing():
    boxes = [shapely.box(0, 0, 1, 1), shapely.box(1.2, 0, 2, 1)]
    assert union(boxes).area == pytest.approx(1.8)
    assert union([]).is_empty
    assert closing(union(boxes), 0.15).area == pytest.approx(2.0)
    assert subtract(boxes[0], [shapely.box(0, 0, 0.5, 1), boxes[1]]).area == pytest.approx(0.5)


def test_walls_face_outwards():
    ring = np.array([[0.0, 0, 1], [4, 0, 1], [4, 4, 1], [0, 4, 1]])
    mesh = walls([ring], [ring - [0, 0, 1]])
    centres = mesh.vertices[mesh.faces].mean(axis=1) - [2, 2, 0.5]
    assert (np.sum(centres * areas(mesh), axis=1) > 0).all()
    assert np.linalg.norm(areas(mesh), axis=1).sum() / 2 == pytest.approx(16.0)
    assert len(between(ring, ring - [0, 0, 1]).faces) == 6
