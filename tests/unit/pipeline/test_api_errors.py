"""The Python API raises our errors only, whatever it is given."""

import datetime as dt
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from builders import write_scenario
from needed import package

import sumo3dviz_pt as sv
from sumo3dviz_pt.pipeline.still import Still


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("api"))


@pytest.fixture(scope="module")
def scene(scene_file):
    return sv.load(scene_file)


class Odd:
    """Nothing that any setting can be."""

    def __repr__(self):
        return "<odd>"


STILLS = {
    "time": (None, "abc", "nan", float("nan"), float("inf"), 1e300, (), Odd(), True, 10**400),
    "camera": (3, ("post",), Odd(), "pots", "", b"post"),
    "quality": (3, "drat", Odd(), []),
    "size": ((0,), "big", 3, (0, 3), (1, 2, 3), (1e9, 1), (None, 1), (True, 2), "64x36", Odd()),
    "spp": ("x", 0, -1, 1.5, 10**9, float("nan"), True, [4]),
    "seed": ("x", -1, 2**31, 1.5, None.__class__),
    "variant": (None, 3, "lvm", Odd()),
}


@pytest.mark.parametrize(
    ("name", "value"), [(k, v) for k, values in STILLS.items() for v in values]
)
def test_stills(scene, name, value):
    with pytest.raises(sv.ConfigError) as caught:
        scene.still(**{"time": 4.5, name: value})
    assert name in (caught.value.key or "") and "\n" not in str(caught.value)


RENDERS = {
    "path": (None, 3, "", "a.jpg", "a\0.mp4", Odd(), Path(), "none/a.mp4"),
    "start": ("x", float("nan"), 1e300, Odd()),
    "end": ("x", 1.0, float("inf"), []),
    "fps": ("x", 0, -1, float("nan"), 1e300, [], Odd(), "1/0"),
    "frames": ((5, 2), "1:2", 3, (0,), (-1, 2), (0, 10**9), (0.5, 1)),
    "speed": ("x", 0, -1),
    "resume": ("maybe", 3, Odd()),
    "qualty": ("draft",),
    "colour": ("red",),
    "sice": ((64, 36),),
    "size": ((63, 36), "big"),
    "variant": ("lvm",),
    "camera": (3,),
}


@pytest.mark.parametrize(("name", "value"), [(k, v) for k, vs in RENDERS.items() for v in vs])
def test_films(scene, tmp_path, name, value):
    given = {"path": tmp_path / "a.mp4", "start": 4.0, "end": 4.2, "camera": "post", name: value}
    with pytest.raises(sv.ConfigError) as caught:
        scene.render(**given)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"qualty": "draft"}, "qualty: this choice is unknown; did you mean 'quality'"),
        ({"discard": True}, "discard: this choice is unknown"),
    ],
)
def test_misspelt_choices_are_guessed(scene, tmp_path, choices, words):
    with pytest.raises(sv.ConfigError, match=words):
        scene.render(tmp_path / "a.mp4", **choices)
    if "qualty" in choices:
        with pytest.raises(sv.ConfigError, match=words):
            scene.frames(**choices)


@pytest.mark.parametrize(
    "choices",
    [{"fps": "x"}, {"start": "x"}, {"size": 3}, {"camera": 3}, {"end": float("nan")}, {"spp": "x"}],
)
def test_frames(scene, choices):
    with pytest.raises(sv.ConfigError):
        next(scene.frames(**choices))


@pytest.mark.parametrize(
    "choices",
    [
        {"type": 3},
        {"at": "x"},
        {"at": float("nan")},
        {"near": 3},
        {"near": (1,)},
        {"near": ("a", "b")},
        {"near": (1, float("inf"))},
        {"near": "pots"},
        {"near": (0, 0), "radius": "x"},
        {"near": (0, 0), "radius": -1},
        {"sort": "colour"},
        {"sort": 3},
    ],
)
def test_vehicles(scene, choices):
    with pytest.raises(sv.ConfigError) as caught:
        scene.find_vehicles(**choices)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "choices",
    [
        {"size": "big"},
        {"size": (0, 3)},
        {"start": "x"},
        {"variant": 3},
        {"port": "x"},
        {"port": 70_000},
        {"height": -3},
        {"proxy": 3},
    ],
)
def test_viewers(scene, choices):
    package("aiohttp")
    with pytest.raises(sv.ConfigError):
        scene.view(**choices)


