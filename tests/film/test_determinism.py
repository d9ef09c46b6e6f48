"""The same command gives the same pixels, whole, in parts, broken off or over the API."""

import json

import numpy as np
import pytest
from builders import fcd_xml, network_xml, write_scenario, z_scores
from film_frames import assert_equal_frames, frames_in, run

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.pipeline.films.film import FilmOrder, render_film
from sumo3dviz_pt.pipeline.films.frames import account_in
from sumo3dviz_pt.pipeline.live import render_still
from sumo3dviz_pt.pipeline.production import Request, example, frame_times, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.video import probe

pytestmark = pytest.mark.slow

CHEAP = Request(camera="post", quality="draft", spp=1)
TIMES = ["--from", "4", "--to", "4.8", "--fps", "10", "--spp", "1"]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A scene with everything: signals, trees, walkers."""
    folder = tmp_path_factory.mktemp("film")
    return write_scenario(folder, signals=True, trees=True, persons=2, vehicles=12)


@pytest.fixture(scope="module")
def whole(place):
    """All frames of a film."""
    film = place.parent / "whole.mp4"
    run("render", place, "--camera", "post", *TIMES, "-o", film)
    return film


def test_a_film_comes_with_frames_and_account(whole):
    frames = frames_in(whole.parent / "whole.frames")
    assert list(frames) == [f"{n:06d}.exr" for n in range(8)]
    for picture in frames.values():
        assert picture.shape == (36, 64, 3) and np.isfinite(picture).all()
        assert (picture >= 0).all() and picture.max() > 0
    film = probe(whole)
    assert (film.size, film.frames) == ((64, 36), 8)
    account = json.loads(whole.with_suffix(".json").read_text(encoding="utf-8"))
    assert [frame["time"] for frame in account["frames"]] == pytest.approx(
        [4 + n / 10 for n in range(8)], abs=1e-9
    )
    assert account["fps"] == 10 and account["size"] == [64, 36] and account["spp"] == 1
    assert account["signal_changes"][0] == {"frame": 0, "time": 4.0, "tls": "m", "state": "Gr"}
    assert "vehicle:v0" in account["frames"][0]["drawn"]
    assert set(account["inputs"]) >= {"net.net.xml", "fcd.xml", "tls.xml", "trees.add.xml"}
    assert not list(whole.parent.glob("*.part"))


def test_the_same_command_gives_the_same_frames(place, whole):
    again = place.parent / "again.mp4"
    run("render", place, "--camera", "post", *TIMES, "-o", again)
    one, two = whole.parent / "whole.frames", place.parent / "again.frames"
    assert_equal_frames(frames_in(one), frames_in(two))
    for path in one.glob("*.exr"):
        assert path.read_bytes() == (two / path.name).read_bytes()
    assert whole.read_bytes() == again.read_bytes()


def test_a_part_equals_the_whole(place, whole):
    part = place.parent / "part.mp4"
    run("render", place, "--camera", "post", *TIMES, "--frames", "5:8", "-o", part)
    assert not part.exists()
    frames = frames_in(place.parent / "part.frames")
    assert list(frames) == ["000005.exr", "000006.exr", "000007.exr"]
    assert_equal_frames(frames, frames_in(whole.parent / "whole.frames"))


def test_another_seed_gives_other_noise(place, whole):
    other = place.parent / "seed.mp4"
    arguments = ["--camera", "post", *TIMES, "--frames", "0:1", "--seed", "5", "-o", other]
    run("render", place, *arguments)
    one = frames_in(whole.parent / "whole.frames")["000000.exr"]
    two = frames_in(place.parent / "seed.frames")["000000.exr"]
    assert (one != two).mean() > 0.2


def test_broken_off_and_resumed_equals_uninterrupted(place, whole, capsys):
    broken = place.parent / "broken.mp4"
    order = FilmOrder(broken, start=4, end=4.8, fps=10, resume=True)
    seen = []

    def stop(event):
        seen.append(event)
        if len(seen) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_film(load_job(place), CHEAP.__class__(camera="post", spp=1), order, on_frame=stop)
    # The fourth was traced while the third was written, and what was traced is kept.
    assert len(frames_in(place.parent / "broken.frames")) == 4 and not broken.exists()
    assert [event.done for event in seen] == [1, 2, 3] and seen[0].total == 8
    # A half-written and a foreign frame are rendered anew.
    damaged = place.parent / "broken.frames" / "000001.exr"
    damaged.write_bytes(damaged.read_bytes()[:200])
    run("render", place, "--camera", "post", *TIMES, "--resume", "-o", broken)
    assert_equal_frames(
        frames_in(place.parent / "broken.frames"), frames_in(whole.parent / "whole.frames")
    )
    # Nothing is left to do.
    before = {path: path.stat().st_mtime_ns for path in place.parent.glob("broken.frames/*.exr")}
    run("render", place, "--camera", "post", *TIMES, "--resume", "--discard-frames", "-o", broken)
    assert not (place.parent / "broken.frames").exists() and len(before) == 8


def test_frames_of_another_film_are_not_kept(place):
    film = place.parent / "mixed.mp4"
    base = ["render", place, "--camera", "post", *TIMES, "--frames", "0:1", "-o", film]
    run(*base)
    first = frames_in(place.parent / "mixed.frames")
    run(*base, "--resume", "--seed", "8")
    second = frames_in(place.parent / "mixed.frames")
    assert (first["000000.exr"] != second["000000.exr"]).any()


def test_interrupts_end_with_130_and_say_how_to_go_on(place, capsys, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("sumo3dviz_pt.pipeline.films.film.render_film", interrupted)
    code = main(
        ["render", str(place), "--camera", "post", *TIMES, "-o", str(place.parent / "i.mp4")]
    )
    assert code == 130 and "--resume" in capsys.readouterr().err


def test_a_batch_goes_on_after_a_failure(place, capsys):
    missing = place.parent / "none.yaml"
    target = place.parent / "batch_{scene}.mp4"
    arguments = ["--camera", "post", *TIMES, "--frames", "0:1", "-o", str(target)]
    assert main(["render", str(missing), str(place), *arguments]) == 2
    assert "none.yaml" in capsys.readouterr().err
    assert frames_in(place.parent / "batch_scene.frames")


def test_the_order_of_frames_does_not_matter(tmp_path):
    """Nothing stays of the frame before: no signal, colour, or place.

    The ride passes a signal change at 6 s, the renderer's grid, and far road users.
    """
    place = write_scenario(tmp_path, vehicles=60, signals=True, persons=2, end=20.0)
    job = load_job(place, {"signals.yellow": "log"})
    request = Request(camera="driver", quality="draft", spp=1, size=(48, 27))
    times = np.concatenate([frame_times(5.4, 6.6, 5), frame_times(16.0, 17.2, 5)])
    production = prepare(job, request, times)
    assert production.shot.data.slots.far
    shown = []
    for step in (1, -1):
        with opened(production) as session:
            ordered = times[::step]
            frames = [session.render(production.shot.frame_at(float(t))).radiance for t in ordered]
        shown.append(np.array(frames[::step]))
    np.testing.assert_array_equal(shown[0], shown[1])


# Pictures and the API -----------------------------------------------------------------------

STILL = ["--time", "4.5", "--camera", "post", "--spp", "1"]


@pytest.fixture(scope="module")
def still(place):
    target = place.parent / "still.exr"
    run("still", place, *STILL, "-o", target)
    return read_exr(target)[0]


def test_stills_are_the_same_bytes(place, still):
    for suffix in ("png", "exr"):
        paths = [place.parent / f"{name}.{suffix}" for name in "ab"]
        for path in paths:
            run("still", place, *STILL, "-o", path)
        assert paths[0].read_bytes() == paths[1].read_bytes()
    np.testing.assert_array_equal(read_exr(place.parent / "a.exr")[0], still)


def test_the_api_gives_the_commands_pixels(place, still):
    picture = sv.load(place).still(time=4.5, camera="post", spp=1)
    np.testing.assert_array_equal(picture.radiance.astype(np.float16), still.astype(np.float16))
    assert picture.develop().dtype == np.uint8 and picture.develop().shape == (36, 64, 3)
    picture.save(place.parent / "api.exr")
    assert place.parent / "fcd.xml" in picture.reads, "what saving must not replace"
    run("still", place, *STILL, "-o", place.parent / "cli.exr")
    one, other = (account_in(place.parent / name) for name in ("api.exr", "cli.exr"))
    assert {**one, "command": other["command"]} == other
    assert other["command"].endswith("--camera post --spp 1") and "still" in other["command"]
    pixels = [read_exr(place.parent / name)[0] for name in ("api.exr", "cli.exr")]
    np.testing.assert_array_equal(*pixels)


def test_a_scene_by_its_files_gives_the_commands_pixels(place, still):
    folder, camera = place.parent, load_job(place).cameras["post"]
    scene = sv.Scene(
        network=folder / "net.net.xml",
        trajectories=folder / "fcd.xml",
        vehicle_types=folder / "types.add.xml",
        signals=folder / "tls.xml",
        additional=folder / "trees.add.xml",
        template="abstract",
        seed=3,
        quality="draft",
        cameras={"post": camera.model_dump(exclude_none=True)},
        output={"size": [64, 36]},
    )
    picture = scene.still(time=4.5, spp=1)
    np.testing.assert_array_equal(picture.radiance.astype(np.float16), still.astype(np.float16))


def test_films_over_the_api_equal_the_commands(place, whole):
    target = place.parent / "api.mp4"
    steps = []
    (folder,) = sv.load(place).render(
        target, camera="post", start=4, end=4.8, fps=10, spp=1, frames=(2, 4), progress=steps.append
    )
    assert folder == place.parent / "api.frames" and len(steps) == 2
    assert_equal_frames(frames_in(folder), frames_in(whole.parent / "whole.frames"))


def test_develop_again(place, whole, tmp_path):
    frames = whole.parent / "whole.frames"
    run("develop", frames, "-o", tmp_path / "d.mp4", "--fps", "10")
    assert probe(tmp_path / "d.mp4").frames == 8
    run("develop", frames / "000002.exr", "-o", tmp_path / "d.png")
    run("develop", frames, "-o", tmp_path / "e.png", "--tone", "agx", "--exposure", "2")
    assert (tmp_path / "d.png").read_bytes() != (tmp_path / "e.png").read_bytes()
    assert main(["develop", str(frames), "-o", str(tmp_path / "f.png"), "--tone", "no"]) == 2


# Other ways to render -----------------------------------------------------------------------


def halves(place, time, **choices):
    """Mean and variance of 4 x 4 blocks over several seeds, each (8, 16)."""
    pictures = []
    for seed in range(4):
        request = Request(camera="post", quality="reference", spp=16, seed=seed, **choices)
        image = render_still(load_job(place), request, time).radiance
        blocks = np.minimum(image, 4.0)[:32].reshape(8, 4, 16, 4, 3).mean(axis=(1, 3, 4))
        pictures.append(blocks)
    stack = np.array(pictures)
    return stack.mean(axis=0), stack.var(axis=0, ddof=1)


def assert_same_picture(one, two):
    """Most blocks agree within their noise, and all do within a loose bound."""
    z = np.abs(z_scores((one[0], two[0]), (one[1] + 1e-7, two[1] + 1e-7), (4, 4)))
    assert np.median(z) < 2.0
    relative = np.abs(one[0] - two[0]) / (one[0] + 0.02)
    assert np.quantile(relative, 0.95) < 0.12 and relative.mean() < 0.04


def test_far_coordinates_show_the_same_picture(tmp_path):
    """At 5e6 m, where float32 knows half metres only."""
    (tmp_path / "near").mkdir()
    (tmp_path / "far").mkdir()
    near = write_scenario(tmp_path / "near", vehicles=6)
    far = write_scenario(tmp_path / "far", vehicles=6, offset=(5e6, 5e6))
    assert_same_picture(halves(near, 4.5), halves(far, 4.5))


def test_the_scalar_variant_shows_the_same_picture(tmp_path):
    place = write_scenario(tmp_path, vehicles=4, signals=True)
    assert_same_picture(halves(place, 4.5), halves(place, 4.5, variant="scalar"))


def test_a_ride_over_the_renderers_grid(tmp_path):
    """The eye crosses x = 125 m, where the origin jumps by 250 m; alone or in a film."""
    place = write_scenario(tmp_path, vehicles=2, end=20.0, signals=True)
    arguments = ["--camera", "driver", "--from", "16", "--to", "18", "--fps", "4", "--spp", "1"]
    run("render", place, *arguments, "-o", tmp_path / "ride.mp4")
    frames = frames_in(tmp_path / "ride.frames")
    account = json.loads((tmp_path / "ride.json").read_text(encoding="utf-8"))
    eyes = [frame["camera"]["position"][0] for frame in account["frames"]]
    assert min(eyes) < 125 < max(eyes)
    means = np.array([picture.mean() for picture in frames.values()])
    assert (np.abs(means / np.median(means) - 1) < 0.15).all()
    run("render", place, *arguments, "--frames", "7:8", "-o", tmp_path / "last.mp4")
    assert_equal_frames(frames_in(tmp_path / "last.frames"), frames)


def test_scalar_renders_an_example(tmp_path):
    run(
        *["still", example("crossing"), "--time", "460", "--size", "32x18", "--spp", "1"],
        *["--quality", "draft", "--variant", "scalar", "-o", tmp_path / "a.exr"],
    )
    picture = read_exr(tmp_path / "a.exr")[0]
    assert np.isfinite(picture).all() and picture.max() > 0


def test_files_of_the_builder_are_what_sumo_writes():
    assert "trafficLight" not in network_xml() and network_xml(signals=True).count("linkIndex") == 2
    assert fcd_xml(end=2, step=0.5).count("<timestep") == 5


def test_slow_motion_as_pictures_and_as_a_film(place, tmp_path):
    """Four times slower; the JSON beside it tells the times."""
    slow = ["--from", "4", "--to", "4.2", "--fps", "10", "--spp", "1", "--speed", "0.25"]
    run("render", place, "--camera", "post", *slow, "-o", tmp_path / "s_{frame}.png")
    assert sorted(path.name for path in tmp_path.glob("*.png")) == [
        f"s_{number:06d}.png" for number in range(8)
    ]
    account = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    assert (account["speed"], account["frame_rate"]) == (0.25, "10")
    times = [frame["time"] for frame in account["frames"]]
    assert times == pytest.approx([4 + n / 40 for n in range(8)], abs=1e-9)
    run("develop", tmp_path / "s.frames", "-o", tmp_path / "s.webm", "--fps", "30000/1001")
    assert str(probe(tmp_path / "s.webm").fps) == "30000/1001"
