"""Scene files: templates, overrides, and every kind of wrong setting."""

from pathlib import Path

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CinematicCamera, EulerianCamera, LagrangianCamera
from sumo3dviz_pt.pipeline.scene_file import camera_settings, load_job, make_job, quality_preset

BASE = """scenario: {network: a.net.xml, trajectories: fcd.xml}
cameras:
  post: {mode: eulerian, position: [0, 0, 5], heading: 90}
  ride: {mode: lagrangian, vehicle: v0}
  flight:
    mode: cinematic
    keyframes:
      - {time: 0, position: [0, 0, 5], heading: 0}
      - {time: 4, position: [0, 9, 5], look_at: [0, 0, 0]}
shots:
  - {camera: post, from: 0, to: 4}
"""


def load(tmp_path, text=BASE, **overrides):
    path = tmp_path / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    return load_job(path, overrides.get("overrides"))


def complaint(tmp_path, text, overrides=None):
    with pytest.raises(ConfigError) as caught:
        load(tmp_path, text, overrides=overrides)
    assert "\n" not in str(caught.value)
    return caught.value


def test_a_key_that_breaks_lines_is_shown_in_one(tmp_path):
    assert r"vehicles.models.a\nb: this should be" in str(
        complaint(tmp_path, f'{BASE}vehicles: {{models: {{"a\\nb": 3}}}}\n')
    )


def test_paths_are_relative_to_the_scene_file(tmp_path):
    job = load(tmp_path)
    assert job.scenario.network == tmp_path / "a.net.xml"
    assert job.scenario.trajectories == (tmp_path / "fcd.xml",)


def test_absolute_paths_stay(tmp_path):
    job = make_job({"scenario": {"network": str(tmp_path / "b.net.xml")}}, folder=Path("else"))
    assert job.scenario.network == tmp_path / "b.net.xml"


def test_cameras_are_told_apart_by_mode(tmp_path):
    kinds = {name: type(camera) for name, camera in load(tmp_path).cameras.items()}
    assert kinds == {"post": EulerianCamera, "ride": LagrangianCamera, "flight": CinematicCamera}


@pytest.mark.parametrize("name", catalog.template_names("scene"))
def test_every_template_makes_a_job(name):
    template = catalog.template("scene", name)
    job = make_job({"scenario": {}, "template": name})
    for key, value in template.items():
        assert getattr(job, key) == value or key in job.model_fields_set


def test_own_keys_win_over_the_template():
    own = {"scenario": {}, "template": "abstract", "roads": {"line_width": 0.2}}
    job = make_job(own)
    assert job.roads.line_width == 0.2
    assert job.roads.surface == catalog.template("scene", "abstract")["roads"]["surface"]
    assert job.textured is False


def test_an_own_sky_replaces_the_templates():
    sun = {"azimuth": 90, "elevation": 30}
    job = make_job({"scenario": {}, "sky": {"sun": sun}})
    assert job.sky.preset is None and job.sky.sun.elevation == 30


def test_loading_twice_does_not_change_the_template():
    before = dict(catalog.template("scene", "highway_day"))
    make_job({"scenario": {}, "roads": {"surface": "concrete"}, "ground": {"scale": 2}})
    assert catalog.template("scene", "highway_day") == before


# --set -------------------------------------------------------------------------------------


def test_overrides_win_and_are_yaml(tmp_path):
    job = load(
        tmp_path,
        overrides={
            "output.size": "[320, 180]",
            "quality": "draft",
            "cameras.post.lens.fov": "70",
            "shots.0.to": "2.5",
            "cameras.flight.keyframes.1.time": "5",
            "roads.markings": "false",
        },
    )
    assert job.output.size == (320, 180)
    assert job.cameras["post"].lens.fov == 70
    assert job.shots[0].end == 2.5
    assert job.cameras["flight"].keyframes[1].time == 5
    assert job.roads.markings is False


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("shots.3.to", "'3' is no place in a list of 1"),
        ("shots.x.to", "'x' is no place in a list of 1"),
        ("shots.2", "'2' is no place"),
        ("quality.spp.x", "holds a value, not further keys"),
    ],
)
def test_overrides_need_a_place(tmp_path, key, words):
    error = complaint(tmp_path, BASE + "quality: draft\n", {key: "1"})
    assert words in str(error) and error.key == key


