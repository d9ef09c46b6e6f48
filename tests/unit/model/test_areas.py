"""Rectangles of a picture."""

import numpy as np
import pytest

from sumo3dviz_pt.model.layers import PixelArea

AREA = PixelArea((3, 7), (2, 12))


def test_it_holds_all_pixels_of_a_mask_and_no_row_or_column_more():
    there = np.zeros((10, 20), np.bool_)
    there[3, 5] = there[6, 2] = there[4, 11] = True
    assert PixelArea.around(there) == AREA
    assert PixelArea.around(there[:3]) is None
    assert PixelArea.around(np.ones((4, 5), np.bool_)) == PixelArea((0, 4), (0, 5))


def test_it_is_a_part_of_an_array():
    array = np.arange(200).reshape(10, 20)
    assert AREA.size == array[AREA.slices].shape == (4, 10)
    assert AREA.pixels == 40
    np.testing.assert_array_equal(array[3:][AREA.below(3).slices], array[AREA.slices])


@pytest.mark.parametrize(
    ("rows", "kept"), [((0, 10), (3, 7)), ((4, 6), (4, 6)), ((5, 10), (5, 7)), ((0, 4), (3, 4))]
)
def test_some_rows_hold_a_part_of_it(rows, kept):
    assert AREA.within(*rows) == PixelArea(kept, AREA.columns)


@pytest.mark.parametrize("rows", [(0, 3), (7, 10), (5, 5)])
def test_other_rows_hold_nothing_of_it(rows):
    assert AREA.within(*rows) is None
