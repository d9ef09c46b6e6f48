import numpy as np
import pytest

from sumo3dviz_pt.report.plots import choose_windows

FLAT = np.full((90, 160, 3), 0.5, dtype=np.float32)


def test_the_first_window_is_where_the_error_is():
    error = np.zeros((90, 160), dtype=np.float32)
    error[60:70, 100:112] = 1
    first = choose_windows(FLAT, [error])[0]
    assert first.of(error[..., None]).sum() == pytest.approx(120)


def test_edges_count_where_nothing_is_wrong():
    picture = FLAT.copy()
    picture[10:20, 20:40] = np.random.default_rng(1).uniform(0, 1, (10, 20, 3))
    first = choose_windows(picture, [np.zeros((90, 160), dtype=np.float32)])[0]
    assert first.row < 20 and first.column < 40


@pytest.mark.parametrize("size", [(1, 1), (2, 9), (9, 2), (54, 96), (216, 384)])
def test_windows_lie_inside_and_apart(size):
    rng = np.random.default_rng(2)
    picture = rng.uniform(0, 1, (*size, 3)).astype(np.float32)
    windows = choose_windows(picture, [rng.uniform(0, 1, size).astype(np.float32)], count=3)
    assert windows
    seen = np.zeros(size, dtype=int)
    for window in windows:
        cut = window.of(seen[..., None])
        assert cut.shape[:2] == (window.height, window.width)
        cut += 1
    assert seen.max() == 1