# What can be wrong -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "key", "words"),
    [
        ("colour: red\n", "colour", "unknown"),
        ("qualty: draft\n", "qualty", "did you mean 'quality'"),
        ("output: {sizes: [1, 2]}\n", "output.sizes", "did you mean 'size'"),
        ("sky: {sun: {elevaton: 3}}\n", "sky.sun.elevaton", "did you mean 'elevation'"),
        ("roads: {per_edge: {a: {surfce: b}}}\n", "roads.per_edge.a.surfce", "mean 'surface'"),
        ("objects: {trees: {scal: 2}}\n", "objects.trees.scal", "did you mean 'scale'"),
        ("output: {fps: fast}\n", "output.fps", "positive number or a ratio"),
        ("output: {fps: 0}\n", "output.fps", "positive number or a ratio"),
        ("output: {fps: .nan}\n", "output.fps", "positive number or a ratio"),
        ("output: {fps: 241}\n", "output.fps", "0.01 to 240"),
        ("output: {size: [0, 10]}\n", "output.size", "must lie in 1..16384"),
        ("output: {size: [5]}\n", "output.size.1", "missing"),
        ("output: {half: maybe}\n", "output.half", "boolean"),
        ("seed: -1\n", "seed", "greater than or equal to 0"),
        ("seed: 1.5\n", "seed", "integer"),
        ("quality: standrd\n", "quality", "did you mean 'standard'"),
        ("template: highway_nite\n", "template", "did you mean 'highway_day'"),
        ("signals: {design: 4}\n", "signals.design", "two_heads"),
        ("ground: {scale: -1}\n", "ground.scale", "greater than or equal to 0.01"),
        ("sky: {sun: {azimuth: 3}}\n", "sky.sun", "give either date and time"),
        ("vehicles: [a]\n", "vehicles", "keys with values"),
    ],
)
def test_wrong_settings_name_key_and_place(tmp_path, more, key, words):
    error = complaint(tmp_path, BASE + more)
    assert error.key == key and words in str(error)
    assert error.file == tmp_path / "scene.yaml"
    assert error.line == BASE.count("\n") + 1
    assert error.column == 1 + more.find(key.split(".")[-1]) or key == "output.size.1"


@pytest.mark.parametrize(
    ("camera", "key", "words"),
    [
        ("{mode: eulerian, position: [0, 0], heading: 1}", "position.2", "missing"),
        ("{mode: eulerian, position: [0, 0, x], heading: 1}", "position.2", "valid number"),
        ("{mode: eulerian, position: [0, 0, 1]}", "", "either heading (with pitch) or look_at"),
        ("{mode: eulerian, positon: [0, 0, 1], heading: 1}", "positon", "mean 'position'"),
        ("{mode: lagrangian, view: driver}", "vehicle", "missing"),
        ("{mode: lagrangian, vehicl: a}", "vehicl", "did you mean 'vehicle'"),
        ("{mode: lagrangian, vehicle: a, lens: {fv: 2}}", "lens.fv", "did you mean 'fov'"),
        ("{mode: lagrangian, vehicle: a, lens: {fov: 1}}", "lens.fov", "greater than or equal"),
        ("{mode: flying}", "", "'eulerian', 'lagrangian', 'cinematic'"),
        ("{position: [0, 0, 1]}", "", "the key 'mode' is missing"),
        ("{mode: cinematic, keyframes: []}", "keyframes", "at least 1 item"),
        (
            "{mode: cinematic, keyframes: [{time: 2, position: [0,0,1], heading: 0},"
            " {time: 1, position: [0,0,1], heading: 0}]}",
            "",
            "must increase",
        ),
        (
            "{mode: cinematic, keyframes: [{tim: 2, position: [0,0,1], heading: 0}]}",
            "keyframes.0.tim",
            "did you mean 'time'",
        ),
    ],
)
def test_wrong_cameras(tmp_path, camera, key, words):
    error = complaint(tmp_path, BASE.replace("cameras:\n", f"cameras:\n  bad: {camera}\n"))
    assert words in str(error)
    assert error.key == ".".join(filter(None, ("cameras", "bad", key)))
    assert error.line == 3 and error.column >= 3


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("camera: post,", "camera: psot,", "did you mean 'post'"),
        ("from: 0, to: 4", "from: 4, to: 0", "must be later than"),
        ("from: 0, to: 4", "from: 0, to: .inf", "finite"),
        ("from: 0, to: 4", "from: 0", "missing"),
        ("from: 0, to: 4", "from: 0, until: 4", "(and 1 more)"),
    ],
)
def test_wrong_shots(tmp_path, old, new, words):
    error = complaint(tmp_path, BASE.replace(old, new))
    assert words in str(error)
    assert error.key.startswith("shots.0") and error.line == 11


