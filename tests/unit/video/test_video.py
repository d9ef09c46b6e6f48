import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

from sumo3dviz_pt.errors import ConfigError, InputError, RenderError
from sumo3dviz_pt.video import CODECS, encode, encoder, frame_rate, probe
from sumo3dviz_pt.video.encoder import yuv709
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path, has_encoder

SIZE = (64, 48)


def colours(index=0):
    """Smooth colours, so that lossy coding hardly matters."""
    x, y = np.linspace(0.1, 0.9, SIZE[0]), np.linspace(0.2, 0.8, SIZE[1])[:, None]
    red, green = np.broadcast_to(x, (SIZE[1], SIZE[0])), np.broadcast_to(y, (SIZE[1], SIZE[0]))
    return np.stack([red, green, 0.9 - red / 2 + 0.01 * index], axis=-1).astype(np.float32)


def film(count=5):
    return (colours(index) for index in range(count))


TRUE_COLOURS = [name for name, codec in CODECS.items() if not codec.palette]


@pytest.mark.parametrize("name", TRUE_COLOURS)
def test_films_say_what_they_are(tmp_path, name):
    path = tmp_path / f"a{CODECS[name].suffixes[0]}"
    note = {"seed": 7, "what": "é"}
    assert len(encode(film(), path, size=SIZE, fps=29.97, codec=name, comment=note)) == 5
    seen = probe(path)
    assert seen.tags.startswith("tv, bt709") and "unknown" not in seen.tags
    assert (seen.size, seen.frames, seen.fps) == (SIZE, 5, Fraction(2997, 100))
    assert seen.pixels == CODECS[name].pixels
    assert seen.comment == '{"seed": 7, "what": "\\u00e9"}'
    assert [path] == list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["h264", "h264_10", "vp9"])
def test_same_frames_same_bytes(tmp_path, name):
    ending = CODECS[name].suffixes[0]
    for path in (tmp_path / f"a{ending}", tmp_path / f"b{ending}"):
        encode(film(), path, size=SIZE, fps=25, codec=name)
    assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()


@pytest.mark.parametrize("name", TRUE_COLOURS)
def test_decoded_colours_are_the_encoded_ones(tmp_path, name):
    path = tmp_path / f"a{CODECS[name].suffixes[0]}"
    encode(film(2), path, size=SIZE, fps=25, codec=name)
    matrix = "scale=in_color_matrix=bt709:in_range=tv:flags=accurate_rnd+full_chroma_int+bilinear"
    command = [ffmpeg_path(), "-v", "error", "-i", str(path), "-vf", matrix]
    command += ["-frames:v", "1", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    rgb = np.frombuffer(raw, np.uint8).reshape(SIZE[1], SIZE[0], 3) / 255
    assert np.abs((rgb - colours()).mean(axis=(0, 1))).max() < 0.6 / 255
    assert np.abs(rgb - colours()).mean() < 1.5 / 255


def test_bytes_and_floats_make_nearly_the_same_film():
    picture = colours()
    eight = np.round(picture * 255) / 255
    for exact, rounded in zip(yuv709(picture), yuv709(eight), strict=True):
        assert np.abs(exact.astype(int) - rounded).max() <= 1


def test_uint8_frames_are_taken(tmp_path):
    frames = [np.full((48, 64, 3), value, np.uint8) for value in (0, 128, 255)]
    assert len(encode(frames, tmp_path / "a.mp4", size=SIZE, fps=10)) == 3


@pytest.mark.parametrize(
    ("rgb", "codes"),
    [
        ((0, 0, 0), (16, 128, 128)),
        ((1, 1, 1), (235, 128, 128)),
        ((1, 0, 0), (63, 102, 240)),
        ((0, 1, 0), (173, 42, 26)),
        ((0, 0, 1), (32, 240, 118)),
    ],
)
def test_yuv_of_primaries(rgb, codes):
    planes = yuv709(np.broadcast_to(np.float32(rgb), (4, 4, 3)))
    assert tuple(int(plane[0, 0]) for plane in planes) == codes
    ten = yuv709(np.broadcast_to(np.float32(rgb), (4, 4, 3)), bits=10)
    assert all(abs(int(a[0, 0]) - 4 * b) <= 2 for a, b in zip(ten, codes, strict=True))


@pytest.mark.parametrize(
    ("fps", "exact"),
    [
        (29.97, Fraction(2997, 100)),
        (23.976, Fraction(2997, 125)),
        (25, Fraction(25)),
        (12.5, Fraction(25, 2)),
        (5, Fraction(5)),
        (0.1, Fraction(1, 10)),
        ("30000/1001", Fraction(30000, 1001)),
        ("29.97", Fraction(2997, 100)),
        (Fraction(24000, 1001), Fraction(24000, 1001)),
    ],
)
def test_frame_rates(fps, exact):
    assert frame_rate(fps) == exact


@pytest.mark.parametrize("fps", [0, -25, float("nan"), float("inf"), "1e9", "", True, "x", "1/2/3"])
def test_impossible_frame_rates(fps):
    with pytest.raises(ConfigError, match="write a positive number or a ratio"):
        frame_rate(fps)


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("a.mp4", {"size": (65, 48)}, "must be even, not 65 x 48"),
        ("a.mp4", {"size": (64, -2)}, "must be even"),
        ("a.mp4", {"codec": "h246"}, "did you mean 'h264'"),
        ("a.mp4", {"codec": "mpeg"}, "known: auto, h264"),
        ("a.mp4", {"codec": "vp9"}, r"ending in \.webm or \.mkv"),
        ("a.gif", {"codec": "h264"}, r"ending in \.mp4"),
        ("a.gif", {"fps": 60}, "at most 50 frames a second"),
        ("a.mp4", {"fps": "25/0"}, "ratio such as 30000/1001"),
        ("a.mp4", {"codec": "prores"}, r"ending in \.mov or \.mkv"),
        ("a.avi", {}, r"ends in one of \.mp4, .*\.gif, not 'a.avi'"),
        ("none/a.mp4", {}, "does not exist"),
    ],
)
def test_bad_settings_are_one_sentence(tmp_path, name, changes, message):
    settings = {"size": SIZE, "fps": 25, **changes}
    with pytest.raises(ConfigError, match=message):
        encode(film(), tmp_path / name, **settings)
    assert not list(tmp_path.iterdir())


