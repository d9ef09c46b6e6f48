"""A container that tells players another rhythm or other colours is found; ours tell none."""

import struct
import subprocess
from fractions import Fraction

import numpy as np
import pytest

from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.codecs import CODECS
from sumo3dviz_pt.video.containers import Wanted, container_faults
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path
from sumo3dviz_pt.video.prints import film_prints

SIZE = (64, 36)


def written(path, codec="h264", fps=25):
    rng = np.random.default_rng(0)
    start = rng.random((4, 4, 3)).repeat(9, 0).repeat(16, 1) * 0.5
    pictures = [(start + number * 0.02).astype(np.float32) for number in range(6)]
    encode(pictures, path, size=SIZE, fps=fps, codec=codec, comment={"made_by": "test"})
    return path


def faults(path, codec="h264", fps="25", sound=False):
    kind = CODECS[codec]
    words = film_prints(path, codec=kind, size=SIZE).words
    found = container_faults(path, words, Wanted(kind, SIZE, Fraction(fps), sound))
    return [what for what, _ in found]


KINDS = [(name, ending) for name, codec in CODECS.items() for ending in codec.suffixes]


@pytest.mark.parametrize("rate", ["25", "30000/1001", "2997/100", "10"])
@pytest.mark.parametrize(("codec", "ending"), KINDS)
def test_what_we_write_is_clean(codec, ending, rate, tmp_path):
    path = written(tmp_path / f"a{ending}", codec, rate)
    assert faults(path, codec, rate) == []


def remuxed(*options, ending=".mp4"):
    def spoil(path):
        again = path.with_name(f"again{ending}")
        before, after = options
        command = [ffmpeg_path(), "-loglevel", "error", *before, "-i", str(path), "-c", "copy"]
        subprocess.run([*command, *after, str(again)], check=True)
        again.replace(path)

    return spoil


def patched(box, at, old, new):
    """Write other bytes into a box, so far behind its name."""

    def spoil(path):
        content = path.read_bytes()
        place = content.index(box) + 4 + at
        assert content[place : place + len(old)] == old, content[place : place + len(old)]
        path.write_bytes(content[:place] + new + content[place + len(old) :])

    return spoil


def long(*numbers):
    return struct.pack(f">{len(numbers)}I", *numbers)


def audio(path):
    again = path.with_name("again.mp4")
    command = [ffmpeg_path(), "-loglevel", "error", "-i", str(path), "-f", "lavfi", "-t", "0.2"]
    command += ["-i", "sine", "-c:v", "copy", str(again)]
    subprocess.run(command, check=True)
    again.replace(path)


METADATA = "h264_metadata="
SPOILT = {
    "a percent faster": (remuxed(["-itsscale", "0.99"], []), "is shown at"),
    "a thousandth slower": (remuxed(["-itsscale", "1.001"], []), "is shown at|frame rate"),
    "one picture late": (
        remuxed([], ["-bsf:v", r"setts=pts=PTS+150*eq(N\,3):dts=DTS"]), "is shown at"),
    "a longer last picture": (patched(b"mvhd", 16, long(240), long(480)), "lasts"),
    "twice the speed": (patched(b"mvhd", 20, long(1 << 16), long(2 << 16)), "speed"),
    "an edit list that begins later": (patched(b"elst", 12, long(1024), long(1536)), "edit list"),
    "an edit list that ends earlier": (patched(b"elst", 8, long(240), long(200)), "edit list"),
    "an edit list at half speed": (
        patched(b"elst", 16, long(1 << 16), long(1 << 15)), "edit list"),
    "matrix of BT.601": (remuxed([], ["-bsf:v", f"{METADATA}matrix_coefficients=6"]), "colours"),
    "primaries of BT.2020": (remuxed([], ["-bsf:v", f"{METADATA}colour_primaries=9"]), "colours"),
    "transfer of PQ": (
        remuxed([], ["-bsf:v", f"{METADATA}transfer_characteristics=16"]), "colours"),
    "full range": (remuxed([], ["-bsf:v", f"{METADATA}video_full_range_flag=1"]), "colours"),
    "the box's matrix alone": (patched(b"colr", 8, b"\0\1", b"\0\6"), "colours"),
    "the box's transfer alone": (patched(b"colr", 6, b"\0\1", b"\0\x10"), "colours"),
    "the box's range alone": (patched(b"colr", 10, b"\0", b"\x80"), "colours"),
    "pixels that are no squares": (
        remuxed([], ["-bsf:v", f"{METADATA}sample_aspect_ratio=4/3"]), "stretch|squares"),
    "turned by 90 degrees": (remuxed(["-display_rotation:v:0", "90"], []), "turn"),
    "cropped by its stream": (remuxed([], ["-bsf:v", f"{METADATA}crop_right=16"]), "pixels large"),
    "shown larger": (patched(b"tkhd", 76, long(64 << 16), long(96 << 16)), "stretch"),
    "sound": (audio, "holds"),
}  # fmt: skip


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    return written(tmp_path_factory.mktemp("containers") / "a.mp4")


@pytest.mark.parametrize("name", SPOILT)
def test_a_container_that_tells_players_otherwise_is_found(name, clean, tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(clean.read_bytes())
    spoil, said = SPOILT[name]
    spoil(path)
    found = faults(path)
    assert any(word in what for word in said.split("|") for what in found), found


MATROSKA = {
    "matrix": (b"\x55\xb1\x81\x01", b"\x55\xb1\x81\x06", "matrix"),
    "range": (b"\x55\xb9\x81\x01", b"\x55\xb9\x81\x02", "range"),
}


@pytest.mark.parametrize("name", MATROSKA)
@pytest.mark.parametrize(("codec", "ending"), [("h264", ".mkv"), ("vp9", ".webm")])
def test_a_matroska_file_that_tells_players_other_colours_is_found(name, codec, ending, tmp_path):
    path = written(tmp_path / f"a{ending}", codec)
    old, new, said = MATROSKA[name]
    assert path.read_bytes().count(old) == 1
    path.write_bytes(path.read_bytes().replace(old, new))
    assert any(said in what for what in faults(path, codec))


def test_a_slower_matroska_file_is_found(tmp_path):
    path = written(tmp_path / "a.mkv")
    remuxed(["-itsscale", "1.01"], [], ending=".mkv")(path)
    assert any("is shown at" in what for what in faults(path))
