"""The denoiser."""

import numpy as np

from sumo3dviz_pt.render.passes import finish

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


def test_a_gpu_that_the_denoiser_does_not_know_leaves_it_to_the_processor(monkeypatch, caplog):
    """As is so on all machines without CUDA: the library refuses the device."""
    monkeypatch.setattr(finish.mi, "variant", lambda: "cuda_ad_rgb")
    finish._found_device.cache_clear()
    noisy = np.random.default_rng(0).random((54, 96, 3)).astype(np.float32)
    if finish.denoiser_device() == "cuda":
        assert np.abs(denoise(noisy, quality="fast") - 0.5).mean() < 0.1
        return
    assert "the denoiser cannot use the GPU" in caplog.text
    on_gpu = denoise(noisy, quality="fast")
    monkeypatch.undo()
    np.testing.assert_array_equal(on_gpu, denoise(noisy, quality="fast"))
