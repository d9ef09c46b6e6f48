"""The smallest and the largest pictures, and the fewest and the most samples."""

import numpy as np
import pytest
from builders import (
    RAW,
    ball,
    diffuse,
    frame_of,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
    write_scenario,
)
from scipy import stats

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.scene import Sky

pytestmark = pytest.mark.slow

EYE = view_at([0, 0, 2], pitch=-6)


def scene():
    """Grey ground, a mirror ball and a sky with a bright side."""
    image = np.full((16, 32, 3), 0.3, dtype=np.float32)
    image[4:6, 3:6] = 5.0
    parts = [static("g", plane(60), "grey"), static("b", ball((1, 9, 1.5), 1.5), "chrome")]
    materials = {"grey": diffuse(0.4), "chrome": MATERIALS["chrome"]}
    return scene_of(parts, materials, sky=Sky(None, image=image))


def quality(spp, pass_spp, **more):
    """Raw samples."""
    return RAW.model_copy(update={"spp": spp, "pass_spp": pass_spp, **more})


def test_4096_samples_agree_with_many_runs_of_16():
    """z-test of all 192 values of 8 x 8 pixels, Sidak-corrected to 1 %."""
    with session_of(scene(), size=(8, 8), quality=quality(4096, 64)) as session:
        many = session.render(frame_of(EYE, time=1000.0))
    assert many.tally.passes == 64 and np.isfinite(many.radiance).all()
    with session_of(scene(), size=(8, 8), quality=quality(16, 16)) as session:
        runs = np.array(
            [session.render(frame_of(EYE, time=float(n))).radiance for n in range(64)],
            dtype=np.float64,
        )
    # A run of 4096 has at most the variance of 256 runs of 16 together.
    error = np.sqrt(runs.var(axis=0, ddof=1) * (1 / len(runs) + 16 / 4096))
    t = (runs.mean(axis=0) - many.radiance) / np.maximum(error, 1e-5)
    alpha = 1 - (1 - 0.01) ** (1 / t.size)
    assert np.abs(t).max() < stats.t.ppf(1 - alpha / 2, df=len(runs) - 1)
    assert np.abs(t.mean()) < 0.5


def test_one_sample_is_unbiased():
    """The mean over 300 frames of one sample is that of 4096 samples."""
    with session_of(scene(), size=(8, 8), quality=quality(4096, 64)) as session:
        truth = session.render(frame_of(EYE, time=1000.0)).radiance.mean()
    with session_of(scene(), size=(8, 8), quality=quality(1, 4)) as session:
        runs = [session.render(frame_of(EYE, time=float(n))).radiance.mean() for n in range(300)]
    assert abs(np.mean(runs) - truth) < 4 * np.std(runs) / np.sqrt(len(runs))


def test_uhd_with_every_step_on():
    """3840 x 2160 at one sample, capped, denoised; 8 million pixels, 25 million values."""
    best = quality(1, 4, cap=40.0, denoise="fast", guides=False, max_depth=3)
    with session_of(scene(), size=(3840, 2160), quality=best) as session:
        rendered = session.render(frame_of(EYE))
    assert rendered.radiance.shape == (2160, 3840, 3)
    assert np.isfinite(rendered.radiance).all() and rendered.radiance.min() >= 0
    with session_of(scene(), size=(48, 27), quality=quality(256, 64, max_depth=3)) as session:
        small = session.render(frame_of(EYE)).radiance
    large = rendered.radiance.reshape(27, 80, 48, 80, 3).mean(axis=(1, 3))
    assert large.mean() == pytest.approx(small.mean(), rel=0.02)
    # Blocks beside the ball, whose outline and shade are not the same at both sizes.
    np.testing.assert_allclose(large[-6:, :8], small[-6:, :8], rtol=0.1)


@pytest.mark.parametrize("denoise", ["fast", "balanced", "high"])
def test_8_by_8_is_denoised_like_any_other(denoise):
    """OIDN works in tiles; a picture smaller than one keeps its mean."""
    with session_of(scene(), size=(8, 8), quality=quality(16, 16)) as session:
        raw = session.render(frame_of(EYE)).radiance
    with session_of(scene(), size=(8, 8), quality=quality(16, 16, denoise=denoise)) as session:
        clean = session.render(frame_of(EYE)).radiance
    assert np.isfinite(clean).all() and clean.min() >= 0
    assert clean.mean() == pytest.approx(raw.mean(), rel=0.05)


def test_a_film_of_one_frame(tmp_path):
    """It has one EXR frame, equal to the still, and plays."""
    place = write_scenario(tmp_path, vehicles=2)
    target = tmp_path / "film.mp4"
    common = ["--camera", "post", "--size", "32x18", "--spp", "2"]
    times = ["--from", "4", "--to", "4.1", "--fps", "10"]
    assert main(["render", str(place), *times, *common, "-o", str(target)]) == 0
    frames = sorted((tmp_path / "film.frames").glob("*.exr"))
    assert len(frames) == 1 and target.stat().st_size > 500
    still = tmp_path / "still.exr"
    assert main(["still", str(place), "--time", "4", *common, "-o", str(still)]) == 0
    np.testing.assert_array_equal(read_exr(frames[0])[0], read_exr(still)[0])
