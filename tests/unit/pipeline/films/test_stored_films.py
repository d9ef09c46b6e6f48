"""Folders of frames: only those of one film get into it, and what is missing is said."""

import json
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.exr import PROVENANCE, write_exr
from sumo3dviz_pt.image.png import read_text, write_png
from sumo3dviz_pt.pipeline.films.frames import (
    NOTE,
    account_in,
    frame_file,
    listed,
    state_of,
    stored_film,
    write_json,
)
from sumo3dviz_pt.video import probe

SIZE = (32, 18)


def account_of(*, seed=3, frames=3, fps=12.5, tone="srgb", **more):
    return {
        "key": f"key of seed {seed}",
        "command": "sumo3dviz-pt render",
        "exposure": 0.0,
        "tone": tone,
        "glare": 0.0,
        "camera": "post",
        "scene": {"seed": seed, "output": {"tone": tone}},
        "shot": {"from": 4.0, "frame_rate": str(fps), "frames": frames},
        "world": "w",
        "plan": "p",
        **more,
    }


def write_frame(folder, number, account, *, level=0.2):
    folder.mkdir(exist_ok=True)
    known = {**account, "frame": number, "time": 4.0 + number / 12.5}
    radiance = np.full((SIZE[1], SIZE[0], 3), level, np.float32)
    write_exr(
        frame_file(folder, number),
        {"radiance": radiance},
        attributes={PROVENANCE: json.dumps(known)},
    )


def write_film(folder, numbers, account, *, note=True):
    for number in numbers:
        write_frame(folder, number, account)
    if note:
        write_json(folder / NOTE, account)
    return folder


def develop(folder, target, *more):
    return main(["develop", str(folder), "-o", str(target), *more])


@pytest.mark.parametrize("note", [True, False])
def test_a_film_keeps_its_own_rate(tmp_path, note):
    folder = write_film(tmp_path / "f", range(3), account_of(), note=note)
    assert develop(folder, tmp_path / "a.mp4") == 0
    film = probe(tmp_path / "a.mp4")
    assert (film.frames, film.fps) == (3, Fraction(25, 2))
    assert develop(folder, tmp_path / "b.mp4", "--fps", "50") == 0
    assert probe(tmp_path / "b.mp4").fps == 50


def test_frames_beyond_the_end_never_get_into_a_film(tmp_path, capsys):
    """A film of two frames got an old third one."""
    folder = write_film(tmp_path / "f", range(2), account_of(frames=2))
    write_frame(folder, 2, account_of(seed=9))
    assert develop(folder, tmp_path / "a.mp4") == 0
    assert probe(tmp_path / "a.mp4").frames == 2
    assert "beyond the film's end, and left out: 2" in capsys.readouterr().err


@pytest.mark.parametrize("note", [True, False])
def test_films_are_not_mixed(tmp_path, note, capsys):
    folder = write_film(tmp_path / "f", range(3), account_of(), note=note)
    write_frame(folder, 1, account_of(seed=9))
    assert develop(folder, tmp_path / "a.mp4") == 2
    said = capsys.readouterr().err
    assert "holds 1 frame of another film (000001.exr; what differs: seed: 9 -> 3)" in said
    assert not (tmp_path / "a.mp4").exists()
    with pytest.raises(InputError, match="another film"):
        stored_film(folder)


def test_missing_frames_are_told(tmp_path, capsys):
    folder = write_film(tmp_path / "f", (0, 2, 4, 5), account_of(frames=10))
    assert develop(folder, tmp_path / "a.mp4") == 0
    assert "missing of 10 frames: 1, 3, 6 to 9" in capsys.readouterr().err
    assert probe(tmp_path / "a.mp4").frames == 4
    assert listed([]) == "" and listed([7]) == "7" and listed([2, 1]) == "1 to 2"


def test_a_film_is_developed_as_it_was_last_asked_for(tmp_path):
    """Frames that were kept may have been rendered for another tone curve and glare."""
    for name, now in (("a", "srgb"), ("b", "agx")):
        folder = write_film(tmp_path / name, range(2), account_of(frames=2))
        write_json(folder / NOTE, account_of(frames=2, tone=now))
        assert develop(folder, tmp_path / f"{name}.png") == 0
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()
    assert develop(tmp_path / "b", tmp_path / "c.png", "--tone", "srgb") == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "c.png").read_bytes()


