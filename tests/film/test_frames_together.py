"""Frames that help each other when a film is developed, and are stored without help."""

import json

import numpy as np
import pytest
from builders import write_scenario
from film_frames import run

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.image.png import read_text
from sumo3dviz_pt.pipeline.films.film import FilmOrder, render_film
from sumo3dviz_pt.pipeline.films.frames import account_in
from sumo3dviz_pt.pipeline.films.traced import Shelf, StoredFrame
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job

pytestmark = pytest.mark.slow

FILM = ["--camera", "post", "--from", "4", "--to", "4.8", "--fps", "10", "--quality", "preview"]


def bytes_in(folder, suffix="exr"):
    return {path.name: path.read_bytes() for path in sorted(folder.glob(f"*.{suffix}"))}


def finished(folder):
    shelf = Shelf()
    return [shelf.helped(path).finished() for path in sorted(folder.glob("*.exr"))]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("together")
    return write_scenario(folder, signals=True, trees=True, persons=2, vehicles=12)


@pytest.fixture(scope="module")
def whole(place):
    """A film of eight frames, with finished ones beside it."""
    film = place.parent / "whole.mp4"
    run("render", place, *FILM, "--final-exr", "-o", film)
    return film


def test_stored_frames_say_how_they_are_stored(whole):
    frames = sorted((whole.parent / "whole.frames").glob("*.exr"))
    assert len(frames) == 8
    for path in frames:
        frame = StoredFrame.read(path)
        assert frame.account["stored"] == "traced" and frame.window == 4
        assert frame.layers["ids"].max() >= 1
    masters = whole.parent / "whole.final"
    assert {path.name for path in masters.glob("*.exr")} == {path.name for path in frames}
    assert not StoredFrame.read(masters / "000003.exr").traced
    # They say what they are made from, and develop like any frames.
    assert account_in(masters / "000003.exr")["key"] == account_in(frames[3])["key"]


def test_neighbours_make_frames_better(place, whole):
    """What is shown must come nearer to the truth, not only change less."""
    target = place.parent / "truth.exr"
    run(
        *("still", place, "--time", 4.4, "--camera", "post", "--quality", "preview"),
        *("--spp", 1024, "-o", target),
    )
    truth = np.minimum(read_exr(target)[0], 2.0)
    folder = whole.parent / "whole.frames"
    alone = place.parent / "alone.frames"
    alone.mkdir()
    (alone / "000004.exr").write_bytes((folder / "000004.exr").read_bytes())
    helped, lonely = (np.minimum(finished(f)[n], 2.0) for f, n in ((folder, 4), (alone, 0)))
    before, after = (np.sqrt(np.mean((one - truth) ** 2)) for one in (lonely, helped))
    assert after < 0.85 * before


def test_parts_and_gaps_give_the_same_bytes(place, whole):
    """Every frame is a function of itself; neighbours only count when it is developed."""
    folder = place.parent
    parts = folder / "parts.mp4"
    for first, last in ((5, 8), (0, 2)):
        run("render", place, *FILM, "--frames", f"{first}:{last}", "-o", parts)
    run("render", place, *FILM, "--resume", "--final-exr", "-o", parts)
    there, here = (bytes_in(folder / f"{name}.frames") for name in ("whole", "parts"))
    assert set(there) == set(here)
    for name in there:
        for layer, values in StoredFrame.read(folder / "whole.frames" / name).layers.items():
            again = StoredFrame.read(folder / "parts.frames" / name).layers[layer]
            np.testing.assert_array_equal(values, again, err_msg=f"{name} {layer}")
    assert parts.read_bytes() == whole.read_bytes()
    for name in there:
        one, other = (read_exr(folder / f"{film}.final" / name)[0] for film in ("whole", "parts"))
        np.testing.assert_array_equal(one, other)


def test_developing_again_gives_the_films_pixels(whole):
    folder = whole.parent
    run("develop", folder / "whole.frames", "-o", folder / "again.mp4", "--final-exr")
    assert (folder / "again.mp4").read_bytes()
    one, other = (bytes_in(folder / f"{name}.final") for name in ("whole", "again"))
    assert {name: len(file) for name, file in one.items()} == {n: len(f) for n, f in other.items()}
    for name in one:
        a, b = (read_exr(folder / f"{film}.final" / name)[0] for film in ("whole", "again"))
        np.testing.assert_array_equal(a, b)
    # A single frame is developed with those that lie beside it; finished ones develop alike.
    pictures = []
    for source in ("whole.frames", "whole.final"):
        target = folder / f"{source}.png"
        run("develop", folder / source / "000003.exr", "-o", target)
        assert json.loads(read_text(target).get("provenance", "{}")) is not None
        pictures.append(target.read_bytes())
    assert len(pictures[0]) == pytest.approx(len(pictures[1]), rel=0.05)


