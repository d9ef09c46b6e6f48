"""The denoiser."""

import numpy as np

from sumo3dviz_pt.render.passes.finish import denoise  # isort: skip  (it chooses libLLVM)

import drjit as dr


def test_pictures_are_the_same_with_any_number_of_threads():
    """The denoiser adds in another order with another number of its own."""
    noisy = np.random.default_rng(0).random((54, 96, 3)).astype(np.float32)
    before = dr.thread_count()
    found = []
    try:
        for threads in (1, 2, 3, 5):
            dr.set_thread_count(threads)
            found.append(denoise(noisy, quality="fast"))
    finally:
        dr.set_thread_count(before)
    assert all(np.array_equal(one, found[0]) for one in found)
