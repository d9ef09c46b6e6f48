"""Names that films cannot bear, and hints to what was meant."""

import os

import pytest

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.pipeline.scene_file import load_job, make_job
from sumo3dviz_pt.studies.file import load_study

POST = {"mode": "eulerian", "position": [0, 0, 5], "heading": 90}
SCENARIO = {"network": "a.net.xml", "trajectories": "fcd.xml"}


def scene(**more):
    return make_job({"scenario": SCENARIO, **more})


@pytest.mark.parametrize(
    "name",
    [
        "x" * 300,
        "a/b",
        "a\\b",
        "..\\x",
        "a:b",
        "a\nb",
        "a\x1bb",
        "a\u2028b",
        "CON",
        "nul.x",
        "",
        " a",
    ],
)
def test_a_camera_is_called_as_a_film_can_be(name):
    with pytest.raises(ConfigError, match=r"^cameras"):
        scene(cameras={name: POST})


@pytest.mark.parametrize("name", ["post", "Ampel 3 (Nord)", "Café", "driver.0", "conny", "x" * 60])
def test_usual_names_of_cameras_stay(name):
    assert list(scene(cameras={name: POST}).cameras) == [name]


@pytest.mark.parametrize(("key", "word"), [("weather", "rain"), ("sky", "sky_blue")])
def test_a_preset_by_itself_names_its_key(key, word):
    with pytest.raises(ConfigError, match=rf"{key}\.preset={word}"):
        scene(**{key: word})


def test_a_file_beside_a_missing_one_is_suggested(tmp_path):
    (tmp_path / "ingo.yaml").write_text("a: 1", encoding="utf-8")
    for load in (load_job, load_study):
        with pytest.raises(ConfigError, match=r"did you mean 'ingo\.yaml'"):
            load(tmp_path / "ingo.yml")


def test_a_study_is_no_scene_and_says_what_renders_it(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text("scene: a.yaml\nfactors: {}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="sumo3dviz-pt study"):
        load_job(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="only POSIX systems have pipes")
@pytest.mark.parametrize("load", [load_job, load_study])
def test_a_pipe_is_no_file(tmp_path, load):
    path = tmp_path / "a.yaml"
    os.mkfifo(path)
    with pytest.raises(InputError, match="a pipe"):
        load(path)
