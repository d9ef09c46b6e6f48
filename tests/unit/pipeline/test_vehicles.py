"""`vehicles`, `scene.vehicles` and `scene.cameras`."""

import json

import pytest
from builders import write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.production import example


@pytest.fixture
def scene(tmp_path):
    return write_scenario(tmp_path, vehicles=4, persons=2)


def listed(scene, capsys, *more):
    assert main(["vehicles", str(scene), "--json", *more]) == 0
    return json.loads(capsys.readouterr().out)


def test_everyone_with_drive_and_lanes(scene, capsys):
    found = listed(scene, capsys)
    assert [each["id"] for each in found] == ["v0", "v1", "v2", "v3", "p0", "p1"]
    assert found[0] == {
        "id": "v0",
        "kind": "vehicle",
        "type_id": "car",
        "vclass": "passenger",
        "begin": 0.0,
        "end": 12.0,
        "length": 120.0,
        "mean_speed": 10.0,
        "max_speed": 10.0,
        "lanes": 1,
        "edges": ["w"],
    }


def test_as_a_table(scene, capsys):
    assert main(["vehicles", str(scene), "--near", "post,25"]) == 0
    head, *rows, count = capsys.readouterr().out.splitlines()
    assert head.split()[:3] == ["id", "type", "class"] and "near [s]" in head
    assert count == f"{len(rows)} road users" and rows[0].split()[1:3] == ["car", "passenger"]


def test_chosen_and_sorted(scene, capsys):
    assert [u["id"] for u in listed(scene, capsys, "--type", "ped*")] == ["p0", "p1"]
    assert [u["id"] for u in listed(scene, capsys, "--type", "person")] == ["p0", "p1"]
    assert listed(scene, capsys, "--sort", "length")[-1]["kind"] == "person"
    assert listed(scene, capsys, "--at", "99") == []
    there = listed(scene, capsys, "--at", "4.5", "--near", "5,-4.8,3")
    assert [u["id"] for u in there] == ["v0"]
    assert there[0]["place"] == {"x": 5.0, "y": -4.8, "lane": "w_0"}
    nearest = listed(scene, capsys, "--near", "60,0,40")
    distances = [u["passage"]["distance"] for u in nearest]
    assert len(distances) > 1 and distances == sorted(distances)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--sort", "lenght"), "did you mean 'length'?"),
        (("--sort", "distance"), "give a place"),
        (("--near", "psot"), "did you mean 'post'?"),
        (("--near", "driver"), "no standing camera"),
        (("--near", "1,2,3,4"), "write X,Y or X,Y,R"),
        (("--near", "1,two"), "write X,Y or X,Y,R"),
        (("--near", "1,2,-3"), "above 0 m"),
    ],
)
def test_what_cannot_be_asked(scene, capsys, options, said):
    assert main(["vehicles", str(scene), *options]) == 2
    assert said in capsys.readouterr().err


def test_the_same_from_python(scene):
    found = sv.load(scene)
    assert len(found.vehicles) == 6 and found.vehicles[0].id == "v0"
    assert repr(found.vehicles[:2]).endswith("2 road users")
    (near,) = found.find_vehicles(near=(5, -4.8), radius=3, at=4.5)
    assert near.id == "v0" and near.passage.distance == pytest.approx(0.0)
    by_camera = found.find_vehicles(near="post", sort="id")
    assert [user.id for user in by_camera] == sorted(user.id for user in by_camera)
    with pytest.raises(sv.ConfigError, match="no camera is called"):
        found.find_vehicles(near="nowhere")


def test_cameras_say_what_they_are(scene):
    cameras = sv.load(scene).cameras
    assert list(cameras) == ["post", "driver"] and cameras["driver"].vehicle == "v0"
    assert repr(cameras).splitlines() == [
        "post    stands at (30, -22, 6), looking at (5, -3, 0), 60° wide",
        "driver  rides with v0, view driver",
    ]


def test_flights_and_headings_in_words():
    shown = repr(sv.load(example("ronda")).cameras).splitlines()
    assert shown[2].startswith("flight    flies from (462.5, 710.1, 9) to (717.6, 696.3, 16), 438")
    post = {"mode": "eulerian", "position": [1, 2, 3], "heading": 90}
    scene = sv.Scene(network="a", trajectories="b", cameras={"a": post})
    assert repr(scene.cameras) == "a  stands at (1, 2, 3), heading 90°, 50° wide"
    assert repr(sv.Scene(network="a", trajectories="b").cameras) == "no cameras"
