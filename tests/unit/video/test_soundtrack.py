"""Sound in films: what players are told of it, and that the pictures stay as they were."""

from __future__ import annotations

import re
import subprocess
from fractions import Fraction

import numpy as np
import pytest

from sumo3dviz_pt.sound.recording import write_wav
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.codecs import CODECS
from sumo3dviz_pt.video.containers import Wanted, container_faults
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path
from sumo3dviz_pt.video.prints import film_prints
from sumo3dviz_pt.video.soundtrack import Soundtrack, add_sound

SIZE, RATE = (64, 36), 48_000
PITCHES = 400.0 * np.arange(1, 5)
KINDS = [("h264", ".mp4"), ("h265_10", ".mp4"), ("prores", ".mov"), ("h264", ".mkv"),
         ("vp9", ".webm")]  # fmt: skip


def film(path, codec, count=25):
    shades = np.linspace(0.2, 0.8, count, dtype=np.float32)
    encode([np.full((36, 64, 3), each) for each in shades], path, size=SIZE, fps=25, codec=codec)


def recording(path, channels, seconds=1.0):
    times = np.arange(round(seconds * RATE)) / RATE
    waves = 0.1 * np.sin(2 * np.pi * times[:, None] * PITCHES[:channels])
    write_wav(path, [waves[:100], waves[100:]], channels=channels, count=len(times))


def decoded(path, channels):
    command = [ffmpeg_path(), "-loglevel", "error", "-i", str(path), "-map", "0:a"]
    done = subprocess.run([*command, "-f", "f32le", "pipe:1"], capture_output=True, check=True)
    return np.frombuffer(done.stdout, "<f4").reshape(-1, channels)


def pitches(waves):
    lines = np.abs(np.fft.rfft(waves[4800:-4800] * np.hanning(len(waves) - 9600)[:, None], axis=0))
    return np.fft.rfftfreq(len(waves) - 9600, 1 / RATE)[lines.argmax(axis=0)]


@pytest.mark.parametrize(("codec", "ending"), KINDS)
@pytest.mark.parametrize("channels", [2, 4])
def test_channels_keep_their_order_and_pictures_their_form(codec, ending, channels, tmp_path):
    path, kind = tmp_path / f"a{ending}", CODECS[codec]
    film(path, codec)
    before = film_prints(path, codec=kind, size=SIZE)
    recording(tmp_path / "a.wav", channels)
    track = Soundtrack(tmp_path / "a.wav", channels == 4, 0, 25)
    add_sound(path, track, rate=Fraction(25))
    after = film_prints(path, codec=kind, size=SIZE)
    assert all(map(np.array_equal, before.prints, after.prints))
    wanted = Wanted(kind, SIZE, Fraction(25), sound=True)
    assert [what for what, _ in container_faults(path, after.words, wanted)] == []
    silent = Wanted(kind, SIZE, Fraction(25))
    assert any("holds" in what for what, _ in container_faults(path, after.words, silent))
    waves = decoded(path, channels)
    assert len(waves) == pytest.approx(RATE, abs=1100)
    assert pitches(waves) == pytest.approx(PITCHES[:channels], abs=3)
    log = subprocess.run([ffmpeg_path(), "-i", str(path)], capture_output=True, check=False).stderr
    assert re.search(rb"Audio: .*48000 Hz", log)
    assert sorted(each.name for each in tmp_path.iterdir()) == sorted([path.name, "a.wav"])


def test_a_film_that_begins_with_a_title_sounds_later(tmp_path):
    path = tmp_path / "a.mp4"
    film(path, "h264", 50)
    recording(tmp_path / "a.wav", 2)
    add_sound(path, Soundtrack(tmp_path / "a.wav", False, 15, 50), rate=Fraction(25))
    waves = np.abs(decoded(path, 2)).max(axis=1)
    loud = np.flatnonzero(waves > 0.03) / RATE
    assert loud[0] == pytest.approx(0.6, abs=0.005) and loud[-1] == pytest.approx(1.6, abs=0.01)
