"""Study files: what they hold, and one sentence with file, line and key for all that is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.job.study import StudySettings
from sumo3dviz_pt.job.values import all_models
from sumo3dviz_pt.studies.file import load_study, study_schema
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.run import plan_in_words

SCENE = """scenario: {network: a.net.xml, trajectories: fcd.xml}
cameras:
  post: {mode: eulerian, position: [0, 0, 5], heading: 90}
  ride: {mode: lagrangian, vehicle: flow_0.3}
shots:
  - {camera: post, from: 0, to: 4}
"""

STUDY = """scene: scene.yaml
seed: 3
common: {quality: draft, output.size: [64, 36]}
factors:
  light:
    about: time of day
    levels:
      day: {template: city_day}
      night: {template: city_night}
  trees:
    levels:
      some: {}
      none: {ground: {planting: none}}
"""


def write(folder: Path, study: str = STUDY, scene: str = SCENE) -> Path:
    (folder / "scene.yaml").write_text(scene, encoding="utf-8")
    (folder / "a.net.xml").write_text("<net/>", encoding="utf-8")
    (folder / "fcd.xml").write_text("<fcd-export/>", encoding="utf-8")
    path = folder / "study.yaml"
    path.write_text(study, encoding="utf-8")
    return path


def plan(folder: Path, study: str = STUDY, scene: str = SCENE, **more):
    return plan_study(load_study(write(folder, study, scene)), **more)


def complaint(folder: Path, study: str, scene: str = SCENE, kind=ConfigError) -> str:
    with pytest.raises(kind) as caught:
        plan(folder, study, scene)
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(f"{folder}{'/' if '/' in str(folder) else chr(92)}", "")


def test_levels_patch_the_scene(tmp_path):
    found = plan(tmp_path)
    films = {stimulus.name: stimulus.job for stimulus in found.stimuli}
    assert set(films) == {"day_some", "day_none", "night_some", "night_none"}
    assert films["night_none"].lights == "on" and films["day_none"].lights == "auto"
    assert (
        films["day_none"].ground.planting == "none" and films["day_some"].ground.planting == "auto"
    )
    for job in films.values():
        assert (job.output.size, job.quality) == ((64, 36), "draft")
        assert job.scenario.network == tmp_path / "a.net.xml"


def test_nested_keys_may_hold_dots_and_dotted_keys_lead_down(tmp_path):
    text = STUDY.replace(
        "{template: city_day}", "{vehicles: {by_id: {flow_0.3: {colour: '#ff0000'}}}}"
    )
    text = text.replace("{template: city_night}", "{cameras.post.position: [0, 0, 9]}")
    jobs = {stimulus.name: stimulus.job for stimulus in plan(tmp_path, text).stimuli}
    assert jobs["day_some"].vehicles.by_id["flow_0.3"].colour == "#ff0000"
    assert jobs["night_some"].cameras["post"].position == (0, 0, 9)
    assert jobs["night_some"].cameras["post"].heading == 90


def test_the_clip_is_the_only_shot(tmp_path):
    text = f"{STUDY}clip: {{camera: ride, from: 1, to: 3}}\n"
    (shot,) = {stimulus.shot for stimulus in plan(tmp_path, text).stimuli}
    assert (shot.camera, shot.start, shot.end) == ("ride", 1, 3)


def test_the_command_line_wins(tmp_path):
    found = plan(tmp_path, overrides={"quality": "preview"})
    assert {stimulus.job.quality for stimulus in found.stimuli} == {"preview"}


def test_factors_that_are_told_share_films(tmp_path):
    text = STUDY.replace("none: {ground: {planting: none}}", "none: {}")
    found = plan(tmp_path, text)
    assert {stimulus.name for stimulus in found.stimuli} == {"day", "night"}
    assert len(found.profiles) == 4 and not found.notes
    assert [pair.factor for pair in found.pairs] == ["light"]


def test_pairs_differ_in_one_factor_and_say_in_what(tmp_path):
    found = plan(tmp_path)
    assert [pair.factor for pair in found.pairs] == ["light", "light", "trees", "trees"]
    trees = found.pairs[2]
    assert trees.levels == ("some", "none") and trees.changed == ("ground.planting: auto -> none",)
    assert all(pair.levels == ("day", "night") for pair in found.pairs[:2])


def test_a_level_that_hides_another_is_noted(tmp_path):
    """A sky of its own wins over the templates, which differ in nothing else."""
    text = STUDY.replace("city_day", "highway_day").replace("city_night", "overcast")
    text = text.replace("{ground: {planting: none}}", "{sky: {preset: sky_blue}}")
    found = plan(tmp_path, text)
    assert len(found.profiles) == 4 and len(found.stimuli) == 3
    (note,) = found.notes
    assert "is the same film as" in note and note.endswith("one level hides the other")


def test_films_that_do_not_change_keep_name_and_digest(tmp_path):
    before = {each.name: each.digest for each in plan(tmp_path).stimuli}
    after = {
        each.name: each.digest
        for each in plan(tmp_path, STUDY.replace("city_night", "city_dusk")).stimuli
    }
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {"night_some", "night_none"}


def test_a_log_counts_by_content(tmp_path):
    first = {each.digest for each in plan(tmp_path).stimuli}
    (tmp_path / "fcd.xml").write_text("<fcd-export></fcd-export>", encoding="utf-8")
    second = {each.digest for each in plan_study(load_study(tmp_path / "study.yaml")).stimuli}
    assert not first & second


def test_codes_tell_nothing(tmp_path):
    for stimulus in plan(tmp_path, f"{STUDY}names: codes\n").stimuli:
        assert stimulus.name == stimulus.code and stimulus.code[0] == "s"


def test_codes_stay_when_the_program_changes_and_digests_do_not(tmp_path, monkeypatch):
    before = plan(tmp_path).stimuli
    monkeypatch.setattr("sumo3dviz_pt.studies.stimuli.versions", lambda: {"mitsuba": "9"})
    after = plan(tmp_path).stimuli
    assert [each.code for each in before] == [each.code for each in after]
    assert not {each.digest for each in before} & {each.digest for each in after}


def test_odd_level_names_make_sound_file_names(tmp_path):
    text = STUDY.replace("day:", '"Tag / 12:30":').replace("night:", '"夜":')
    names = {stimulus.name for stimulus in plan(tmp_path, text).stimuli}
    assert {name.split("_")[0] for name in names} >= {"Tag-12-30"}
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyzTABCDEF0123456789-_.") for name in names)


def test_no_film_is_called_like_a_device_of_windows(tmp_path):
    text = STUDY.replace("some: {}", "aux: {}").replace("      day: {template: city_day}\n", "")
    text = text.replace("night: {template: city_night}", "a: {}\n      b: {}")
    films = plan(tmp_path, text).stimuli
    assert {film.name == film.code for film in films} == {True, False}


def test_overrides_of_a_study_file_win_as_those_of_the_command_do(tmp_path):
    text = f"{STUDY}overrides: {{quality: preview, ground.planting: auto}}\n"
    found = plan(tmp_path, text.replace("planting: none", "planting: none, scale: 2"))
    assert {each.job.quality for each in found.stimuli} == {"preview"}
    assert {each.job.ground.planting for each in found.stimuli} == {"auto"}
    asked = plan(tmp_path, STUDY.replace("none: {ground: {planting: none}}", "x: {seed: 9}"),
                 overrides={"quality": "preview"})  # fmt: skip
    assert {each.job.quality for each in asked.stimuli} == {"preview"}


def test_choice_tasks_are_made_and_told(tmp_path):
    text = f"{STUDY}design: choices\nchoices: {{tasks: 2, none: true}}\n"
    found = plan(tmp_path, f"{text}playlists: {{places: balanced}}\n")
    assert [len(trial.alternatives) for trial in found.designed] == [3, 3]
    assert any(note.startswith("2 choice tasks have a D-error of") for note in found.notes)
    assert len(found.playlists) == 4 and len(found.trials) == 4
    assert "D-error" in plan_in_words(found, found.stimuli)
    assert len(plan(tmp_path, f"{text}playlists: {{places: balanced, count: 3}}\n").playlists) == 3


def test_parts_and_counts_that_balance_nothing_are_noted(tmp_path):
    notes = " ".join(plan(tmp_path, f"{STUDY}playlists: {{parts: 2, count: 3}}\n").notes)
    assert "parts of block 1 do not share light x trees evenly" in notes
    assert "3 playlists are no multiple of what the order takes" in notes
    assert plan(tmp_path).notes == ()


# Wrong files -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seed: 3", "sede: 3", "study.yaml:2:1: sede: this key is unknown; did you mean 'seed'?"),
        (
            "  light:",
            "  2light:",
            "study.yaml:5:3: factors.2light: a factor's name becomes a variable",
        ),
        ("  light:", "  class:", "factors.class: a factor's name becomes a variable"),
        ("  light:", "  film:", "no factor can be called 'film', a column of the tables is"),
        ("  light:", "  Trees:", "the factors 'Trees' and 'trees' differ in capitals only"),
        ("day: {template: city_day}", "day: {}", ""),
        (
            "night: {template: city_night}",
            "",
            "study.yaml:7:5: factors.light.levels: this should have at",
        ),
        (
            "city_night",
            "city_nihgt",
            "study.yaml:9:7: factors.light.levels.night: template: no scene",
        ),
        (
            "planting: none",
            "planting: nono",
            "factors.trees.levels.none: ground.planting: this should",
        ),
        (
            "planting: none",
            "plating: none",
            "factors.trees.levels.none: ground.plating: this key is",
        ),
        ("planting: none", "planting: auto", "the levels 'some' and 'none' are the same scene"),
        (
            "{ground: {planting: none}}",
            "",
            "factors.trees.levels.none: this should be keys with values",
        ),
        (
            "city_day}",
            "city_day, ground.planting: none}",
            "factors.trees.levels.none: the factors light",
        ),
        ("quality: draft", "quality: darft", "study.yaml:3:1: common: quality: no quality preset"),
        ("scene: scene.yaml", "scene: other.yaml", "study.yaml:1:1: scene: there is no scene file"),
        (
            "seed: 3",
            "design: half",
            "study.yaml:2:1: design: this should be 'full', 'fraction', 'fraction_3', 'latin' or",
        ),
        ("seed: 3", "design: latin", "study.yaml:2:1: design: a Latin square takes three or more"),
        ("seed: 3", "design: fraction", "study.yaml:2:1: design: no orthogonal fraction exists"),
        (
            "seed: 3",
            "exclude: [{lihgt: day}]",
            "study.yaml:2:12: exclude.0.lihgt: no factor is called",
        ),
        (
            "seed: 3",
            "exclude: [{light: dya}]",
            "exclude.0.light: light has no level 'dya'; did you mean",
        ),
        (
            "seed: 3",
            "overrides: {quality: darft}",
            "study.yaml:2:1: overrides: quality: no quality preset",
        ),
        ("seed: 3", "design: choices", "design: choices goes with choices: {tasks: 12}"),
        ("seed: 3", "choices: {tasks: 3}", "design: choices goes with choices: {tasks: 12}"),
        (
            "seed: 3",
            "design: choices\nchoices: {tasks: 3, priors: {light: {dya: 1}}}",
            "choices.priors.light: there is no level 'dya'",
        ),
        ("seed: 3", "exclude: [{}]", "exclude.0: an exclusion names one factor at least"),
        ("seed: 3", "exclude: [{light: [day, night]}]", "study.yaml:2:1: exclude: nothing is left"),
        ("seed: 3", "clip: {camera: psot, from: 0, to: 1}", "no camera is called 'psot'"),
        ("seed: 3", "clip: {camera: post, from: 2, to: 1}", "clip: 'to' (1.0) must be later"),
        (
            "seed: 3",
            "playlists: {parts: 9}",
            "study.yaml:2:13: playlists.parts: block 1 has 4 trials",
        ),
        ("seed: 3", "tools: {write: [jspsyhc]}", "tools.write.0: this should be 'jspsych'"),
        ("seed: 3", "tools: {url: example.org}", "tools.url: an address begins with https://"),
        (
            "seed: 3",
            "tools: {jspsych: node_modules}",
            "tools.jspsych: a place to load from ends in /",
        ),
        (
            "seed: 3",
            "question: {language: english}",
            "question.language: a language is written like",
        ),
        (
            "    levels:\n      some",
            "      some",
            "factors.trees.some: this key is unknown; known: about",
        ),
        ("  trees:", "  trees_2:", "a factor's name cannot end in _ and digits"),
        ("seed: 3", "film: .gif", "film: this should be '.mp4', '.webm' or '.mov'"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, old, new, words):
    text = STUDY.replace(old, new)
    assert text != STUDY
    if words:
        assert words in complaint(tmp_path, text)
    else:
        assert plan(tmp_path, text)


def test_a_scene_with_several_shots_asks_for_a_clip(tmp_path):
    scene = f"{SCENE}  - {{camera: ride, from: 0, to: 1}}\n"
    words = complaint(tmp_path, STUDY, scene)
    assert words.startswith("study.yaml:1:1: scene: the scene has 2 shots, and a stimulus is one")


def test_faults_of_the_scene_file_are_its_own(tmp_path):
    assert complaint(tmp_path, STUDY, f"{SCENE}lihgts: on\n").startswith("scene.yaml:7:1: lihgts:")


def test_files_that_are_no_study(tmp_path):
    with pytest.raises(ConfigError, match="there is no such study file"):
        load_study(tmp_path / "none.yaml")
    assert "is a scene file, not a study file" in complaint(tmp_path, SCENE)
    assert "is a mapping of keys to values" in complaint(tmp_path, "- a\n- b\n")
    (tmp_path / "study.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="it is no text in UTF-8"):
        load_study(tmp_path / "study.yaml")


# Tables ------------------------------------------------------------------------------------


TABLE = "task,alternative,light,trees\n1,1,day,some\n1,2,night,none\n2,1,day,none\n2,2,day,some\n"


def tabled(folder: Path, table: str = TABLE, more: str = "") -> str:
    (folder / "design.csv").write_text(table, encoding="utf-8")
    return STUDY.replace("seed: 3", f"design: {{table: design.csv{more}}}")


def test_tables_show_only_what_they_name(tmp_path):
    found = plan(tmp_path, tabled(tmp_path))
    assert {stimulus.name for stimulus in found.stimuli} == {"day_some", "night_none", "day_none"}
    assert [len(trial.alternatives) for trial in found.trials] == [2, 2]


def test_tables_that_never_show_a_level_or_repeat_a_task_are_noted(tmp_path):
    found = plan(tmp_path, tabled(tmp_path, TABLE.replace("night", "day")))
    again = "1 of 2 tasks show what another of their block does, the first is task 2 of block 1"
    assert found.notes == ("the table never shows light night", again)


def test_tasks_in_which_one_profile_beats_another_are_noted(tmp_path):
    ranked = tabled(tmp_path).replace("  light:\n", "  light:\n    better: first\n")
    assert plan(tmp_path, ranked).notes == ()  # trees differ, and people in what they like
    ranked = ranked.replace("  trees:\n", "  trees:\n    better: first\n")
    assert plan(tmp_path, ranked).notes == (
        "2 of 2 tasks hold a profile that another one beats in everything, the first is task 1 of"
        " block 1",
    )


def test_a_table_that_shows_what_is_excluded_is_refused(tmp_path):
    text = tabled(tmp_path) + "exclude: [{light: night, trees: none}]\n"
    words = complaint(tmp_path, text, kind=InputError)
    assert words == "design.csv: shows light night, trees none, which the study file excludes"


def test_requests_of_tables_have_their_line(tmp_path):
    words = complaint(tmp_path, tabled(tmp_path, more=", codes: {light: {1.5: dya}}"))
    assert (
        words.startswith("study.yaml:2:") and "design.codes.light.1.5: light has no level" in words
    )


# Schema ------------------------------------------------------------------------------------


def test_the_schema_takes_what_study_files_hold():
    schema = study_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    check = jsonschema.Draft202012Validator(schema)
    good = yaml.safe_load(STUDY) | {
        "exclude": [{"light": "day", "trees": ["none", "some"]}],
        "design": {"table": "a.csv", "columns": {"light": "x"}, "none": {"a": 1}},
    }
    assert not list(check.iter_errors(good))
    assert list(check.iter_errors(good | {"sede": 1}))
    assert list(check.iter_errors({"scene": "a.yaml"}))


def test_every_key_says_what_it_means():
    schema = StudySettings.model_json_schema()
    for name, model in {"StudySettings": schema, **schema["$defs"]}.items():
        for key, value in model["properties"].items():
            assert value.get("description") or "$ref" in value, (name, key)
    assert {model.__name__ for model in all_models(StudySettings)} >= {
        "FactorSettings",
        "TableSettings",
    }
    assert json.dumps(schema)
