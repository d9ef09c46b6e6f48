"""Where a factor acts, by the keys that its levels set."""

from typing import Any

import pytest
from builders import write_scenario

from sumo3dviz_pt import catalog
from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.study import ActSettings
from sumo3dviz_pt.studies.certificate.acts import Acts, acts_of, key_of, matches
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study


@pytest.mark.parametrize(
    ("change", "reshaped", "repainted", "left"),
    [
        ("vehicles.by_id.car.7.colour: #ffffff -> #c00000", (), ("vehicle:car.7",),
         ("vehicle:car.70", "vehicle:car.6", "tree:3")),
        ("vehicles.by_id.car.7: only the first has it", ("vehicle:car.7",), (), ("vehicle:car.8",)),
        ("vehicles.by_id.bus_*.colour: a -> b", (), ("vehicle:bus_3",), ("vehicle:car",)),
        ("vehicles.by_id.a[1].colour: a -> b", (), ("vehicle:a[1]",), ("vehicle:a1",)),
        ("traffic.rides.car.7.gap: 1.0 -> 2.0", ("vehicle:car.7",), (), ("vehicle:car.8",)),
        ("traffic.rides.car.7: only the first has it", ("vehicle:car.7",), (), ("tree:3",)),
        ("traffic.share: 1.0 -> 0.5", ("vehicle:x",), (), ("tree:3",)),
        ("ground.planting: auto -> none", ("tree:3", "shrub:9"), (), ("home:4", "vehicle:car.7")),
        ("objects.homes.scale: 1 -> 2", (), (), ("tree:3", "vehicle:x")),
        ("scenario.trajectories: a.xml -> b.xml", ("vehicle:x", "person:y"), (), ("tree:3",)),
        ("weather.fog.visibility: 100.0 -> 200.0", (), ("home:4", "vehicle:x", "edge:3"), ()),
        ("weather.wetness: 0.0 -> 1.0", (), ("home:4", "vehicle:x", "edge:3"), ()),
        ("weather.windscreen: null -> false", (), ("home:4", "vehicle:x", "edge:3"), ()),
        ("weather.course.0.rain.rate: 0.0 -> 5.0", ("tree:3", "edge:3"), ("vehicle:x",), ()),
        ("weather.snow.depth: 0.0 -> 0.03", ("tree:3", "edge:3"), ("vehicle:x", "home:4"), ()),
        ("weather.wind.speed: 0.0 -> 8.0", ("tree:3", "shrub:9"), (), ("vehicle:x", "home:4")),
        ("weather.season: summer -> winter", ("tree:3",), (), ("vehicle:x", "home:4")),
    ],
)  # fmt: skip
def test_keys_act_on_what_they_are_about(change, reshaped, repainted, left):
    acts = acts_of([change])
    assert all(acts.may_reshape(name) for name in reshaped)
    assert all(acts.may_look(name) and not acts.may_reshape(name) for name in repainted)
    assert not any(acts.may_look(name) for name in left)
    assert not acts.anything


@pytest.mark.parametrize(
    ("key", "reshaped"),
    [("weather.rain.rate", True), ("weather.preset", True), ("weather.course", True),
     ("weather.windscreen", True), ("weather.fog.visibility", False), ("weather.wetness", False)],
)  # fmt: skip
def test_wipers_of_the_own_vehicle_rest_by_dry_weather_only(key, reshaped):
    acts = acts_of([f"{key}: a -> b"], rider="car[7]")
    assert acts.may_reshape("vehicle:car[7]") is reshaped
    assert not acts.may_reshape("vehicle:car7") and "{" not in str(acts)
    assert not any("vehicle" in each for each in acts_of([f"{key}: a -> b"]).things)


def test_light_keeps_all_shapes_and_brings_its_exposure():
    acts = acts_of(["sky.preset: a -> b", "lights: auto -> on", "template: a -> b"])
    assert acts.light and acts.develops and not acts.moves
    assert not acts.may_look("tree:3", "vegetation")


def test_labels_stand_for_many_things():
    assert acts_of(["objects.homes.scale: 1 -> 2"]).may_reshape("home:4", "building")
    assert matches(("label:vegetation",), "whatever", "vegetation")


def test_an_unknown_key_acts_on_anything_and_several_keys_together():
    assert acts_of(["seed: 7 -> 8"]).anything
    both = acts_of(["lights: a -> b", "vehicles.by_id.x.colour: a -> b"])
    assert both.light and both.may_look("vehicle:x") and not both.may_reshape("vehicle:x")
    assert str(Acts()) == "nothing"


def test_a_study_file_may_say_it():
    acts = Acts.asked(ActSettings(things=("sign:*",), light=True))
    assert acts.may_reshape("sign:3") and acts.light and not acts.motion
    assert str(acts) == "the shape of sign:*; sky, sun and lamps"


