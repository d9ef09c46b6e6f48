"""Users' pictures are looked at before Mitsuba reads them."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image as Pillow

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.pictures import check_picture

KINDS = [".png", ".jpg", ".jpeg", ".bmp", ".tga"]
PIXELS = np.random.default_rng(5).integers(0, 256, (37, 53, 3), dtype=np.uint8)


def saved(folder, ending, **how):
    path = folder / f"wall{ending}"
    Pillow.fromarray(PIXELS).save(path, **how)
    return path


def refused(path):
    with pytest.raises(ConfigError) as caught:
        check_picture(path)
    said = str(caught.value)
    assert str(path) in said and len(said.splitlines()) == 1
    return said


@pytest.mark.parametrize("ending", KINDS)
def test_whole_pictures_pass(ending, tmp_path):
    check_picture(saved(tmp_path, ending))


@pytest.mark.parametrize("how", [{"progressive": True}, {"exif": b"Exif\0\0" + b"\xff" * 200}])
def test_jpegs_with_whatever_else_is_in_them_pass(how, tmp_path):
    check_picture(saved(tmp_path, ".jpg", **how))


@pytest.mark.parametrize("ending", [".png", ".jpg", ".bmp", ".tga"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.98])
def test_what_breaks_off_is_refused(ending, share, tmp_path):
    path = saved(tmp_path, ending)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    assert "damaged" in refused(path)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".bmp"])
def test_what_is_something_else_is_refused(ending, tmp_path):
    path = tmp_path / f"wall{ending}"
    path.write_bytes(b"GIF89a" + bytes(200))
    assert "of another kind" in refused(path)


def test_a_flipped_bit_of_a_png_is_found(tmp_path):
    path = saved(tmp_path, ".png")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    assert "damaged" in refused(path)


@pytest.mark.parametrize("size", [(9000, 9000), (40_000, 40_000), (2**31 - 1, 1), (0, 8)])
def test_sizes_beyond_any_picture_are_refused_by_the_header(size, tmp_path):
    def chunk(kind, body):
        return (
            struct.pack(">I4s", len(body), kind) + body + struct.pack(">I", zlib.crc32(kind + body))
        )

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", *size, 8, 2, 0, 0, 0))
    path = tmp_path / "wall.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + head + chunk(b"IEND", b""))
    assert f"{size[0]} x {size[1]}" in refused(path)


def test_files_that_are_not_there_are_named(tmp_path):
    assert "cannot be read" in refused(tmp_path / "none.png")


def test_other_kinds_are_mitsubas_business(tmp_path):
    check_picture(tmp_path / "none.exr")
