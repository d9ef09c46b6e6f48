"""Arrays as Dr.Jit reads them in place."""

import numpy as np

from sumo3dviz_pt.render.backend import choose_backend

choose_backend("llvm")

from sumo3dviz_pt.render.kernels import aligned_zeros, in_place  # noqa: E402


def test_only_what_lies_elsewhere_is_copied():
    whole = aligned_zeros((50, 4), np.float32)
    assert whole.ctypes.data % 64 == 0 and not whole.any()
    whole[:] = np.arange(200).reshape(50, 4)
    assert np.shares_memory(in_place(whole, np.float32), whole)
    for values in (whole[1:], whole.T, whole[:, :2], whole.astype(np.float64)):
        found = in_place(values, np.float32)
        assert not np.shares_memory(found, values) and found.ctypes.data % 64 == 0
        np.testing.assert_array_equal(found, values.ravel())
