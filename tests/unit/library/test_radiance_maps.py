import logging
import struct

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.library.pictures import read_radiance_map

RNG = np.random.default_rng(6)


def rgbe(image):
    """Shared-exponent bytes, (h, w, 4)."""
    peak = image.max(axis=-1)
    mantissa, exponent = np.frexp(peak)
    scale = np.where(peak > 1e-32, mantissa * 256 / np.maximum(peak, 1e-32), 0)
    codes = np.dstack([(image * scale[..., None]).astype(np.uint8), (exponent + 128)])
    codes[peak <= 1e-32] = 0
    return codes.astype(np.uint8)


def packed(codes, *, runs):
    """Run-length coded rows, as Radiance writes them."""
    width = codes.shape[1]
    out = b""
    for row in codes:
        out += struct.pack(">BBH", 2, 2, width)
        for channel in row.T:
            if runs and (channel == channel[0]).all():
                for start in range(0, width, 100):
                    out += bytes([128 + min(100, width - start), channel[0]])
            else:
                for start in range(0, width, 128):
                    piece = channel[start : start + 128]
                    out += bytes([len(piece)]) + piece.tobytes()
    return out


def hdr(codes, body):
    height, width = codes.shape[:2]
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + body


@pytest.fixture
def image():
    values = RNG.gamma(0.6, 2.0, (70, 140, 3)).astype(np.float32)
    values[3], values[5] = 0.0, 0.75
    return values


@pytest.mark.parametrize("kind", ["runs", "literals", "flat"])
def test_hdr_files_are_read(tmp_path, image, kind):
    codes = rgbe(image)
    body = codes.tobytes() if kind == "flat" else packed(codes, runs=kind == "runs")
    (tmp_path / "a.hdr").write_bytes(hdr(codes, body))
    again = read_radiance_map(tmp_path / "a.hdr")
    assert again.shape == image.shape
    assert (np.abs(again - image) <= image.max(axis=-1, keepdims=True) / 127 + 1e-9).all()
    assert (again[3] == 0).all() and (again[5] == 0.75).all()


def test_exr_maps_are_read_and_cleaned(tmp_path, image, caplog):
    image[0, 0], image[1, 1] = np.inf, -1.0
    write_exr(tmp_path / "a.exr", {"radiance": image}, half=False)
    with caplog.at_level(logging.WARNING):
        again = read_radiance_map(tmp_path / "a.exr")
    assert "6 values" in caplog.text
    assert (again[0, 0] == 65504).all() and (again[1, 1] == 0).all()
    assert np.array_equal(again[2:], image[2:])


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.jpg", b"x", r"must be one of \.exr, \.hdr"),
        ("a.hdr", None, "no such file"),
        ("a.hdr", b"no picture", "not a Radiance HDR"),
        ("a.exr", b"no picture", "not a readable OpenEXR"),
        ("a.hdr", b"#?RADIANCE\n\n-Y 8 +X 16\n" + bytes(30), "cut off"),
        ("a.hdr", b"#?RADIANCE\n\n-Y 2 +X 16\n" + bytes([2, 2, 0, 16, 0, 0, 0]), "cut off"),
        ("a.hdr", b"#?RADIANCE\n\n-Y 8 +X 8\n" + bytes(256), "twice as wide"),
    ],
)
def test_bad_maps_are_one_sentence(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_radiance_map(tmp_path / name)


def test_damaged_rows_are_found(tmp_path, image):
    codes = rgbe(image)
    body = packed(codes, runs=False)
    stride = len(body) // 70
    broken = body[:stride] + b"\x01" + body[stride + 1 :]
    (tmp_path / "a.hdr").write_bytes(hdr(codes, broken))
    with pytest.raises(InputError, match="damaged"):
        read_radiance_map(tmp_path / "a.hdr")


def test_depth_only_exr_is_refused(tmp_path):
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"Z": np.zeros((2, 4), np.float32)}) as file:
        file.write(str(tmp_path / "z.exr"))
    with pytest.raises(InputError, match="no R, G and B"):
        read_radiance_map(tmp_path / "z.exr")
