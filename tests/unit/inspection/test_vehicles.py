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


# v0 drives at 10 m/s, 18 m behind v2, which is 4.6 m long.


def test_whom_somebody_follows(scene, capsys):
    assert (
        main(["vehicles", str(scene), "--follow", "v0", "--json", "--from", "3", "--to", "9"]) == 0
    )
    rows = json.loads(capsys.readouterr().out)
    assert [row["time"] for row in rows] == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
    for row in rows:
        assert row["leader"] == "vehicle:v2" and row["time_to_collision"] is None
        assert row["gap"] == pytest.approx(13.4, abs=0.01)
        assert row["time_gap"] == pytest.approx(1.34, abs=0.01)
        assert row["speed"] == pytest.approx(10.0, abs=0.01) and row["logged_speed"] == 10.0


def test_who_follows_nobody_has_empty_cells(scene, tmp_path, capsys):
    out = tmp_path / "follow.csv"
    assert main(["vehicles", str(scene), "--follow", "v2", "-o", str(out)]) == 0
    head, first, *_ = out.read_text("utf-8").splitlines()
    assert head.startswith("time,speed,logged_speed,leader,gap,time_gap,headway,time_to_collision")
    assert first == "0.0,10.0,10.0,,,,,,,"
    assert main(["vehicles", str(scene), "--follow", "v2", "-o", str(out)]) == 2
    assert "exists" in capsys.readouterr().err


def test_ids_with_colons_are_whole(tmp_path, capsys):
    path = write_scenario(tmp_path, vehicles=4)
    log = tmp_path / "fcd.xml"
    log.write_text(log.read_text("utf-8").replace('"v2"', '"car@1:2.3"'), "utf-8")
    assert main(["vehicles", str(path), "--follow", "v0"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:2] == ["time", "[s]"] and "car@1:2.3" in lines[1].split()
    edit = "{v0: {behind: 'car@1:2.3', gap: 1.0 s, at: 5}}"
    asked = ["vehicles", str(path), "--follow", "v0", "--set", f"traffic.rides={edit}"]
    assert main([*asked, "--from", "5", "--to", "5"]) == 0
    said = capsys.readouterr()
    assert "car@1:2.3 rides 0.34 s later, so that v0 keeps its drive" in said.err
    assert "1.00 s behind car@1:2.3 at 5 s" in said.err and " 1.00 " in said.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--from", "3"), "--from: goes with --follow"),
        (("--follow", "v0", "--near", "1,2"), "--near: goes with a list"),
        (("--follow", "vo"), "is called 'vo'; for example 'v0'"),
        (("--follow", "v0", "--from", "99"), "the log goes from 0 s to 12 s"),
        (("--follow", "v0", "-o", "a.txt"), "must end in .csv"),
    ],
)
def test_what_cannot_be_followed(scene, capsys, options, said):
    assert main(["vehicles", str(scene), *options]) == 2
    assert said in capsys.readouterr().err
