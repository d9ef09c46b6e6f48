import csv
import json
import sys

import numpy as np
import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import PROVENANCE, read_attributes, read_exr, write_exr

RNG = np.random.default_rng(5)
SCENE = RNG.uniform(0.05, 0.7, (18, 32, 3)).astype(np.float32)
EXPOSURE = 1.0


def write_film(folder, *, times=(10.0, 10.04, 10.08), change=lambda image, _: image, **account):
    """Frames of a scene that moves by one pixel a frame."""
    folder.mkdir(parents=True)
    for number, time in enumerate(times):
        radiance = change(np.roll(SCENE, number, axis=1) / 2**EXPOSURE, number)
        known = {
            "time": time, "exposure": EXPOSURE, "tone": "srgb", "spp": 4, "quality": "preview",
            "capped_share": 0.002, "nonfinite": 0, "versions": {"mitsuba": "3.9.1"}, **account,
        }  # fmt: skip
        text = json.dumps({key: value for key, value in known.items() if value is not None})
        path = folder / f"{number:06d}.exr"
        write_exr(
            path,
            {"radiance": radiance.astype(np.float32)},
            half=False,
            attributes={PROVENANCE: text},
        )
    return folder


def report(*arguments):
    """Run the command; its exit code."""
    return main(["report", *map(str, arguments)])