def test_most_keys_of_a_scene_file_have_a_rule():
    """What is left acts on anything, on purpose."""
    free = {key for key in Job.model_fields if acts_of([f"{key}.x: 1 -> 2"]).anything}
    assert free <= {"scenario", "seed", "quality", "textured", "output", "template", "objects",
                    "lights", "schema_version"}  # fmt: skip


def test_exposure_is_development_and_a_shutter_shows_other_times():
    exposure = acts_of(["cameras.a.exposure.mode: auto -> manual"])
    assert exposure.picture and not exposure.moves and not exposure.may_look("vehicle:x")
    shutter = acts_of(["cameras.a.shutter: None -> {'angle': 180.0}"])
    assert shutter.moves and shutter.motion
    lens = acts_of(["cameras.a.lens.f_number: 2.0 -> 8.0"])
    assert lens.moves and not lens.motion


WET = ("edge:3", "junction:2", "home:4", "vehicle:x")
"""Things that look otherwise in rain, and keep their shape."""


def changed_by(folder, one: str, other: str) -> list[str]:
    """What a study says of two levels of weather."""
    write_scenario(folder)
    (folder / "study.yaml").write_text(
        f"scene: scene.yaml\nfactors: {{weather: {{levels: {{one: {one}, other: {other}}}}}}}\n",
        encoding="utf-8",
    )
    (pair,) = plan_study(load_study(folder / "study.yaml")).pairs
    return list(pair.changed)


@pytest.mark.parametrize(
    ("preset", "keys"),
    [
        ("after_rain", ["preset", "puddles", "wetness"]),
        ("dense_fog", ["fog.height", "fog.visibility", "preset", "puddles", "wetness"]),
        ("downpour", ["preset", "puddles", "rain.rate", "wind.from", "wind.speed"]),
        ("drizzle", ["fog.visibility", "preset", "puddles", "rain.rate", "wind.from",
                     "wind.speed"]),
        ("fog", ["fog.height", "fog.visibility", "preset", "puddles", "wetness"]),
        ("rain", ["preset", "puddles", "rain.rate", "wind.from", "wind.speed"]),
        ("snow", ["preset", "season", "snow.depth", "snow.roads"]),
        ("snowfall", ["preset", "season", "snow.depth", "snow.falling", "snow.roads",
                      "wind.from", "wind.speed"]),
    ],
)  # fmt: skip
def test_a_preset_against_no_weather_changes_what_it_says_and_no_more(tmp_path, preset, keys):
    changed = changed_by(tmp_path, "{}", f"{{weather: {{preset: {preset}}}}}")
    assert [key_of(change) for change in changed] == [f"weather.{key}" for key in keys]
    acts = acts_of(changed)
    snows, blows = "snow.depth" in keys, "wind.speed" in keys
    assert acts.light and all(acts.may_look(name) for name in WET)
    assert [acts.may_reshape(name) for name in WET] == [snows, snows, False, False]
    assert acts.may_reshape("tree:3") == (snows or blows)


def test_the_table_of_presets_is_whole():
    tested: Any = test_a_preset_against_no_weather_changes_what_it_says_and_no_more
    (cases,) = [mark for mark in tested.pytestmark if mark.name == "parametrize"]
    assert [preset for preset, _ in cases.args[1]] == sorted(catalog.template_names("weather"))


def test_one_wind_in_both_levels_leaves_plants_their_shape(tmp_path):
    wind = "wind: {speed: 4 m/s, from: 270}"
    changed = changed_by(
        tmp_path, f"{{weather: {{{wind}}}}}", f"{{weather: {{preset: rain, {wind}}}}}"
    )
    assert [key_of(change) for change in changed] == [
        "weather.preset", "weather.puddles", "weather.rain.rate"
    ]  # fmt: skip
    assert not acts_of(changed).may_reshape("tree:3")


def test_defaults_that_are_said_are_no_change(tmp_path):
    said = "{weather: {wetness: 0.5, season: summer, course: []}}"
    assert changed_by(tmp_path, "{}", said) == ["weather.wetness: null -> 0.5"]


def test_the_example_of_weather_changes_water_and_no_shape():
    plan = plan_study(load_study(data_root("examples") / "crossing" / "study_weather.yaml"))
    pairs = [pair for pair in plan.pairs if pair.factor == "weather"]
    keys = {tuple(key_of(change) for change in pair.changed) for pair in pairs}
    assert keys == {("weather.preset", "weather.puddles", "weather.rain.rate")} and len(pairs) == 2
    acts = acts_of(pairs[0].changed)
    assert acts.light and not any(acts.may_reshape(name) for name in (*WET, "tree:3"))
