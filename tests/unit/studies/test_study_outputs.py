"""What goes with films: thumbnails, notes, stale files; and the command's words."""

from __future__ import annotations

import numpy as np
import pytest
from builders import write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.image.png import read_text
from sumo3dviz_pt.pipeline.costs import space_in_words
from sumo3dviz_pt.pipeline.films.encoding import sealed
from sumo3dviz_pt.pipeline.films.frames import account_file, write_json
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.outputs import content_of, sheet, write_outputs
from sumo3dviz_pt.studies.plan import forecast, plan_study
from sumo3dviz_pt.studies.records import FilmRecord, film_path, finished_films, write_record
from sumo3dviz_pt.studies.run import (
    StudyOrder,
    check_study,
    film_tasks,
    finish_study,
    plan_in_words,
)
from sumo3dviz_pt.studies.tools.datasets import digest_of
from sumo3dviz_pt.video import encode

STUDY = """scene: scene.yaml
clip: {camera: post, from: 2, to: 2.2}
factors:
  light: {levels: {clear: {sky: {preset: sky_blue}}, grey: {sky: {preset: sky_overcast}}}}
  trees: {levels: {some: {}, none: {ground: {planting: none}}}}
certificate: {write: false}
report: {write: false}
"""

CERTIFIED = STUDY.replace("certificate: {write: false}\n", "")
REPORTED = STUDY.replace("report: {write: false}\n", "")


ACCOUNT = {"frames": [{}, {}], "fps": 10.0, "frame_rate": "10", "inputs": {"a.xml": "12"}}


@pytest.fixture
def place(tmp_path):
    write_scenario(tmp_path, vehicles=2)
    return tmp_path


def planned(folder, text=STUDY):
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    return plan_study(load_study(folder / "study.yaml"))


def filmed(folder, plan, *, shades=(40, 80, 120, 160)):
    """A folder in which films of plain colours stand for rendered ones."""
    films = {}
    for stimulus, shade in zip(plan.stimuli, shades, strict=False):
        path = film_path(folder, plan, stimulus)
        path.parent.mkdir(parents=True, exist_ok=True)
        encode([np.full((36, 64, 3), shade, np.uint8)] * 2, path, size=(64, 36), fps=10)
        account = sealed(ACCOUNT)
        write_json(account_file(path), account)
        films[stimulus.name] = FilmRecord(
            stimulus.digest, "scalar", digest_of(path), account["digest"], 2, "10", 0.2, (64, 36),
            layers=stimulus.job.output.layers,
        )  # fmt: skip
        path.with_suffix(".layers").mkdir(exist_ok=True)
    write_record(folder, plan, films)
    return films


def order(folder, **more):
    return StudyOrder(folder, variant="scalar", **more)


def test_films_that_are_there_are_not_rendered_again(place):
    plan, out = planned(place), place / "out"
    filmed(out, plan)
    assert not film_tasks(plan, order(out, resume=True))
    assert len(film_tasks(plan, order(out, overwrite=True))) == 4
    assert len(film_tasks(plan, StudyOrder(out, resume=True, variant="llvm"))) == 4


FULL = STUDY.replace("certificate: {write: false}\nreport: {write: false}\n", "")


@pytest.mark.parametrize(
    "more",
    [
        "certificate: {write: false}",
        "certificate: {frames: 9}",
        "report: {write: false}",
        "report: {white: 250, things: ['sign:*']}",
        "certificate: {write: false}\nreport: {write: false}",
        "tools: {write: [psychopy], cards: true}",
        "calibration: null",
        "playlists: {order: random, count: 3}",
        "question: {text: How fast?}\nabout: {title: Speeds}",
    ],
)
def test_what_no_pixel_hangs_on_renders_nothing_again(place, more):
    """All films were rendered again: what a study measures was part of what a film is."""
    plan, out = planned(place, FULL), place / "out"
    filmed(out, plan)
    toggled = planned(place, f"{FULL}{more}\n")
    assert [each.digest for each in toggled.stimuli] == [each.digest for each in plan.stimuli]
    assert not film_tasks(toggled, StudyOrder(out, resume=True, variant="scalar"))


def test_films_are_rendered_again_for_layers_that_are_missing(place, caplog):
    plan, out = planned(place), place / "out"
    filmed(out, plan)
    again = film_tasks(planned(place, FULL), StudyOrder(out, resume=True, variant="scalar"))
    assert len(again) == 4
    (said,) = [r.getMessage() for r in caplog.records if "rendered again" in r.getMessage()]
    assert "4 films" in said and "for instance, depth, normals and albedo, which" in said


