"""Every number of a scene file has a sane range; what is wrong is one sentence in our words."""

import pytest
from builders import complaints, write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.numbers import MOST_FRAMES
from sumo3dviz_pt.pipeline.production import frame_times
from sumo3dviz_pt.pipeline.scene_file import make_job

CAMERA = {"mode": "eulerian", "position": [0, 0, 5], "heading": 90}
RIDE = {"mode": "lagrangian", "vehicle": "a"}

WRONG = [
    ({"ground": {"scale": 1e6}}, "ground.scale", "less than or equal to 100"),
    ({"objects": {"trees": {"scale": 1e6}}}, "objects.trees.scale", "less than or equal to 20"),
    ({"roads": {"lane_width": 1e6}}, "roads.lane_width", "less than or equal to 100"),
    ({"roads": {"lane_width": -1}}, "roads.lane_width", "'from_network' or greater than 0"),
    ({"roads": {"per_edge": {"a": {"lane_width": 1e300}}}}, "roads.per_edge.a.lane_width", "100"),
    ({"roads": {"colour": "red"}}, "roads.colour", "a colour is written #rrggbb"),
    ({"vehicles": {"colours": ["redd"]}}, "vehicles.colours.0", "#rrggbb"),
    ({"vehicles": {"colours": "redd"}}, "vehicles.colours", "'european' or 'sumo' or a list"),
    ({"sky": {"file": "a.exr", "scale": 1e300}}, "sky.scale", "1000000"),
    ({"sky": {"rotation": 1e12}}, "sky.rotation", "3600"),
    ({"signals": {"yellow_time": 1e9}}, "signals.yellow_time", "600"),
    ({"seed": 1e300}, "seed", "valid integer"),
    ({"seed": True}, "seed", "a number, not true"),
    ({"output": {"size": [10**9, 10]}}, "output.size", "must lie in 1..16384"),
    ({"output": {"size": [True, 10]}}, "output.size.0", "a number, not true"),
    ({"output": {"exposure": 1e300}}, "output.exposure", "30"),
    ({"cameras": {"a": {**CAMERA, "position": [1e300, 0, 5]}}}, "cameras.a.position.0", "20000000"),
    ({"cameras": {"a": {**CAMERA, "position": [0, 0, 1e9]}}}, "cameras.a.position.2", "20000"),
    ({"cameras": {"a": {**CAMERA, "heading": 1e300}}}, "cameras.a.heading", "3600"),
    ({"cameras": {"a": {**CAMERA, "roll": float("inf")}}}, "cameras.a.roll", "finite number"),
    ({"cameras": {"a": {**RIDE, "vehicle": 12}}}, "cameras.a.vehicle", "put it in quotes"),
    ({"cameras": {"a": {**RIDE, "eye_height": 1e9}}}, "cameras.a.eye_height", "1000"),
    ({"cameras": {"a": {**RIDE, "vehicle": "x" * 5000}}}, "cameras.a.vehicle", "at most 1000"),
    ({"quality": None}, "quality", "should be text, not null"),
    ({"scenario": {"network": "a" * 300}}, "scenario.network", "at most 255 bytes"),
    ({"scenario": {"network": "a\0b"}}, "scenario.network", "no name of a file"),
    ({"scenario": {"trajectories": ["a"] * 20_000}}, "scenario.trajectories", "at most 10000"),
]

SUNS = [
    ({"place": [500, 500]}, "sky.sun.place.0", "less than or equal to 90"),
    ({"place": [50, 500]}, "sky.sun.place.1", "less than or equal to 180"),
    ({"date": "21.06.2026"}, "sky.sun.date", "a date is written like 2026-06-21, not '21.06.2026'"),
    ({"date": "2026-13-45"}, "sky.sun.date", "a date is written like 2026-06-21"),
    ({"date": "0001-01-01"}, "sky.sun.date", "the year must lie from 1900 to 2099"),
    ({"date": 5}, "sky.sun.date", "a date is written like 2026-06-21, not 5"),
    ({"time": "25:99"}, "sky.sun.time", "a time is written like \"17:30\", not '25:99'"),
    ({"time": 1730}, "sky.sun.time", 'a time is written like "17:30", not 1730'),
    ({"time": "half past"}, "sky.sun.time", 'a time is written like "17:30"'),
]


def complaint(settings):
    with pytest.raises(ConfigError) as caught:
        make_job({"scenario": {}, **settings})
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300
    return caught.value


@pytest.mark.parametrize(("settings", "key", "words"), WRONG)
def test_ranges(settings, key, words):
    error = complaint(settings)
    assert error.key == key and words in str(error)


@pytest.mark.parametrize(("sun", "key", "words"), SUNS)
def test_suns(sun, key, words):
    whole = {"date": "2026-06-21", "time": "17:30", **sun}
    error = complaint({"sky": {"sun": whole}})
    assert error.key == key and words in str(error)


def test_dates_and_times_as_people_write_them():
    sun = make_job({"scenario": {}, "sky": {"sun": {"date": "2026-06-21", "time": "7:05"}}}).sky.sun
    assert (sun.date.isoformat(), sun.time.isoformat()) == ("2026-06-21", "07:05:00")


def test_pydantic_says_nothing_itself():
    """Whatever any key is given, no word of the library's gets through."""
    raw = ("Input should", "Extra inputs", "Field required", "valid dictionary", "discriminator")
    odd = (None, 3, -1e300, "x", [], {}, [[]], {"a": 1}, True, "2026", [1, 2], float("nan"))
    for name in Job.model_fields:
        for value in odd:
            try:
                make_job({"scenario": {}, name: value})
            except ConfigError as error:
                assert not [word for word in raw if word in str(error)], error
                assert "instance" not in str(error) and "\n" not in str(error)


def test_a_film_has_an_end():
    with pytest.raises(ConfigError, match=f"at most {MOST_FRAMES:,}"):
        frame_times(0.0, 1e9, 25)
    assert len(frame_times(0.0, 2.0, 25)) == 50


@pytest.mark.parametrize("command", ["check", "render"])
@pytest.mark.parametrize("end", ["1e12", "1e8", ".inf"])
def test_shots_without_end(command, end, tmp_path, capsys):
    scene = write_scenario(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("from: 4, to: 5", f"from: 4, to: {end}")
    scene.write_text(text, encoding="utf-8")
    more = ["-o", str(tmp_path / "a.mp4")] if command == "render" else []
    assert main([command, str(scene), *more]) == 2
    said = complaints(capsys.readouterr().err)
    assert len(said) == 1 and (
        "1000000000" in said[0] or "frames" in said[0] or "finite" in said[0]
    )


def test_several_problems_are_told_at_once():
    error = complaint({"seed": "x", "output": {"fps": "y", "tone": 3}, "qualty": "draft"})
    assert "this key is unknown; did you mean 'quality'? (and 3 more)" in str(error)
