"""Films that are gone on with: whole, in parts, longer, shorter, with other settings."""

import json

import numpy as np
import pytest
from builders import write_scenario
from PIL import Image

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import PROVENANCE, read_attributes, read_exr, write_exr
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.pipeline.films.frames import NOTE, account_in
from sumo3dviz_pt.video import probe

pytestmark = pytest.mark.slow

CHEAP = ["--fps", "5", "--spp", "1", "--size", "32x18", "--variant", "scalar"]
"""Nothing is compiled: for so few pixels that is ten times faster."""

GPU = {"variant": "cuda", "device": "NVIDIA H200, CUDA 12.4"}
"""What a frame's account says that a GPU traced."""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("resume")
    return write_scenario(folder, vehicles=2, signals=True)


@pytest.fixture
def render(place, capsys):
    """Renders a film of the standing camera; what it said."""

    def rendered(target, *more, end=4.8, code=0, camera="post"):
        window = ["--camera", camera, "--from", "4", "--to", str(end)]
        words = ["render", place, *window, *CHEAP, *more, "-o", target]
        assert main([str(word) for word in words]) == code
        return capsys.readouterr().err

    return rendered


def pictures(folder):
    return {path.name: read_exr(path)[0] for path in sorted(folder.glob("*.exr"))}


def stamps(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.exr")}


def assert_same(one, other):
    one, other = pictures(one), pictures(other)
    assert one and set(one) == set(other)
    for name, picture in one.items():
        np.testing.assert_array_equal(picture, other[name], err_msg=name)


@pytest.mark.parametrize("camera", ["post", "driver"])
def test_a_longer_shot_is_one_film(tmp_path, render, camera):
    """Two worlds got into one film: each window is planned for itself."""
    render(tmp_path / "a.mp4", camera=camera)
    said = render(tmp_path / "a.mp4", "--resume", end=5.2, camera=camera)
    assert "rendered anew: 4 frames; what differs: shot: frames: 4 -> 6" in said
    render(tmp_path / "b.mp4", end=5.2, camera=camera)
    assert_same(tmp_path / "a.frames", tmp_path / "b.frames")
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    assert main(["compare", str(tmp_path / "a.mp4"), str(tmp_path / "b.mp4")]) == 0


def test_a_shorter_film_holds_nothing_of_the_longer_one(tmp_path, render, capsys):
    render(tmp_path / "a.mp4", end=4.6)
    render(tmp_path / "a.mp4", "--resume", end=4.4)
    assert probe(tmp_path / "a.mp4").frames == 2
    assert main(["develop", str(tmp_path / "a.frames"), "-o", str(tmp_path / "b.mp4")]) == 0
    assert probe(tmp_path / "b.mp4").frames == 2
    assert "beyond the film's end, and left out: 2" in capsys.readouterr().err
    render(tmp_path / "a.mp4", "--overwrite", end=4.4)
    assert set(pictures(tmp_path / "a.frames")) == {"000000.exr", "000001.exr"}


def test_parts_are_shared_and_never_touched(tmp_path, render):
    render(tmp_path / "whole.mp4")
    film, folder = tmp_path / "a.mp4", tmp_path / "a.frames"
    render(film, "--frames", "2:4")
    first = stamps(folder)
    render(film, "--frames", "0:2")
    assert "--resume" in render(film, "--frames", "1:3", code=2)
    render(film, "--frames", "1:3", "--overwrite")
    now = stamps(folder)
    assert now["000003.exr"] == first["000003.exr"] and now["000002.exr"] > first["000002.exr"]
    assert "rendered anew" not in render(film, "--resume")
    assert stamps(folder) == now and probe(film).frames == 4
    assert_same(folder, tmp_path / "whole.frames")
    assert film.read_bytes() == (tmp_path / "whole.mp4").read_bytes()


def test_parts_of_another_film_are_refused(tmp_path, render):
    film = tmp_path / "a.mp4"
    render(film, "--frames", "0:1")
    said = render(film, "--frames", "1:2", "--seed", "8", code=2)
    assert "frames of another film (what differs: seed: 3 -> 8" in said
    assert set(pictures(tmp_path / "a.frames")) == {"000000.exr"}
    said = render(film, "--frames", "1:2", "--seed", "8", "--resume")
    assert "they have to be rendered anew" in said
    assert main(["develop", str(tmp_path / "a.frames"), "-o", str(tmp_path / "b.mp4")]) == 2


def test_glare_and_tone_need_no_new_frames(tmp_path, render):
    """Frames were kept with the old glare, and so was the film."""
    look = ["--set", "output.glare=0.3", "--set", "output.tone=agx"]
    render(tmp_path / "a.mp4")
    before = stamps(tmp_path / "a.frames")
    render(tmp_path / "a.mp4", "--resume", *look)
    assert stamps(tmp_path / "a.frames") == before
    render(tmp_path / "b.mp4", *look)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    for name in "ab":
        target = str(tmp_path / f"{name}_again.mp4")
        assert main(["develop", str(tmp_path / f"{name}.frames"), "-o", target]) == 0
    again = [(tmp_path / f"{name}_again.mp4").read_bytes() for name in "ab"]
    assert again[0] == again[1]


def test_a_response_is_one_in_parts_and_whole_and_needs_no_new_frames(tmp_path, render):
    """Noise hangs on a frame's seed and time, not on which frames were rendered beside it."""
    camera = ["--set", "output.response=dashcam"]
    render(tmp_path / "whole_{frame}.png", *camera)
    render(tmp_path / "parts_{frame}.png", "--frames", "2:4", *camera)
    render(tmp_path / "parts_{frame}.png", "--frames", "0:2", *camera)
    render(tmp_path / "parts_{frame}.png", "--resume", *camera)
    render(tmp_path / "clean_{frame}.png")
    before = stamps(tmp_path / "clean.frames")

    def pixels(name, number=2):
        return np.asarray(Image.open(tmp_path / f"{name}_{number:06d}.png"))

    for number in range(4):
        np.testing.assert_array_equal(pixels("whole", number), pixels("parts", number))
    assert (pixels("whole") != pixels("clean")).any()
    again = ["develop", str(tmp_path / "clean.frames"), "--response", "dashcam", "-o"]
    assert main([*again, str(tmp_path / "again_{frame}.png")]) == 0
    np.testing.assert_array_equal(pixels("whole"), pixels("again"))
    render(tmp_path / "clean_{frame}.png", "--resume", *camera)
    assert stamps(tmp_path / "clean.frames") == before
    np.testing.assert_array_equal(pixels("whole"), pixels("clean"))


@pytest.mark.parametrize("setting", ["output.half=false", "street.lamps=none"])
def test_what_frames_hang_on_is_rendered_anew(tmp_path, render, setting):
    render(tmp_path / "a.mp4", end=4.4)
    said = render(tmp_path / "a.mp4", "--resume", "--set", setting, end=4.4)
    assert f"rendered anew: 2 frames; what differs: {setting.partition('=')[0]}: " in said


def test_a_film_ends_with_the_log(tmp_path, render):
    said = render(tmp_path / "a.mp4", "--from", "11.6", end=20)
    assert "the log ends at 12 s, and the film with it: 3 frames instead of 42" in said
    account = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert [frame["time"] for frame in account["frames"]] == pytest.approx([11.6, 11.8, 12.0])
    assert probe(tmp_path / "a.mp4").frames == 3
    said = render(tmp_path / "b.mp4", "--from", "-2", code=2)
    assert "the log begins at 0 s" in said and not (tmp_path / "b.frames").exists()


def test_discarding_frames_leaves_what_is_not_the_films(tmp_path, render):
    folder = tmp_path / "a.frames"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    render(tmp_path / "a.mp4", "--discard-frames", end=4.4)
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("camera", ["post", "driver"])
def test_a_film_whose_frames_go_is_the_same(tmp_path, render, camera):
    for folder, more in (("kept", []), ("gone", ["--discard-frames"])):
        (tmp_path / folder).mkdir()
        render(tmp_path / folder / "film.mp4", *more, camera=camera)
    kept, gone = ((tmp_path / folder / "film.mp4").read_bytes() for folder in ("kept", "gone"))
    assert kept == gone
    assert not list((tmp_path / "gone").glob("*.frames"))


def test_pictures_come_without_frames_too(tmp_path, render):
    for folder, more in (("kept", []), ("gone", ["--discard-frames"])):
        (tmp_path / folder).mkdir()
        render(tmp_path / folder / "film_{frame}.png", *more, end=4.4)
    # The account names the command; the pixels follow it.
    kept, gone = (
        [path.read_bytes().partition(b"IDAT")[2] for path in sorted(folder.glob("*.png"))]
        for folder in (tmp_path / "kept", tmp_path / "gone")
    )
    assert len(kept) == 2 and all(kept) and kept == gone
    assert not list((tmp_path / "gone").glob("*.frames"))


# What was rendered ------------------------------------------------------------------------------


def test_pictures_and_films_say_all_that_they_are_made_from(tmp_path, place, render):
    render(tmp_path / "a.mp4", "--set", "seed=5", end=4.4)
    still = ["still", str(place), "--time", "4", "--camera", "post", *CHEAP[2:]]
    for suffix in ("png", "exr"):
        assert main([*still, "-o", str(tmp_path / f"a.{suffix}")]) == 0
    names = ("a.json", "a.frames", "a.frames/000001.exr", "a.png", "a.exr")
    accounts = {name: account_in(tmp_path / name) for name in names}
    for name, account in accounts.items():
        assert set(account["scene"]) == {*Job.model_fields} - {"schema_version"}, name
        assert account["scene"]["scenario"]["network"] == "net.net.xml"
        assert set(account["inputs"]) >= {"net.net.xml", "fcd.xml", "types.add.xml", "tls.xml"}
        assert "scene_templates/scene/abstract.yaml" in account["inputs"]
        assert all(len(account[key]) == 32 for key in ("key", "world", "light", "plan"))
        # Scene files stand by their names: a command tells no place of a machine.
        assert place.name in account["command"] and str(place.parent) not in account["command"]
        assert str(tmp_path / "a") not in account["command"]
        assert set(account["package"]) == {"code", "library"} and account["versions"]["mitsuba"]
    pace = {"fps": 5.0, "frame_rate": "5", "speed": 1.0}
    assert accounts["a.frames"]["shot"] == {"from": 4.0, "frames": 2, **pace}
    assert accounts["a.json"]["scene"]["seed"] == 5 == accounts["a.frames/000001.exr"]["seed"]
    assert accounts["a.png"] == accounts["a.exr"]
    # The same world, whoever asks; the still has a plan of its own.
    assert accounts["a.frames"]["world"] != ""
    assert (tmp_path / "a.frames" / NOTE).is_file()


def traced_elsewhere(path):
    """Let a stored frame say that a GPU traced it."""
    account = json.loads(read_attributes(path)[PROVENANCE])
    text = {PROVENANCE: json.dumps({**account, **GPU})}
    write_exr(path, {"radiance": read_exr(path)[0]}, attributes=text)


def test_devices_are_mixed_only_where_that_is_said(tmp_path, render):
    """Their pixels differ a little, and what was rendered is not thrown away unasked."""
    film, folder = tmp_path / "a.mp4", tmp_path / "a.frames"
    render(film)
    film.unlink()
    traced_elsewhere(folder / "000002.exr")
    (folder / "000001.exr").unlink()
    before = stamps(folder)
    for words in (["--resume"], ["--frames", "1:2"]):
        said = render(film, *words, code=2)
        assert "traced by cuda on NVIDIA H200, CUDA 12.4, and this command traces by" in said
        assert "--mix-devices" in said and not film.exists() and stamps(folder) == before
        # A part of a film is held against the note that lies beside the other parts.
        note = json.loads((folder / NOTE).read_text())
        (folder / NOTE).write_text(json.dumps({**note, **GPU}))
    said = render(film, "--resume", "--mix-devices")
    assert "both stay in one film" in said and before.items() <= stamps(folder).items()
    assert json.loads((tmp_path / "a.json").read_text())["devices"] == [
        "cuda on NVIDIA H200, CUDA 12.4",
        "scalar",
    ]


def test_compare_says_what_differs(tmp_path, place, capsys):
    still = ["still", str(place), "--time", "4", "--camera", "post", *CHEAP[2:]]
    for name, more in (("a", []), ("b", ["--set", "lights=on"])):
        assert main([*still, *more, "-o", str(tmp_path / f"{name}.png")]) == 0
    capsys.readouterr()
    assert main(["compare", str(tmp_path / "a.png"), str(tmp_path / "b.png")]) == 1
    said = capsys.readouterr().out
    assert said.startswith("lights: auto -> on\n") and "the shot shows" in said


def test_resume_and_overwrite_from_python(tmp_path, place):
    scene = sv.load(place)
    choices = {"camera": "post", "start": 4, "end": 4.2, "fps": 5, "spp": 1, "size": (32, 18)}
    choices["variant"] = "scalar"
    film = tmp_path / "a.mp4"
    for more in ({}, {"resume": True}, {"overwrite": True}):
        assert scene.render(film, **choices, **more) == [film]
    with pytest.raises(sv.ConfigError, match="exists already"):
        scene.render(film, **choices)
