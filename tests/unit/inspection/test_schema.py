"""The scene file as JSON schema, for editors."""

import json
from pathlib import Path

import jsonschema
import pytest
from builders import write_scenario

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.inspection.schema import scene_schema
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.pipeline.scene_file import FILE, LINE, names_for


@pytest.fixture(scope="module")
def complaints():
    """What an editor says of a scene file's text."""
    schema = scene_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(
        schema, format_checker=jsonschema.Draft202012Validator.FORMAT_CHECKER
    )

    def found(text):
        content = json.loads(json.dumps(parse_yaml(text)[0], default=str))
        return [error.message for error in validator.iter_errors(content)]

    return found


@pytest.mark.parametrize("name", ["ronda", "crossing"])
def test_editors_accept_the_examples(name, complaints):
    assert complaints(example(name).read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("name", catalog.template_names("scene"))
def test_editors_accept_the_templates(name, complaints):
    path = catalog.data_root("scene_templates") / "scene" / f"{name}.yaml"
    assert complaints(path.read_text(encoding="utf-8") + "\nscenario: {folder: .}\n") == []


@pytest.mark.parametrize(
    "text",
    [
        "scenario: {network: a.xml, trajectories: b.xml, signals: [c, d], additional: e}",
        "output: {fps: 30000/1001, codec: vp9, size: [640, 360]}",
        "output: {fps: 29.97}",
        "objects: {trees: {model: maple}, hedges: null}",
        'sky: {sun: {date: 2026-06-21, time: "17:30", zone: Europe/Berlin}}',
        "ground: {texture: my_own.png}",
        'vehicles: {by_id: {"bus*": {model: city_bus, colour: "#aa2211"}}, passenger: [sedan]}',
        "cameras: {a: {mode: eulerian, position: [0, 1, 2], heading: 3}}",
        "shots: [{camera: a, from: 1, to: 2, speed: 1/4}]",
        "roads: {lane_width: 3.2}",
    ],
)
def test_editors_accept_what_we_read(text, complaints):
    scenario = "" if text.startswith("scenario") else "\nscenario: {folder: .}"
    assert complaints(text + scenario) == []


@pytest.mark.parametrize(
    "text",
    [
        "template: highway_dya",
        "quality: best",
        "sky: {preset: sky_green}",
        "output: {codec: h266}",
        "output: {tone: acid}",
        "cameras: {a: {mode: lagrangian, vehicle: v, view: roof}}",
        "vehicles: {passenger: [city_bus]}",
        "vehicles: {by_id: {v: {model: bus_front}}}",
        "motion: {smoother: cubic}",
        "colour: red",
        "shots: [{camera: a, from: 1, to: 2, speed: 500}]",
    ],
)
def test_editors_see_what_is_wrong(text, complaints):
    assert complaints(text + "\nscenario: {folder: .}")


def test_names_of_unknown_keys_are_none():
    assert names_for("nothing") == () and "agx" in names_for("output.tone")


def test_init_writes_the_schema_and_the_line_that_names_it(tmp_path, capsys):
    write_scenario(tmp_path, vehicles=4, end=20.0)
    target = tmp_path / "out" / "city.yaml"
    target.parent.mkdir()
    assert main(["init", str(tmp_path), "-o", str(target)]) == 0
    assert target.read_text(encoding="utf-8").startswith(LINE + "\n")
    beside = target.parent / FILE
    assert LINE.endswith(FILE) and json.loads(beside.read_text("utf-8"))["$schema"]
    assert sorted(path.name for path in target.parent.iterdir()) == ["city.yaml", FILE]


def test_the_schema_is_printed_and_written(tmp_path, capsys):
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(scene_schema()))
    target = tmp_path / "keys.json"
    for _ in range(2):
        assert main(["schema", "-o", str(target)]) == 0
        assert "$schema=keys.json" in capsys.readouterr().out
    target.write_text("{}", encoding="utf-8")
    assert main(["schema", "-o", str(target)]) == 2
    assert "something else" in capsys.readouterr().err and target.read_text("utf-8") == "{}"
    assert main(["schema", "-o", str(tmp_path / "none" / "a.json")]) == 2
    assert [path.name for path in Path(tmp_path).iterdir()] == ["keys.json"]