def test_a_film_that_somebody_changed_is_rendered_again(place):
    plan, out = planned(place), place / "out"
    filmed(out, plan)
    film_path(out, plan, plan.stimuli[0]).write_bytes(b"another film")
    (task,) = film_tasks(plan, order(out, resume=True))
    assert task.stimulus == plan.stimuli[0]
    # One whose account was edited is made again, too: of its own frames, as they lie.
    account = account_file(film_path(out, plan, plan.stimuli[1]))
    write_json(account, {**sealed(ACCOUNT), "fps": 11.0})
    found = [task.stimulus for task in film_tasks(plan, order(out, resume=True))]
    assert found == list(plan.stimuli[:2])


@pytest.mark.parametrize("text", ["", "{}", '{"films": 3}', '{"films": {"clear_some": {}}}', "[1]"])
def test_a_damaged_record_only_costs_time(place, text):
    plan, out = planned(place), place / "out"
    filmed(out, plan)
    (out / "study.json").write_text(text, encoding="utf-8")
    assert finished_films(out, plan, variant="scalar") == {}


def test_a_study_is_not_finished_before_all_films_are(place):
    plan, out = planned(place), place / "out"
    filmed(out, plan, shades=(40, 80))
    with pytest.raises(ConfigError, match=r"2 films are missing, the first is .*; go on with"):
        finish_study(plan, order(out))


def test_pairs_that_look_alike_are_noted(place, caplog):
    plan, out = planned(place), place / "out"
    filmed(out, plan, shades=(40, 80, 40, 120))
    names = {plan.stimuli[0].name, plan.stimuli[2].name}
    alike = [pair for pair in plan.pairs if {pair.one, pair.other} == names]
    finish_study(plan, order(out))
    said = [record.getMessage() for record in caplog.records]
    assert len([words for words in said if "are the same film: what" in words]) == len(alike)
    assert ("is not seen" in (out / "README.md").read_text("utf-8")) == bool(alike)


def test_files_of_an_earlier_run_go_and_films_and_changed_files_stay(place):
    out = place / "out"
    plan = planned(place)
    films = filmed(out, plan)
    write_outputs(out, plan, films)
    assert (out / "psychopy" / "playlist_4.csv").exists()
    (out / "psychopy" / "playlist_3.csv").write_text("mine now", encoding="utf-8")
    fewer = planned(
        place, f"{STUDY}playlists: {{count: 2}}\nexclude: [{{light: grey, trees: none}}]\n"
    )
    files = write_outputs(out, fewer, films)
    assert not (out / "psychopy" / "playlist_4.csv").exists()
    assert (out / "psychopy" / "playlist_3.csv").read_text("utf-8") == "mine now"
    assert (out / "materials" / "grey_none.mp4").exists()
    assert not any("grey_none.mp4" in file.name for file in files)
    assert not (out / "thumbnails" / "grey_none.png").exists()


def test_writing_again_gives_the_same_bytes(place):
    plan, out = planned(place), place / "out"
    films = filmed(out, plan)
    first = {file: file.read_bytes() for file in write_outputs(out, plan, films)}
    assert {file: file.read_bytes() for file in write_outputs(out, plan, films)} == first


def test_thumbnails_are_the_films_own_pictures(place):
    plan, out = planned(place), place / "out"
    write_outputs(out, plan, filmed(out, plan))
    for stimulus in plan.stimuli:
        assert read_text(out / "thumbnails" / f"{stimulus.name}.png") == {}
    page = (out / "contact_sheet.html").read_text("utf-8")
    assert page.count("<video ") == 4 and "light grey, trees none" in page


@pytest.mark.parametrize("seed", range(4))
def test_films_are_listed_by_levels_however_the_design_is_shuffled(place, seed):
    """In the words before rendering, and on the contact sheet."""
    plan, out = planned(place, f"{STUDY}seed: {seed}\n"), place / "out"
    names = ["clear_some", "clear_none", "grey_some", "grey_none"]
    assert [each.name for each in plan.listed] == names
    films = filmed(out, plan)
    told = plan_in_words(plan, ()).split("\nfilms\n")[1].splitlines()[:4]
    assert [line.split()[0] for line in told] == names
    assert [clip.name for clip in content_of(plan, films).films] == names


