"""Errors of a picture against a reference."""

import numpy as np
import pytest

from sumo3dviz_pt.report.convergence.plan import CAP, PictureLook, Reference, score

SHAPE = (24, 32, 3)


def reference_of(radiance, sky=None, capped=None):
    mask = np.zeros(SHAPE[:2], bool) if sky is None else sky
    kept = radiance if capped is None else capped
    return Reference(radiance, kept, mask, 64, 0.0, (radiance, radiance))


def street(seed=1):
    return np.random.default_rng(seed).uniform(0.05, 0.8, SHAPE).astype(np.float32)


@pytest.mark.parametrize("exposure", [-3.0, 0.0, 4.0])
def test_the_reference_itself_has_no_error(exposure):
    truth = street() * np.float32(2.0**-exposure)
    scores = score(truth, reference_of(truth), PictureLook(exposure, "neutral"), capped=truth)
    for name in ("rmse_capped", "relmse", "relmse_trim", "flip", "flip_p99", "hdrflip"):
        assert scores[name] == 0, name
    assert scores["ssim"] == pytest.approx(1) and scores["psnr"] == np.inf
    assert scores["mean_bias"] == pytest.approx(0, abs=1e-7)


def test_errors_do_not_depend_on_the_exposure_of_a_scene():
    """The same picture, a thousand times dimmer and exposed for it."""
    truth, picture = street(1), street(2)
    bright = score(picture, reference_of(truth), PictureLook(0.0, "neutral"))
    dim = score(picture / 1024, reference_of(truth / 1024), PictureLook(10.0, "neutral"))
    for name, value in bright.items():
        assert dim[name] == pytest.approx(value, rel=1e-3, abs=1e-6), name


def test_bias_spares_the_sky_and_the_suns_image_in_glass():
    truth = street()
    truth[0, 0] = 2 * CAP
    sky = np.zeros(SHAPE[:2], bool)
    sky[5] = True
    picture = truth * 1.1
    picture[0, 0] = 0
    picture[5] = 0
    scores = score(picture, reference_of(truth, sky), PictureLook(0.0, "neutral"))
    assert scores["mean_bias"] == pytest.approx(0.1, rel=1e-4)


def test_samples_capped_one_by_one_are_compared_with_their_like():
    truth, capped = street(1), street(2)
    reference = reference_of(truth, capped=capped)
    scores = score(truth, reference, PictureLook(0.0, "neutral"), capped=capped + 0.25)
    assert scores["rmse_capped"] == pytest.approx(0.25, rel=1e-5)
    assert scores["flip"] == 0


def test_hdr_flip_can_be_left_out():
    truth = street()
    scores = score(truth, reference_of(truth), PictureLook(0.0, "neutral"), exposures=False)
    assert np.isnan(scores["hdrflip"]) and scores["flip"] == 0
