"""Edge density on pictures whose edges are known."""

import numpy as np
import pytest

from sumo3dviz_pt.image.metrics import edge_density, edges


def test_flat_pictures_have_no_edges():
    assert edge_density(np.full((20, 30), 0.4)) == 0.0
    assert edge_density(np.zeros((1, 1))) == 0.0


@pytest.mark.parametrize("turned", [False, True])
def test_a_step_is_one_line_of_edges(turned):
    luma = np.zeros((40, 40))
    luma[:, 20:] = 1.0
    found = edges(luma.T if turned else luma)
    lines = found.T if turned else found
    assert lines.any(axis=1).all() and lines[:, 19:21].sum() == lines.sum()
    assert lines.sum() == 40


def test_more_things_make_more_clutter():
    few, many = np.zeros((64, 64)), np.zeros((64, 64))
    few[8:24, 8:24] = 0.8
    for row in range(4, 60, 14):
        for column in range(4, 60, 14):
            many[row : row + 7, column : column + 7] = 0.8
    assert 0.0 < edge_density(few) < 0.5 * edge_density(many) < 0.5


def test_faint_steps_count_only_beside_strong_ones():
    faint = np.zeros((30, 60))
    faint[:, 30:] = 0.08
    assert edge_density(faint) == 0.0
    going_on = faint.copy()
    going_on[:, 30:] = np.linspace(0.3, 0.08, 30)[:, None]
    assert edges(going_on)[:, 28:32].any(axis=1).all()


def test_thresholds_do_not_depend_on_the_strongest_edge():
    one = np.zeros((30, 60))
    one[:, 20:] = 0.3
    two = one.copy()
    two[:, 50:] = 1.0
    assert (edges(one)[:, :40] == edges(two)[:, :40]).all()
