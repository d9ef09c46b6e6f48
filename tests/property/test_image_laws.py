import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from searching import tries

from sumo3dviz_pt.image.exr import read_exr, write_exr
from sumo3dviz_pt.image.tonemap import TONES, develop_float, tone_names
from sumo3dviz_pt.video.encoder import yuv709

RADIANCE = st.floats(0, 1e4, width=32)
TRIPLES = hnp.arrays(np.float32, (3,), elements=RADIANCE)


@pytest.mark.parametrize("name", tone_names())
@given(colour=TRIPLES)
def test_curves_are_bounded(name, colour):
    light = TONES[name](colour[None])
    assert light.shape == (1, 3)
    assert np.isfinite(light).all() and light.min() >= 0 and light.max() <= 1


@pytest.mark.parametrize("name", tone_names())
@given(first=RADIANCE, second=RADIANCE)
def test_curves_are_monotone_in_grey(name, first, second):
    low, high = sorted((first, second))
    greys = np.float32([[low] * 3, [high] * 3])
    dark, bright = TONES[name](greys)
    assert (bright >= dark - 2e-6).all()


@given(
    image=hnp.arrays(np.float32, (3, 4, 3), elements=RADIANCE),
    exposure=st.floats(-8, 8),
    tone=st.sampled_from(tone_names()),
)
def test_developing_never_leaves_the_code_range(image, exposure, tone):
    codes = develop_float(image, exposure=exposure, tone=tone)
    assert codes.min() >= 0 and codes.max() <= 1


@settings(max_examples=tries(15), deadline=None)
@given(image=hnp.arrays(np.float32, (5, 3, 3), elements=st.floats(-1e4, 1e4, width=32)))
def test_what_is_written_is_read(tmp_path_factory, image):
    path = tmp_path_factory.mktemp("exr") / "a.exr"
    write_exr(path, {"radiance": image}, half=False)
    assert np.array_equal(read_exr(path)[0], image)


def rgb_of(planes, bits):
    """The standard's inverse, written independently of the code under test."""
    scale = 2 ** (bits - 8)
    luma = (planes[0].astype(float) / scale - 16) / 219
    blue, red = ((plane.astype(float) / scale - 128) / 224 for plane in planes[1:])
    blue, red = (np.kron(plane, np.ones((2, 2))) for plane in (blue, red))
    r, b = luma + 1.5748 * red, luma + 1.8556 * blue
    return np.stack([r, (luma - 0.2126 * r - 0.0722 * b) / 0.7152, b], axis=-1)


@settings(max_examples=tries(20), deadline=None)
@given(seed=st.integers(0, 2**32 - 1), bits=st.sampled_from([8, 10]))
def test_yuv_round_trip_has_no_bias(seed, bits):
    rng = np.random.default_rng(seed)
    blocks = rng.uniform(0.02, 0.98, (96, 96, 3)).astype(np.float32)
    rgb = np.kron(blocks, np.ones((2, 2, 1), np.float32))
    again = rgb_of(yuv709(rgb, bits=bits, rng=rng if bits == 8 else None), bits)
    assert np.abs(255 * (again - rgb).mean(axis=(0, 1))).max() < 0.05