def test_failures_leave_nothing_and_keep_the_old_film(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"old")

    def stops():
        yield colours()
        raise OSError("frame 1 cannot be read")

    with pytest.raises(OSError, match="frame 1"):
        encode(stops(), path, size=SIZE, fps=25)
    with pytest.raises(RenderError, match=r"frame 0 is \(2, 2, 3\)"):
        encode([np.zeros((2, 2, 3))], path, size=SIZE, fps=25)
    with pytest.raises(RenderError, match="at least one frame"):
        encode([], path, size=SIZE, fps=25)
    assert [path] == list(tmp_path.iterdir()) and path.read_bytes() == b"old"


@pytest.mark.parametrize("frames", [2, 200])
def test_ffmpegs_reason_is_told(tmp_path, frames, monkeypatch):
    from sumo3dviz_pt.video import codecs

    broken = codecs.Codec(8, (2, 2), "yuv420p", ("-c:v", "libx264", "-crf", "bad"))
    monkeypatch.setattr(encoder, "codec_named", lambda name, path: broken)
    with pytest.raises(RenderError, match=r"ffmpeg failed: .+"):
        encode(film(frames), tmp_path / "a.mp4", size=SIZE, fps=25)
    assert not list(tmp_path.iterdir())


def test_probe_refuses_other_files(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"no film")
    with pytest.raises(InputError, match="not a film"):
        probe(tmp_path / "a.mp4")


def test_memory_is_constant(tmp_path):
    import tracemalloc

    tracemalloc.start()
    encode(film(60), tmp_path / "a.mp4", size=SIZE, fps=25)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4_000_000, sys.platform


def test_films_of_ratios_are_exact(tmp_path):
    path = tmp_path / "a.mp4"
    encode(film(), path, size=SIZE, fps="30000/1001")
    assert probe(path).fps == Fraction(30000, 1001)


@pytest.mark.parametrize(
    ("ending", "codec"),
    [(".mp4", "h264"), (".MOV", "h264"), (".mkv", "h264"), (".webm", "vp9"), (".gif", "gif")],
)
def test_the_ending_says_the_codec(tmp_path, ending, codec):
    path = tmp_path / f"a{ending}"
    encode(film(), path, size=SIZE, fps=25)
    log = subprocess.run([ffmpeg_path(), "-i", str(path)], capture_output=True, check=False).stderr
    assert f"Video: {codec}".encode() in log


def test_a_gif_is_timed_coloured_and_repeats(tmp_path):
    """Also of odd size and 30 frames a second, which hundredths of a second do not divide."""
    size, path = (63, 47), tmp_path / "a.gif"
    frames = [colours(index % 5)[: size[1], : size[0]] for index in range(30)]
    assert len(encode(frames, path, size=size, fps=30)) == 30
    assert [path] == list(tmp_path.iterdir()), "no palette and no kept pictures stay"
    with Image.open(path) as shown:
        assert (shown.size, shown.n_frames, shown.info["loop"]) == (size, 30, 0)
        lasts, errors = [], []
        for number, frame in enumerate(frames):
            shown.seek(number)
            lasts.append(shown.info["duration"])
            errors.append(np.asarray(shown.convert("RGB")) / 255.0 - frame)
    assert abs(sum(lasts) - 1000) <= 10 and set(lasts) <= {30, 40}
    assert np.abs(np.mean(errors, axis=(1, 2))).max() < 4.0 / 255, "nearly true in the mean"
    assert np.abs(errors).mean() < 8.0 / 255


def test_encoders_that_an_ffmpeg_lacks_are_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(encoder, "has_encoder", lambda name: name != "libvpx-vp9")
    with pytest.raises(ConfigError, match="no encoder libvpx-vp9"):
        encoder.check_film(tmp_path / "a.webm", size=SIZE, fps=25, codec="auto")
    assert has_encoder("libx264") and not has_encoder("libx999")
