"""Films that are heard, and those that are not."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.provenance import file_hash
from sumo3dviz_pt.studies.certificate.delivered import film_faults
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path

CAMERA = ["--camera", "post", "--from", "2"]
SMALL = ["--size", "160x90", "--quality", "draft", "--fps", "10"]


def log_of(path):
    command = [ffmpeg_path(), "-hide_banner", "-i", str(path)]
    return subprocess.run(command, capture_output=True, check=False).stderr.decode()


def samples(path, channels):
    """A WAV file's samples, found without the package."""
    content = path.read_bytes()
    return np.frombuffer(content[content.index(b"data") + 8 :], "<f4").reshape(-1, channels)


@pytest.mark.slow
def test_a_film_plays_what_lies_beside_it(tmp_path, capsys):
    scene, path = write_scenario(tmp_path), tmp_path / "a.mp4"
    words = [*CAMERA, "--to", "3", *SMALL, "--set", "output.sound={play: binaural}"]
    assert main(["render", str(scene), "-o", str(path), *words]) == 0
    log = log_of(path)
    assert "Audio: aac" in log and "48000 Hz, stereo" in log and "Duration: 00:00:01.00" in log
    wave = samples(tmp_path / "a.wav", 2)
    assert len(wave) == 48_000 and np.isfinite(wave).all() and np.abs(wave).max() > 1e-4
    account = json.loads((tmp_path / "a.json").read_bytes())
    told = account["sound"]
    assert told["samples"] == 48_000 and told["full_scale_sine_db"] == 100
    assert set(told["levels"]["LAeq"]) == {"left ear", "right ear"}
    assert 35 < told["levels"]["LAeq"]["left ear"] < 90
    assert "a.wav" in account["files"]
    test = film_faults(path, account, sha256=file_hash(path), develop=True)
    assert test.faults == () and test.developed > 0
    # A film that is resumed has the same bytes of sound.
    first = (tmp_path / "a.wav").read_bytes()
    assert main(["render", str(scene), "-o", str(path), "--resume", *words]) == 0
    assert (tmp_path / "a.wav").read_bytes() == first


@pytest.mark.slow
def test_a_film_of_one_frame_has_its_sound_and_silent_ones_none(tmp_path):
    scene = write_scenario(tmp_path)
    words = [*CAMERA, "--to", "2.1", *SMALL]
    play = ["--set", "output.sound={play: ambisonics, murmur: null}"]
    assert main(["render", str(scene), "-o", str(tmp_path / "one.mp4"), *words, *play]) == 0
    assert samples(tmp_path / "one.wav", 4).shape == (4800, 4)
    assert "ambisonic 1" in log_of(tmp_path / "one.mp4")
    (tmp_path / "b.wav").write_bytes(b"somebody's own")
    tracks = ["--set", "output.sound={play: none}"]
    assert main(["render", str(scene), "-o", str(tmp_path / "b.mp4"), *words, *tracks]) == 0
    assert "Audio" not in log_of(tmp_path / "b.mp4")
    assert (tmp_path / "b.wav").read_bytes() == b"somebody's own"
    account = json.loads((tmp_path / "b.json").read_bytes())
    assert "sound" not in account and "b.wav" not in account["files"]
    assert (tmp_path / "b.sound").is_dir()


@pytest.mark.slow
def test_a_film_that_plays_nothing_and_one_in_which_nothing_is_heard_say_so(tmp_path, capsys):
    words = [str(write_scenario(tmp_path)), *CAMERA, "--to", "2.1", *SMALL]
    play = ["--set", "output.sound={play: stereo, murmur: null, radius: 1}"]
    assert main(["render", "-o", str(tmp_path / "a.gif"), *words, *play]) == 0
    said = capsys.readouterr().err
    assert said.count("a.gif plays no sound, as GIFs and numbered pictures cannot") == 1
    assert said.count("a.wav is silent: nobody who sounds is within 1 m of the camera") == 1
    assert np.abs(samples(tmp_path / "a.wav", 2)).max() == 0.0
    play = ["--set", "output.sound={play: stereo}"]
    assert main(["render", "-o", str(tmp_path / "b.mp4"), *words, *play]) == 0
    said = capsys.readouterr().err
    assert "plays no sound" not in said and "silent" not in said


@pytest.mark.slow
def test_a_driver_hears_the_own_car_and_titles_delay_the_sound(tmp_path):
    scene = write_scenario(tmp_path)
    words = ["--camera", "driver", "--from", "2", "--to", "2.4", *SMALL]
    play = ["--set", "output.sound={play: stereo}", "--set", "overlays.before=[{seconds: 0.5}]"]
    assert main(["render", str(scene), "-o", str(tmp_path / "a.mp4"), *words, *play]) == 0
    account = json.loads((tmp_path / "a.json").read_bytes())
    assert account["sound"]["inside_vehicle"] and account["sound"]["sources"]
    assert 40 < account["sound"]["levels"]["LAeq"]["listener"] < 80
    assert "Duration: 00:00:00.90" in log_of(tmp_path / "a.mp4")
    assert "Duration: 00:00:00.40" in log_of(tmp_path / "a.plain.mp4")
    assert "Audio: aac" in log_of(tmp_path / "a.plain.mp4")


@pytest.mark.parametrize(
    ("setting", "more", "said"),
    [("{play: surround}", [], "output.sound.play"),
     ("{play: stereo, full_scale: 10}", [], "output.sound.full_scale"),
     ("{play: stereo}", ["--speed", "0.5"], "0.5 times the speed has no sound")],
)  # fmt: skip
def test_wrong_words_are_refused_before_any_work(setting, more, said, tmp_path, capsys):
    scene = write_scenario(tmp_path)
    words = [*CAMERA, "--to", "3", *SMALL, "--set", f"output.sound={setting}", *more]
    assert main(["render", str(scene), "-o", str(tmp_path / "a.mp4"), *words]) == 2
    message = capsys.readouterr().err
    assert said in message and message.strip().count("\n") <= 1
    assert not list(tmp_path.glob("a.*"))


def test_what_is_not_asked_for_is_not_loaded():
    code = (
        "import sys; import sumo3dviz_pt.pipeline.films.film;"
        "from sumo3dviz_pt.job.settings import OutputSettings; OutputSettings(sound={});"
        "print([name for name in sys.modules if name.startswith('sumo3dviz_pt.sound')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