def test_pictures_say_how_they_were_developed(tmp_path, capsys):
    """A picture that says the frame's own tone would be taken for another one."""
    scene = {"output": {"tone": "srgb"}}
    folder = write_film(tmp_path / "f", range(2), account_of(frames=2, scene=scene))
    for name, more in (("a", ()), ("b", ("--tone", "agx")), ("c", ("--exposure", "3"))):
        assert develop(folder, tmp_path / f"{name}_{{frame}}.png", *more) == 0
        assert develop(frame_file(folder, 1), tmp_path / f"{name}.png", *more) == 0
    for suffix in ("_000001.png", ".png"):
        accounts = [account_in(tmp_path / f"{name}{suffix}") for name in "abc"]
        assert [each["tone"] for each in accounts] == ["srgb", "agx", "srgb"]
        assert [each["exposure"] for each in accounts][2] == 3.0
        assert main(["compare", str(tmp_path / f"a{suffix}"), str(tmp_path / f"b{suffix}")]) == 1
        assert "tone" in capsys.readouterr().out


def test_a_response_is_drawn_told_and_compared(tmp_path, capsys):
    scene = {"output": {"tone": "srgb", "response": "none"}}
    folder = write_film(tmp_path / "f", range(2), account_of(frames=2, scene=scene))
    for name in ("none", "dashcam", "cinema"):
        assert develop(folder, tmp_path / f"{name}.png", "--response", name) == 0
    assert develop(folder, tmp_path / "stored.png") == 0
    drawn = {path.stem: np.asarray(Image.open(path)) for path in tmp_path.glob("*.png")}
    np.testing.assert_array_equal(drawn["stored"], drawn["none"])
    assert len({picture.tobytes() for picture in drawn.values()}) == 3
    assert account_in(tmp_path / "dashcam.png")["response"] == "dashcam"
    assert main(["compare", *(str(tmp_path / f"{name}.png") for name in ("none", "cinema"))]) == 1
    assert "output.response: none -> cinema" in capsys.readouterr().out
    assert develop(folder, tmp_path / "x.png", "--response", "dashcm") == 2
    assert "did you mean 'dashcam'" in capsys.readouterr().err


def test_folders_of_older_versions_are_taken_as_they_are(tmp_path):
    """Their frames have no rate, and nobody knows how many there should be."""
    folder = tmp_path / "f"
    for number in range(3):
        write_frame(folder, number, {"exposure": 0.0, "tone": "srgb"})
    assert develop(folder, tmp_path / "a.mp4") == 0
    film = probe(tmp_path / "a.mp4")
    assert (film.frames, film.fps) == (3, 25)
    one = frame_file(folder, 1)
    assert develop(one, tmp_path / "a.png") == 0


def test_pictures_of_frames_are_not_overwritten_either(tmp_path, capsys):
    folder = write_film(tmp_path / "f", range(3), account_of())
    (tmp_path / "a_000002.png").write_bytes(b"mine")
    target = tmp_path / "a_{frame}.png"
    assert develop(folder, target) == 2
    assert "a_000002.png exists already" in capsys.readouterr().err
    assert not (tmp_path / "a_000000.png").exists()
    assert develop(folder, target, "--overwrite") == 0
    account = json.loads(read_text(tmp_path / "a_000002.png")["provenance"])
    assert (account["key"], account["frame"]) == ("key of seed 3", 2)


def test_a_folder_without_frames_of_its_film(tmp_path, capsys):
    folder = write_film(tmp_path / "f", (5, 6), account_of(frames=2))
    assert develop(folder, tmp_path / "a.mp4") == 2
    assert "holds no .exr frames" in capsys.readouterr().err


def test_what_a_frame_is(tmp_path):
    account = account_of()
    folder = write_film(tmp_path / "f", range(2), account)
    assert state_of(frame_file(folder, 0), shared=account, time=4.0) == "done"
    assert state_of(frame_file(folder, 0), shared=account, time=4.08) == "other"
    assert state_of(frame_file(folder, 0), shared={**account, "key": "x"}, time=4.0) == "other"
    assert state_of(frame_file(folder, 7), shared=account, time=4.0) == "absent"
    for elsewhere in ({"variant": "cuda"}, {"device": "NVIDIA H200, CUDA 12.4"}):
        there = state_of(frame_file(folder, 0), shared={**account, **elsewhere}, time=4.0)
        assert there == "elsewhere"
    cut = frame_file(folder, 1)
    cut.write_bytes(cut.read_bytes()[:-40])
    assert state_of(cut, shared=account, time=4.08) == "damaged"