def test_unknown_key_of_a_shot_is_explained(tmp_path):
    text = BASE.replace("to: 4", "to: 4, till: 5")
    assert "did you mean 'to'" in str(complaint(tmp_path, text)) or "known: " in str(
        complaint(tmp_path, text)
    )


def test_files_that_are_no_scene(tmp_path):
    with pytest.raises(ConfigError, match="no such scene file"):
        load_job(tmp_path / "none.yaml")
    (tmp_path / "latin.yaml").write_bytes(b"a: \xff\xfe\xe4")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_job(tmp_path / "latin.yaml")
    with pytest.raises(ConfigError, match="is a folder, not a scene file; write one"):
        load_job(tmp_path)
    (tmp_path / "scene.yaml").write_text("seed: 1\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"is a folder; its scene file is .*scene\.yaml"):
        load_job(tmp_path)
    assert "is a mapping" in str(complaint(tmp_path, "- a\n"))
    assert "is a mapping" in str(complaint(tmp_path, ""))
    assert "scenario" in str(complaint(tmp_path, "seed: 1\n"))


# Choices -----------------------------------------------------------------------------------


def test_first_camera_is_the_first_shots(tmp_path):
    job = load(tmp_path)
    assert camera_settings(job, None)[0] == "post"
    assert camera_settings(job, "ride")[1].vehicle == "v0"
    with pytest.raises(ConfigError, match="did you mean 'flight'"):
        camera_settings(job, "fligth")
    assert camera_settings(job.model_copy(update={"shots": ()}), None)[0] == "post"
    with pytest.raises(ConfigError, match="no cameras"):
        camera_settings(make_job({"scenario": {}}), None)


@pytest.mark.parametrize("name", catalog.template_names("quality"))
def test_quality_presets(name):
    assert quality_preset(name).accumulate == 0
    assert quality_preset(name).spp >= quality_preset(name, together=True).spp
    for together in (False, True):
        assert quality_preset(name, spp=3, together=together).spp == 3


def test_a_picture_that_no_others_help_has_samples_of_its_own():
    film, still = quality_preset("preview", together=True), quality_preset("preview")
    assert film.accumulate and not still.accumulate
    assert film.alone == still.spp > film.spp
    assert film.by_itself == still
    # Samples that somebody asks for hold for both.
    assert quality_preset("preview", spp=3, together=True).by_itself.spp == 3
    # Only our own kernel knows which road user a pixel shows.
    assert quality_preset("reference_path", together=True).accumulate == 0


def test_quality_out_of_range():
    with pytest.raises(ConfigError, match=r"spp: .*greater than or equal to 1"):
        quality_preset("draft", spp=0)
    with pytest.raises(ConfigError, match="did you mean 'draft'"):
        quality_preset("draf")


def test_image_surfaces_lie_beside_the_scene_file(tmp_path):
    settings = {
        "scenario": {"network": "a.net.xml"},
        "ground": {"texture": "grass.png"},
        "roads": {"surface": "asphalt", "per_edge": {"a*": {"surface": "maps/own.jpg"}}},
    }
    job = make_job(settings, folder=tmp_path)
    assert job.ground.texture == str(tmp_path / "grass.png")
    assert job.roads.surface == "asphalt"
    assert job.roads.per_edge["a*"].surface == str(tmp_path / "maps" / "own.jpg")