def test_finished_frames_are_never_overwritten_unasked(whole, capsys):
    folder = whole.parent
    words = ["develop", str(folder / "whole.frames"), "-o", str(folder / "b.mp4"), "--final-exr"]
    assert main(words) == 0
    (folder / "b.mp4").unlink()
    assert main(words) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert main([*words, "--overwrite"]) == 0


def test_frames_of_other_films_help_nobody(place, whole):
    folder = place.parent / "mixed.frames"
    folder.mkdir()
    other = place.parent / "other.mp4"
    run("render", place, *FILM, "--seed", 8, "--frames", "3:4", "-o", other)
    mine = (place.parent / "whole.frames" / "000004.exr").read_bytes()
    (folder / "000004.exr").write_bytes(mine)
    lonely = finished(folder)[0]
    theirs = (place.parent / "other.frames" / "000003.exr").read_bytes()
    (folder / "000003.exr").write_bytes(theirs)
    np.testing.assert_array_equal(Shelf().helped(folder / "000004.exr").finished(), lonely)


def test_a_stored_frame_is_at_most_three_times_as_large(place, whole):
    files = [bytes_in(whole.parent / f"whole.{kind}") for kind in ("frames", "final")]
    traced, done = (sum(map(len, some.values())) for some in files)
    # Small pictures pay for their texts.
    texts = sum(
        sum(len(text) for text in StoredFrame.read(path).strings.values())
        for path in (whole.parent / "whole.frames").glob("*.exr")
    )
    assert traced - texts < 3.0 * done


def test_without_a_compiler_frames_are_finished_as_before(place):
    film = place.parent / "scalar.mp4"
    cheap = ["--variant", "scalar", "--size", "32x18", "--spp", "1"]
    run("render", place, *FILM, *cheap, "--frames", "0:2", "-o", film)
    for path in (place.parent / "scalar.frames").glob("*.exr"):
        frame = StoredFrame.read(path)
        assert frame.account["stored"] == "finished" and not frame.traced


def held_while_made(place, film, *, stop=None, **choices):
    """Make a film whose frames go; return how many lay on disk after each frame was stored."""
    held = []

    def look(event):
        held.append(len(list(film.with_suffix(".frames").glob("*.exr"))))
        if len(held) == stop:
            raise KeyboardInterrupt

    order = FilmOrder(
        film, start=4, end=5.6, fps=10, discard_frames=True, overwrite=not choices, **choices
    )
    request = Request(camera="post", quality="draft", size=(32, 18))
    try:
        render_film(load_job(place), request, order, on_frame=look)
    except KeyboardInterrupt:
        assert stop is not None
    return held


def test_only_a_window_of_frames_is_kept_on_disk(place, tmp_path):
    kept = tmp_path / "kept.mp4"
    order = FilmOrder(kept, start=4, end=5.6, fps=10)
    render_film(load_job(place), Request(camera="post", quality="draft", size=(32, 18)), order)
    film = tmp_path / "film.mp4"
    held = held_while_made(place, film)
    # Four before a frame and four after it help it, and one more may be written meanwhile. Two are
    # finished while the next one is helped.
    assert len(held) == 16 and max(held) in (11, 12)
    assert film.read_bytes() == kept.read_bytes() and not film.with_suffix(".frames").exists()

    # Broken off and gone on with, it is the same again.
    again = tmp_path / "again.mp4"
    held_while_made(place, again, stop=12)
    left = {path.name for path in (tmp_path / "again.frames").glob("*.exr")}
    assert len(left) == 12 and not again.exists() and not list(tmp_path.glob("*.part*"))
    held = held_while_made(place, again, resume=True)
    assert again.read_bytes() == kept.read_bytes()
    assert not again.with_suffix(".frames").exists()


def test_frames_of_an_earlier_run_stay_until_there_is_a_film(place, tmp_path):
    film = tmp_path / "film.mp4"
    order = FilmOrder(film, start=4, end=5.6, fps=10, frames=(0, 10))
    render_film(load_job(place), Request(camera="post", quality="draft", size=(32, 18)), order)
    held_while_made(place, film, stop=5, resume=True)
    left = {int(path.stem) for path in (tmp_path / "film.frames").glob("*.exr")}
    assert left >= set(range(10))