def test_a_sheet_has_every_picture_in_its_place():
    shades = [np.full((18, 32, 3), shade, np.uint8) for shade in (10, 20, 30, 40, 50)]
    whole = sheet(shades, list("abcde"))
    assert whole.shape == (2 * 46 + 8, 3 * 248 + 8, 3)
    for place, picture in enumerate(shades):
        top, left = 8 + place // 3 * 46, 8 + place % 3 * 248
        assert (whole[top : top + 18, left : left + 32] == picture[0, 0]).all()
    assert (whole[-1, -1] == 119).all()


LONG = "evening_with_rain_many_trees_a_red_car_ahead_and_nobody_at_the_kerb_to_the_right"


@pytest.mark.parametrize("name", ["day_none_red", LONG, LONG.replace("_", ""), "ü" * 40])
def test_every_name_stands_whole_below_its_picture(name):
    """The sheet had no names, so that nobody knew which film was which."""
    picture = np.zeros((18, 96, 3), np.uint8)
    below = []
    for words in (name, name + "i"):
        whole = sheet([picture] * 2, [words, "b"])
        rows, columns = np.nonzero(whole[26:, 8:248, 0] > 200)  # ink below the first picture
        assert len(rows) and rows.max() < len(whole) - 26 - 8
        assert not (whole[26:, 248:256] != 119).any(), "it reaches the next film's place"
        assert columns.min() < 4
        below.append(whole[26:, :256].tobytes())
    # The last letter is seen, too: nothing is cut off.
    assert below[0] != below[1]


# Checks before any work ----------------------------------------------------------------------


def test_rides_are_looked_up_before_anything_is_rendered(place):
    ride = STUDY.replace("camera: post", "camera: driver")
    check_study(planned(place, ride), order(place / "out"))
    plan = planned(place, f"{ride}common: {{cameras.driver.vehicle: v9}}\n")
    with pytest.raises(ConfigError, match="v9"):
        check_study(plan, order(place / "out"))


def test_films_of_odd_sizes_are_refused(place):
    plan = planned(place, f"{STUDY}common: {{output.size: [33, 18]}}\n")
    with pytest.raises(ConfigError, match="width and height must be even"):
        check_study(plan, order(place / "out"))


# Python ------------------------------------------------------------------------------------


def test_python_makes_the_same_folder(place):
    """All films are there already, so nothing is rendered."""
    plan, out = planned(place), place / "out"
    filmed(out, plan)
    study = sv.Study(place / "study.yaml")
    assert repr(study).endswith("study.yaml: 4 films, 4 trials, 4 playlists>")
    assert "pairs that are compared, 4 of 6, and in what they differ" in str(study)
    films = study.render(out, resume=True, variant="scalar")
    assert [path.stem for path in films] == [stimulus.name for stimulus in plan.stimuli]
    assert (out / "index.html").exists() and (out / "checksums.sha256").exists()
    with pytest.raises(ConfigError, match="resumee: this choice is unknown; did you mean 'resume'"):
        study.render(out, resumee=True)


# The command -------------------------------------------------------------------------------


def test_a_trial_has_small_coarse_films_unless_they_are_set_otherwise(place, capsys):
    planned(place, f"{STUDY}common: {{quality: study, output.size: [1280, 722]}}\n")
    words = ["study", str(place / "study.yaml"), "-o", str(place / "out"), "--dry-run", "--trial"]
    assert main(words) == 0
    assert "post 2 to 2.2 s, 1 frame, 320x180, draft" in capsys.readouterr().out
    assert main([*words, "--set", "output.size=[64, 36]", "--set", "output.fps=10"]) == 0
    assert "post 2 to 2.2 s, 2 frames, 64x36, draft" in capsys.readouterr().out