@pytest.mark.parametrize("path", [None, 3, "", b"a.yaml", ("a",), "a\0b", Odd(), "x" * 300, Path()])
def test_scene_files(path):
    with pytest.raises(sv.ConfigError):
        sv.load(path)


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"scenario": 3},
        {"scenario": 3, "network": "a"},
        {"network": 3, "trajectories": "b"},
        {"network": "a", "trajectories": Odd()},
        {"network": "a", "trajectories": "b", "cameras": 3},
        {"network": "a", "trajectories": "b", "cameras": {"a": None}},
        {"network": "a", "trajectories": "b", "cameras": {None: {}}},
        {"network": "a", "trajectories": "b", "template": 3},
        {"network": "a", "trajectories": "b", "template": None},
        {"network": "a", "trajectories": "b", "seed": 10**400},
        {"network": "a", "trajectories": "b", "sky": {"sun": {"date": 5, "time": 1730}}},
        {"network": "a\0", "trajectories": "b"},
        {"network": "a", "trajectories": "b", "qualty": "draft"},
    ],
)
def test_settings(settings):
    with pytest.raises(sv.ConfigError) as caught:
        sv.Scene(**settings)
    assert "\n" not in str(caught.value)


def test_settings_that_hold_themselves():
    cameras = {}
    cameras["a"] = cameras
    with pytest.raises(sv.ConfigError, match="holds too much, or itself"):
        sv.Scene(network="a", trajectories="b", cameras=cameras)


def test_a_still_cannot_be_saved_nowhere(tmp_path):
    still = Still(
        np.zeros((2, 2, 3), np.float32),
        0.0,
        "neutral",
        0.0,
        False,
        {"camera": "a", "time": 0},
        None,
    )
    for path in (None, 3, "", "a\0.png", tmp_path / "a.jpg", tmp_path):
        with pytest.raises(sv.ConfigError):
            still.save(path)


# Overrides ---------------------------------------------------------------------------------


def test_overrides_may_be_anything_that_a_scene_file_may_hold(scene_file):
    job = sv.load(
        scene_file,
        {
            "output.size": (320, 180),
            "output": {"fps": np.float64(30.0), "exposure": np.float32(0.5)},
            "seed": np.int64(9),
            "sky": {
                "sun": {"date": dt.date(2026, 6, 21), "time": dt.time(17, 30), "place": (41, 2)}
            },
            "cameras.post.position": np.array([1.0, 2.0, 3.0]),
            "cameras.post.lens.fov": Decimal("40.5"),
            "cameras.driver.vehicle": '"12"',
            "vehicles.user_models": {"own*": Path("car.glb")},
            "roads.per_edge": {-12: {"lane_width": 3}},
            "objects.trees": None,
            "quality": "preview",
            "shots": [{"camera": "post", "from": 1, "to": Fraction(5, 2)}],
        },
    ).job
    assert job.output.size == (320, 180) and job.output.fps == 30
    assert job.output.exposure == 0.5 and job.output.codec == "auto"
    assert job.seed == 9 and job.quality == "preview"
    assert job.sky.sun.date == dt.date(2026, 6, 21) and job.sky.sun.time == dt.time(17, 30)
    assert job.cameras["post"].position == (1, 2, 3) and job.cameras["post"].lens.fov == 40.5
    assert job.cameras["driver"].vehicle == "12"
    assert job.vehicles.user_models["own*"] == scene_file.parent / "car.glb"
    assert job.roads.per_edge["-12"].lane_width == 3
    assert job.objects.trees is None
    assert job.shots[0].end == 2.5


def test_a_mapping_changes_what_it_holds_and_replaces_skies_and_cameras(scene_file):
    given = {
        "output": {"fps": 30},
        "sky": {"preset": "sky_blue"},
        "cameras.driver": {"mode": "eulerian", "position": [0, 0, 9], "heading": 90},
    }
    job = sv.load(scene_file, given).job
    assert job.output.size == (64, 36) and job.output.fps == 30
    assert job.sky.preset == "sky_blue" and job.sky.sun is None
    assert job.cameras["driver"].mode == "eulerian"


@pytest.mark.parametrize(
    "overrides",
    [
        3,
        "quality=draft",
        [("quality", "draft")],
        {3: "draft"},
        {"quality": Odd()},
        {"quality": b"draft"},
        {"quality": {"draft", "preview"}},
        {"output.size": "big"},
        {"": 1},
        {".": 1},
        {"a..b": 1},
        {"output.fps.x": 1},
        {"shots.²": 1},
        {"shots." + "9" * 5000: 1},
        {"seed": "[1"},
        {"quality": "\ud800"},
    ],
)
def test_wrong_overrides(scene_file, overrides):
    with pytest.raises(sv.ConfigError) as caught:
        sv.load(scene_file, overrides)
    assert "\n" not in str(caught.value)
