"""Boxes of spherical films: written into real films, read back box by box."""

import struct
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path, film_picture
from sumo3dviz_pt.video.spherical import Spherical, spherical_of, write_boxes

ROUND = Lens(2 * np.pi, "equirectangular")
SHADES = (30, 90, 150, 210)


def film(folder, name="a.mp4", codec="auto"):
    path = folder / name
    frames = [np.full((32, 64, 3), (shade, 120, 60), np.uint8) for shade in SHADES]
    encode(frames, path, size=(64, 32), fps=2, codec=codec)
    return path


def box_at(content, *names):
    """The content of a box by the names on its way, found without the module's own reader."""
    skip = {b"stsd": 8, b"avc1": 78, b"hvc1": 78}
    for name in names:
        at = 0
        while True:
            size, kind = struct.unpack(">I4s", content[at : at + 8])
            if kind == name:
                content = content[at + 8 + skip.get(name, 0) : at + size]
                break
            at += size
            assert at < len(content), f"there is no box {name!r}"
    return content


WAY = (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsd", b"avc1")


def test_lenses_become_what_players_know():
    assert spherical_of(Lens(1.0)) is None
    assert spherical_of(ROUND) == Spherical(0, 0.0)
    assert spherical_of(replace(ROUND, opening=np.pi)) == Spherical(0, 0.25)
    assert spherical_of(replace(ROUND, stereo="top_bottom")) == Spherical(1, 0.0)
    assert spherical_of(Lens(1.0, stereo="side_by_side")) == Spherical(2, None)


@pytest.mark.parametrize("what", [Spherical(0, 0.0), Spherical(1, 0.25), Spherical(2, None)])
def test_boxes_are_as_the_specification_has_them(tmp_path, what):
    path = film(tmp_path)
    assert b"st3d" not in path.read_bytes()
    write_boxes(path, what)
    assert what.boxes in path.read_bytes()
    entry = box_at(path.read_bytes(), *WAY)
    assert box_at(entry, b"st3d") == bytes([0, 0, 0, 0, what.stereo])
    if what.cropped is None:
        with pytest.raises((AssertionError, struct.error)):
            box_at(entry, b"sv3d")
        return
    assert box_at(entry, b"sv3d", b"svhd") == b"\0\0\0\0sumo3dviz_pt\0"
    assert struct.unpack(">4i", box_at(entry, b"sv3d", b"proj", b"prhd")) == (0, 0, 0, 0)
    side = round(what.cropped * 2**32)
    bounds = struct.unpack(">5I", box_at(entry, b"sv3d", b"proj", b"equi"))
    assert bounds == (0, 0, 0, side, side)


@pytest.mark.parametrize(
    ("name", "codec"), [("a.mp4", "auto"), ("b.mp4", "h265_10"), ("c.mov", "prores")]
)
def test_films_with_boxes_still_play(tmp_path, name, codec):
    """The tables of offsets grew with what lies before the media."""
    path = film(tmp_path, name, codec)
    before = [film_picture(path, 0.5 * n, size=(64, 32)) for n in range(4)]
    write_boxes(path, Spherical(1, 0.0))
    for n, picture in enumerate(before):
        np.testing.assert_array_equal(film_picture(path, 0.5 * n, size=(64, 32)), picture)
    assert list(tmp_path.iterdir()) == [path]


def test_ffmpeg_reads_the_projection(tmp_path):
    path = film(tmp_path)
    write_boxes(path, Spherical(1, 0.0))
    command = [ffmpeg_path(), "-hide_banner", "-i", str(path)]
    said = subprocess.run(command, capture_output=True, text=True, check=False).stderr
    assert "Spherical Mapping: equirectangular" in said or "spherical: equirectangular" in said
    assert "top and bottom" in said


def test_what_is_no_film_is_refused_and_stays(tmp_path):
    path = tmp_path / "no.mp4"
    path.write_bytes(b"this is no film at all, surely")
    with pytest.raises(RenderError, match="no film"):
        write_boxes(path, Spherical())
    assert path.read_bytes().startswith(b"this is") and len(list(tmp_path.iterdir())) == 1
