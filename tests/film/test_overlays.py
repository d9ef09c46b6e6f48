"""A film with overlays and its twin without: the twin is the film that a scene without gives."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from builders import write_scenario
from PIL import Image

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.png import read_text
from sumo3dviz_pt.studies.certificate.delivered import FilmTest, film_faults
from sumo3dviz_pt.video.ffmpeg import film_picture, probe

pytestmark = pytest.mark.slow

OVERLAYS = """
overlays:
  text: [{text: A, size: 0.2}]
  highlights: [{ids: "*"}]
  map: {}
  before: [{show: fixation, seconds: 0.08}]
  after: [{seconds: 0.04}]
  captions: [{text: words, to: 0.1}]
"""
WINDOW = ["--camera", "post", "--from", "2", "--to", "2.2", "--size", "64x36", "--quality", "draft"]
WINDOW += ["--fps", "25"]


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """`with.mp4` and its twin, and `bare.mp4` of the same scene without overlays."""
    folder = tmp_path_factory.mktemp("overlays")
    scene = write_scenario(folder)
    plain = scene.read_text(encoding="utf-8")
    bare = scene.with_name("bare.yaml")
    bare.write_text(plain, encoding="utf-8")
    scene.write_text(plain + OVERLAYS, encoding="utf-8")
    for name, out in ((scene, "with.mp4"), (bare, "bare.mp4")):
        assert main(["render", str(name), "-o", str(folder / out), *WINDOW]) == 0
    return folder


def pictures(path, count):
    return [film_picture(path, max(n / 25 - 0.001, 0.0), size=(64, 36)) for n in range(count)]


def test_the_twin_is_the_film_without_overlays(films):
    assert (films / "with.plain.mp4").read_bytes() == (films / "bare.mp4").read_bytes()
    assert (films / "with.mp4").read_bytes() != (films / "bare.mp4").read_bytes()
    assert not (films / "bare.plain.mp4").exists()
    assert not (films / "bare.frames" / "overlays.json").exists()


def test_stored_frames_know_nothing_of_overlays(films):
    one, other = (
        json.loads((films / f"{name}.frames" / "film.json").read_bytes())
        for name in ("with", "bare")
    )
    assert one["key"] == other["key"]
    for file in sorted((films / "with.frames").glob("*.exr")):
        found = main(
            ["develop", str(file), "--no-overlays", "-o", str(films / "one.png"), "--overwrite"]
        )
        bare = films / "bare.frames" / file.name
        assert (
            found == main(["develop", str(bare), "-o", str(films / "two.png"), "--overwrite"]) == 0
        )
        one, two = (np.asarray(Image.open(films / f"{name}.png")) for name in ("one", "two"))
        assert np.array_equal(one, two)


def test_plain_pictures_come_before_and_after_and_the_account_says_so(films):
    account = json.loads((films / "with.json").read_bytes())
    assert account["overlays"] == {
        "files": ["with.plain.mp4", "with.vtt"],
        "frames_before": 2,
        "frames_after": 1,
    }
    found = pictures(films / "with.mp4", 8)
    grey = np.abs(found[1].astype(int) - 0x77).max(axis=-1) < 12
    assert 0.9 < grey.mean() < 1.0  # but for the cross
    assert (np.abs(found[7].astype(int) - 0x77) < 12).all()
    assert "00:00:00.080 --> 00:00:00.180" in (films / "with.vtt").read_text(encoding="utf-8")


def test_both_films_are_held_against_their_frames_with_and_without_overlays(films):
    film = films / "with.mp4"
    account = json.loads((films / "with.json").read_bytes())
    sha256 = account["delivered"]["with.mp4"]["sha256"]
    found = film_faults(film, account, sha256=sha256, develop=True)
    assert found == FilmTest((), pictures=8 + 5, developed=5 + 5)
    # The twin in the place of the film lacks overlays, and the pictures before and after it.
    film.rename(films / "kept.mp4")
    shutil.copy(films / "with.plain.mp4", film)
    said = {each.what for each in film_faults(film, account, sha256=sha256, develop=True).faults}
    (films / "kept.mp4").replace(film)
    assert {"is not the film that was written", "has 5 pictures of 8"} < said
    assert any("not the one that was developed" in what for what in said)


def test_develop_draws_the_same_overlays_and_leaves_them_out_if_asked(films):
    frames = str(films / "with.frames")
    assert main(["develop", frames, "-o", str(films / "again.mp4"), "--codec", "h264"]) == 0
    for one, other in zip(
        pictures(films / "again.mp4", 8), pictures(films / "with.mp4", 8), strict=True
    ):
        assert np.abs(one.astype(int) - other.astype(int)).max() <= 2
    assert main(["develop", frames, "--no-overlays", "-o", str(films / "not.mp4")]) == 0
    for one, other in zip(
        pictures(films / "not.mp4", 5), pictures(films / "bare.mp4", 5), strict=True
    ):
        assert np.abs(one.astype(int) - other.astype(int)).max() <= 2


def test_other_overlays_render_no_frame_anew(films):
    before = {file: file.stat().st_mtime_ns for file in (films / "with.frames").glob("*.exr")}
    words = ["--set", "overlays.text=[{text: B, size: 0.3}]"]
    scene = next(path for path in films.glob("*.yaml") if path.name != "bare.yaml")
    out = ["-o", str(films / "with.mp4")]
    assert main(["render", str(scene), *out, *WINDOW, "--resume", *words]) == 0
    assert {file: file.stat().st_mtime_ns for file in before} == before
    assert "B" in (films / "with.frames" / "overlays.json").read_text(encoding="utf-8")


def test_numbered_pictures_have_twins_too(films):
    scene = next(path for path in films.glob("*.yaml") if path.name != "bare.yaml")
    assert main(["render", str(scene), "-o", str(films / "p_{frame}.png"), *WINDOW]) == 0
    assert len([*films.glob("p_00000?.png")]) == len([*films.glob("p_00000?.plain.png")]) == 5
    assert "provenance" in read_text(films / "p_000000.plain.png")
    again = ["render", str(scene), "-o", str(films / "p_{frame}.png"), *WINDOW]
    assert main(again) == 2  # nothing is overwritten unasked


def test_frames_that_do_not_stay_make_the_same_films(films):
    scene = next(path for path in films.glob("*.yaml") if path.name != "bare.yaml")
    for name in ("gone.mp4", "went_{frame}.png"):
        words = ["render", str(scene), "-o", str(films / name), *WINDOW, "--discard-frames"]
        assert main(words) == 0
    assert (films / "gone.plain.mp4").read_bytes() == (films / "bare.mp4").read_bytes()
    assert len([*films.glob("went_00000?.plain.png")]) == 5
    assert not (films / "gone.frames").exists()
    assert not (films / "went.frames").exists()


def test_probe_counts_all_frames(films):
    assert probe(films / "with.plain.mp4").frames == 5