def test_a_dry_run_says_what_would_be_shown_and_makes_nothing(place, capsys):
    planned(place)
    assert main(["study", str(place / "study.yaml"), "-o", str(place / "out"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "design full, 4 profiles in 4 trials, 4 playlists" in said
    assert "  light            2 pairs: sky.preset\n" in said
    assert "there    0 of 4 films" in said and "cost     8 frames of 4 films: about" in said
    assert not (place / "out").exists()


def test_a_forecast_ends_where_the_log_does(place):
    """The log ends at 12 s: of 5 s at 25 frames a second, 2 and its last frame are there."""
    plan = planned(place, STUDY.replace("from: 2, to: 2.2", "from: 10, to: 15"))
    fps = plan.stimuli[0].job.output.fps
    assert forecast(plan, plan.stimuli[:1]).frames == 2 * fps + 1
    assert f"{2 * fps + 1} frames" in plan_in_words(plan, plan.stimuli)


def test_a_dry_run_says_why_films_that_are_there_would_be_made_anew(place, capsys):
    plan = planned(place)
    (place / "out" / "materials").mkdir(parents=True)
    (place / "out" / "materials" / f"{plan.stimuli[0].name}.mp4").write_bytes(b"x")
    assert main(["study", str(place / "study.yaml"), "-o", str(place / "out"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert f"anew     {plan.stimuli[0].name}: no record says what it was made from\n" in said
    assert said.count("anew ") == 1


def test_a_forecast_counts_layers_certificate_and_report(place):
    def forecast_of(text):
        plan = planned(place, text.replace("clip:", "common: {output.size: [1280, 720]}\nclip:"))
        return forecast(plan, plan.stimuli)

    plain, reported, certified = (forecast_of(text) for text in (STUDY, REPORTED, CERTIFIED))
    assert (plain.layers_mb, plain.measuring, plain.measuring_seconds) == (0.0, (), 0.0)
    assert "layers" not in str(plain) and "then" not in str(plain)
    # 8 frames of 0.92 megapixels: instances alone, and with depth, normals and albedo.
    assert reported.layers_mb == pytest.approx(8 * 0.9216 * 0.15)
    assert certified.layers_mb == pytest.approx(8 * 0.9216 * 6.5)
    more = 3600 * (certified.cpu_hours - plain.cpu_hours)
    assert more == pytest.approx(8 * 0.4, rel=0.05)  # 0.4 CPU-seconds a frame, as docs/layers.md
    assert plain.wall_seconds < reported.wall_seconds < certified.wall_seconds
    assert certified.measuring == ("the certificate",) and reported.measuring == ("the report",)
    # Four pairs of two frames are compared, four films of two decoded.
    compared, decoded = 8 * (0.08 + 1.6 * 0.9216), 4 * 0.02 + 8 * 0.02 * 0.9216
    assert certified.measuring_seconds == pytest.approx(compared + decoded)
    both = forecast_of(STUDY[: STUDY.index("certificate")])
    assert both.measuring_seconds == pytest.approx(
        certified.measuring_seconds + reported.measuring_seconds
    )
    assert str(both).endswith("for the certificate and the report")
    assert f"{space_in_words(both.layers_mb)} of layers" in str(both)


def test_what_is_measured_again_is_said_where_all_films_are_there(place):
    plan = planned(place, CERTIFIED)
    assert str(forecast(plan, ())).startswith("nothing to render, then ")
    assert str(forecast(planned(place), ())) == "nothing to render"


def test_the_command_line_sets_values_for_all_films(place, capsys):
    planned(place)
    arguments = ["study", str(place / "study.yaml"), "-o", str(place / "out"), "--dry-run"]
    assert main([*arguments, "--set", "output.size=[32, 18]", "--set", "quality=preview"]) == 0
    assert capsys.readouterr().out.count("32x18, preview") == 4


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.yaml", "-o", "out"], "nothing.yaml: there is no such study file"),
        (["scene.yaml", "-o", "out"], "is a scene file, not a study file"),
        (["study.yaml", "-o", "scene.yaml"], "is a file; give a folder"),
        (["study.yaml", "-o", "out", "--set", "quality"], "has no value"),
    ],
)
def test_wrong_commands_are_one_sentence_and_exit_2(place, capsys, monkeypatch, arguments, words):
    planned(place)
    monkeypatch.chdir(place)
    assert main(["study", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1


@pytest.mark.parametrize("text", [CERTIFIED, REPORTED], ids=["certificate", "report"])
def test_a_variant_without_layers_is_refused_if_films_are_measured(place, text):
    plan = planned(place, text)
    with pytest.raises(ConfigError, match="variant scalar traces no layers"):
        check_study(plan, order(place / "out"))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (CERTIFIED, {"instance", "depth", "normals", "albedo"}),
        (REPORTED, {"instance"}),
        (REPORTED + "common: {output.layers: [flow]}\n", {"flow", "instance"}),
        (STUDY, set()),
    ],
    ids=["certificate", "report", "report and flow", "neither"],
)
def test_a_study_asks_for_the_layers_that_are_measured(place, text, wanted):
    plan = planned(place, text)
    assert all(wanted == {*each.job.output.layers} for each in plan.stimuli)
    assert not any("layers" in change for pair in plan.pairs for change in pair.changed)