def frames_of(folder):
    """What frames.csv says."""
    with (folder / "frames.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def numbers(folder, column):
    """A column of frames.csv."""
    return [float(row[column]) for row in frames_of(folder)]


def test_identical_films_do_not_differ(tmp_path, capsys):
    one, other = (write_film(tmp_path / name) for name in ("a.frames", "b.frames"))
    assert report(one, "--against", other, "-o", tmp_path / "out") == 0
    out = tmp_path / "out"
    assert f"wrote {out / 'report.md'}" in capsys.readouterr().out
    for column in ("flip", "flip_p99", "rmse_capped", "relmse_trim", "mean_bias"):
        assert numbers(out, column) == [0, 0, 0]
    assert numbers(out, "ssim") == pytest.approx([1, 1, 1])
    assert numbers(out, "psnr") == [np.inf] * 3
    assert numbers(out, "flicker")[1:] == [0, 0]
    text = (out / "report.md").read_text(encoding="utf-8")
    assert "3 of a.frames" in text and "3 of b.frames" in text and "(worst.png)" in text
    names = {path.name for path in out.iterdir()}
    assert names == {"frames.csv", "report.md", "over_time.png", "worst.png"}


def test_a_known_offset_is_found(tmp_path):
    truth = write_film(tmp_path / "truth")
    film = write_film(tmp_path / "film", change=lambda image, _: 1.02 * image, quality="draft")
    assert report(film, "--against", truth, "-o", tmp_path / "out") == 0
    assert numbers(tmp_path / "out", "mean_bias") == pytest.approx([0.02] * 3, rel=1e-4)
    # Radiance is measured in units of white: SCENE, as it is at this exposure.
    wanted = 0.02 * np.sqrt(np.mean(SCENE.astype(np.float64) ** 2))
    assert numbers(tmp_path / "out", "rmse_capped") == pytest.approx([wanted] * 3, rel=1e-4)
    assert min(numbers(tmp_path / "out", "flip")) > 0.001
    row = frames_of(tmp_path / "out")[0]
    assert (row["quality"], row["other_quality"]) == ("draft", "preview")


def test_flicker_is_of_the_difference_and_not_of_motion(tmp_path):
    """A film that blinks is found out; a steady error is not called flicker."""
    truth = write_film(tmp_path / "truth", change=lambda image, _: 0.5 * image)
    steady = write_film(tmp_path / "steady", change=lambda image, _: 0.5 * image)
    blinks = write_film(tmp_path / "blinks", change=lambda image, k: (0.5 + 0.1 * (k % 2)) * image)
    assert report(steady, "--against", truth, "-o", tmp_path / "a") == 0
    assert report(blinks, "--against", truth, "-o", tmp_path / "b") == 0
    assert report(truth, "-o", tmp_path / "c") == 0
    assert numbers(tmp_path / "a", "flicker")[1:] == [0, 0]
    assert min(numbers(tmp_path / "b", "flicker")[1:]) > 5
    assert min(numbers(tmp_path / "c", "change")[1:]) > 10, "motion alone changes pixels"


def test_the_worst_frame_is_found(tmp_path):
    truth = write_film(tmp_path / "truth")
    film = write_film(tmp_path / "film", change=lambda image, k: image * (1.3 if k == 1 else 1.01))
    assert report(film, "--against", truth, "-o", tmp_path / "out") == 0
    assert int(np.argmax(numbers(tmp_path / "out", "flip"))) == 1
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    (line,) = (line for line in text.splitlines() if line.startswith("| FLIP |"))
    assert line.endswith("| 10.04 |")


def test_both_are_developed_as_the_second(tmp_path):
    truth = write_film(tmp_path / "truth")
    film = write_film(tmp_path / "film", exposure=EXPOSURE + 2, tone="agx")
    assert report(film, "--against", truth, "-o", tmp_path / "out") == 0
    assert numbers(tmp_path / "out", "flip") == [0, 0, 0]
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "They differ in exposure [EV]: both are" in text
    assert "They differ in tone curve: both are" in text and "in seed" not in text


def test_other_seeds_and_cameras_are_said(tmp_path):
    truth = write_film(tmp_path / "truth", seed=7, camera="driver")
    film = write_film(tmp_path / "film", seed=8, camera="hood")
    assert report(film, "--against", truth, "-o", tmp_path / "out") == 0
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "They differ in seed: models, colours" in text and "They differ in camera" in text


@pytest.mark.parametrize("name", ["film.mp4", "film.json", "film.frames"])
def test_one_film_by_any_of_its_names(tmp_path, name):
    write_film(tmp_path / "film.frames")
    for beside in ("film.mp4", "film.json"):
        (tmp_path / beside).write_bytes(b"{}")
    assert report(tmp_path / name, "-o", tmp_path / "out") == 0
    wanted = np.mean(SCENE.astype(np.float64) @ (0.2126, 0.7152, 0.0722))
    assert numbers(tmp_path / "out", "luminance") == pytest.approx([wanted] * 3, rel=1e-5)
    assert numbers(tmp_path / "out", "capped_share") == [0.002] * 3
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "| preview | 4 | 0.200% | 0 |" in text and "worst.png" not in text


def test_a_film_of_one_frame(tmp_path):
    film = write_film(tmp_path / "film", times=(3.0,))
    assert report(film, "-o", tmp_path / "out") == 0
    assert np.isnan(numbers(tmp_path / "out", "change")).all()


def test_a_long_film_shows_its_worst_frames(tmp_path):
    film = write_film(tmp_path / "film", times=tuple(np.arange(64) / 25.0))
    assert report(film, "-o", tmp_path / "out") == 0
    assert len(frames_of(tmp_path / "out")) == 64
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "The 20 worst of 64 frames; frames.csv holds all." in text


def refused(capsys, folder, *arguments):
    """What the command says when it refuses; nothing is written."""
    assert report(*arguments, "-o", folder / "out") == 2
    assert not (folder / "out" / "report.md").exists()
    error = capsys.readouterr().err.strip()
    assert "Traceback" not in error
    return error.splitlines()[-1]


def test_times_must_match(tmp_path, capsys):
    one = write_film(tmp_path / "a")
    for name, times in (("b", (10.0, 10.04)), ("c", (11.0, 11.04, 11.08))):
        other = write_film(tmp_path / name, times=times)
        for pair in ((one, other), (other, one)):
            said = refused(capsys, tmp_path, pair[0], "--against", pair[1])
            assert "different times" in said and "a has 3 frames from 10 s to 10.08 s" in said


def test_sizes_must_match(tmp_path, capsys):
    one = write_film(tmp_path / "a")
    other = write_film(tmp_path / "b", change=lambda image, _: image[:16])
    assert "32x18 and 32x16" in refused(capsys, tmp_path, one, "--against", other)
    mixed = write_film(tmp_path / "c", change=lambda image, k: image[: 18 - k])
    assert "differ in size" in refused(capsys, tmp_path, mixed)


def test_places_without_frames_are_refused(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "film.mp4").write_bytes(b"")
    assert "holds no .exr frames" in refused(capsys, tmp_path, tmp_path / "empty")
    assert "nor lies one beside it" in refused(capsys, tmp_path, tmp_path / "film.mp4")
    assert "there is no" in refused(capsys, tmp_path, tmp_path / "nowhere")


def test_frames_must_say_their_time_and_be_sound(tmp_path, capsys):
    silent = write_film(tmp_path / "silent", time=None)
    assert "which time it shows" in refused(capsys, tmp_path, silent)
    twice = write_film(tmp_path / "twice", times=(1.0, 1.0))
    assert "both show 1 s" in refused(capsys, tmp_path, twice)
    broken = write_film(tmp_path / "broken", change=lambda image, _: image * np.nan)
    assert "not finite" in refused(capsys, tmp_path, broken)
    torn = write_film(tmp_path / "torn")
    (torn / "000001.exr").write_bytes(b"no picture")
    assert "not a readable OpenEXR file" in refused(capsys, tmp_path, torn)


def test_a_file_is_no_place_for_a_report(tmp_path, capsys):
    film = write_film(tmp_path / "film")
    (tmp_path / "out").write_text("", encoding="utf-8")
    assert report(film, "-o", tmp_path / "out") == 2
    assert "is a file" in capsys.readouterr().err


def test_attributes_are_read_without_pixels(tmp_path):
    path = write_film(tmp_path / "film") / "000000.exr"
    assert read_attributes(path) == read_exr(path)[1]
    assert json.loads(read_attributes(path)[PROVENANCE])["time"] == 10.0


@pytest.mark.parametrize("module", ["matplotlib", "flip_evaluator"])
def test_a_missing_extra_is_said_before_any_work(tmp_path, capsys, monkeypatch, module):
    monkeypatch.setitem(sys.modules, module, None)
    said = refused(capsys, tmp_path, write_film(tmp_path / "film"))
    assert 'pip install ".[report]"' in said and '.whl[report]"' in said
    assert not (tmp_path / "out").exists()