# What pictures say of themselves -----------------------------------------------------------------


def test_reports_leave_the_same_frames_out(tmp_path, capsys):
    folder = write_film(tmp_path / "f", range(2), account_of(frames=2))
    write_frame(folder, 2, account_of(seed=9))
    assert main(["report", str(folder), "-o", str(tmp_path / "r")]) == 0
    assert "| frames | 2 of f |" in (tmp_path / "r" / "report.md").read_text(encoding="utf-8")
    assert main(["report", str(folder), "-o", str(tmp_path / "r"), "--overwrite"]) == 0
    write_frame(folder, 1, account_of(seed=9))
    assert main(["report", str(folder), "-o", str(tmp_path / "s")]) == 2
    assert "another film" in capsys.readouterr().err


def test_accounts_are_found_wherever_they_lie(tmp_path):
    account = account_of()
    folder = write_film(tmp_path / "f.frames", range(2), account)
    write_json(tmp_path / "f.json", account, indent=1)
    (tmp_path / "f.mp4").write_bytes(b"a film")
    write_png(tmp_path / "f.png", np.zeros((4, 4, 3), np.uint8), text={"provenance": "{}"})
    for name in ("f.frames", "f.json", "f.mp4", "f.frames/000001.exr"):
        assert account_in(tmp_path / name)["key"] == account["key"]
    with pytest.raises(InputError, match="does not say what it was made from"):
        account_in(tmp_path / "f.png")
    (folder / NOTE).write_bytes(b"{")
    assert account_in(folder)["key"] == account["key"]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.json", None, "no such file or folder"),
        ("a.json", b"[1, 2", "its account is damaged"),
        ("b.json", b"[1, 2]", "does not say"),
        ("c.png", b"GIF", "is no PNG"),
        ("d.png", b"\x89PNG\r\n\x1a\n\x00\x00\x00\xffIHDR", "cut short"),
        ("e.exr", b"hello", "not a readable OpenEXR"),
    ],
)
def test_what_says_nothing(tmp_path, name, content, words, capsys):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert main(["compare", str(tmp_path / name), str(tmp_path / name)]) == 2
    assert words in capsys.readouterr().err


def test_comments_of_a_png_come_back(tmp_path):
    words = {"provenance": "größer ü", "other": "x"}
    write_png(tmp_path / "a.png", np.zeros((4, 4), np.uint8), text=words)
    assert read_text(tmp_path / "a.png") == words


def test_numbered_pictures_are_told_by_their_names(tmp_path, capsys):
    folder = write_film(tmp_path / "drive.frames", range(3), account_of())
    assert develop(folder, tmp_path / "p_{frame}.png") == 0
    assert capsys.readouterr().out == f"wrote {tmp_path / 'p_000000.png'} to p_000002.png\n"
    assert develop(folder, tmp_path / "d.mp4") == 0
    assert capsys.readouterr().out == f"wrote {tmp_path / 'd.mp4'}\n"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("frames", "x"), ("frames", 10**18), ("frames", -1), ("frame_rate", [1])),
        *(("from", float("nan")), ("exposure", "bright"), ("glare", None), ("seed", 1.5)),
        *(("tone", {}), ("shot", 3), ("scene", []), ("versions", "1")),
    ],
)
@pytest.mark.parametrize("command", ["develop", "report", "compare"])
def test_an_account_of_another_shape_is_refused(tmp_path, capsys, command, key, value):
    account = account_of(frames=1)
    (account["shot"] if key in account["shot"] else account)[key] = value
    folder = write_film(tmp_path / "f", range(1), account)
    words = [str(folder)] if command == "compare" else ["-o", str(tmp_path / "o_{frame}.png")]
    assert main([command, str(folder), *words]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    if command != "compare":  # which says that nothing is known of it
        assert "damaged" in said
