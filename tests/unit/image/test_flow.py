"""Flow in KITTI's form."""

import numpy as np
import pytest
from builders import view_at

from sumo3dviz_pt.image.layers import flow_of, read_flow, read_numbers, write_flow


def test_files_keep_flow_to_a_128th_of_a_pixel(tmp_path):
    rng = np.random.default_rng(5)
    flow = rng.uniform(-500, 500, (6, 9, 2)).astype(np.float32)
    known = rng.random((6, 9)) < 0.7
    write_flow(tmp_path / "a.png", flow, known)
    found, valid = read_flow(tmp_path / "a.png")
    np.testing.assert_array_equal(valid, known)
    assert np.abs(found - flow)[known].max() <= 1 / 128 + 1e-4
    assert (found[~known] == 0.0).all()


def test_the_form_is_kittis(tmp_path):
    flow = np.array([[[1.0, -2.0], [0.0, 0.0]]], np.float32)
    write_flow(tmp_path / "a.png", flow, np.array([[True, False]]))
    numbers = read_numbers(tmp_path / "a.png")
    assert numbers.tolist() == [[[64 + 2**15, 2**15 - 128, 1], [0, 0, 0]]]


def test_what_gets_behind_the_camera_or_too_far_has_no_flow():
    view = view_at((0, 0, 0), heading=0)
    places = np.array([[[0.0, 5.0, 0.0], [0.0, -5.0, 0.0], [99.0, 1.0, 0.0]]])
    directions = np.tile([0.0, 1.0, 0.0], (1, 3, 1))
    flow, known = flow_of(places, directions, np.zeros((1, 3), bool), view=view)
    assert known.tolist() == [[True, False, True]]
    assert flow[0, 0] == pytest.approx([1.0, 0.0])
    assert (flow[0, 1] == 0.0).all()
    places[0, 2, 0] = 9999.0
    _, known = flow_of(places, directions, np.zeros((1, 3), bool), view=view)
    assert not known[0, 2]


def test_what_moves_right_and_down_has_flow_that_is_positive():
    view = view_at((0, 0, 0), heading=0)
    rays = view.lens.rays((5, 3)) @ view.world_from_camera.matrix[:3, :3].T
    sky = np.zeros((3, 5), bool)
    places = 20.0 * rays
    still, _ = flow_of(places, rays, sky, view=view)
    np.testing.assert_allclose(still, 0.0, atol=1e-4)
    for way, sign in (((1.0, 0.0, 0.0), (1, 0)), ((0.0, 0.0, -1.0), (0, 1))):
        flow, known = flow_of(places + way, rays, sky, view=view)
        assert known.all()
        assert np.sign(np.round(flow[1, 2], 3)).tolist() == list(sign)
