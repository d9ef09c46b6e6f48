"""A scene that leaves is the scene that is rendered."""

import json

import numpy as np
import pytest
from builders import write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.exports.gltf import gltf
from sumo3dviz_pt.exports.scene import exported
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("town"), vehicles=3, signals=True, trees=True)


@pytest.fixture(scope="module")
def scene(town):
    return exported(load_job(town), np.array([4.0, 4.5, 5.0]))


def test_road_users_are_where_the_film_has_them(town, scene):
    job = load_job(town)
    made = prepare(job, Request(), scene.times)
    for index, time in enumerate(scene.times.tolist()):
        film = {
            mover.id: mover.world_from_body.matrix[:3, 3]
            for mover in made.shot.frame_at(time).everyone
            if not mover.part
        }
        ours = {
            thing.owner: thing.track.matrices[min(index, len(thing.track.matrices) - 1), :3, 3]
            + scene.origin
            for thing in scene.things
            if thing.owner.startswith("vehicle") and thing.name == thing.owner
        }
        assert film and set(film) <= set(ours)
        for key, place in film.items():
            assert np.abs(ours[key] - place).max() < 1e-9


def test_numbers_are_sound_and_everything_asked_for_is_there(scene):
    families = {thing.family for thing in scene.things}
    assert {"roads", "ground", "trees", "signals", "vehicle"} <= families
    for thing in scene.things:
        for piece in thing.pieces:
            shape, look = piece.geometry, thing.look(piece)
            assert np.isfinite(shape.points).all() and shape.faces.max() < len(shape.points)
            assert all(0.0 <= channel <= 1.0 for channel in look.colour)
    assert {camera.name for camera in scene.cameras} == {"post", "driver"}
    assert next(camera.rides for camera in scene.cameras if camera.name == "driver")


def test_things_are_found_by_their_names(scene):
    data = gltf(scene)
    said = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    names = {each["name"] for each in said["materials"]}
    assert {"asphalt", "lens", "paint"} <= names and all(names)
    assert {"roads", "vehicle"} <= {each["name"] for each in said["meshes"]}


@pytest.mark.parametrize("who", ["late", "nobody"])
def test_a_camera_whose_vehicle_is_not_there_is_left_out_alone(town, who):
    ride = {"mode": "lagrangian", "vehicle": who, "view": "driver"}
    job = load_job(town, {"cameras.seat": ride})
    made = exported(job, np.array([4.0]))
    assert {camera.name for camera in made.cameras} == {"post", "driver"}
    assert f"left out camera seat: {who} is not on the road all the time" in made.notes


def test_the_same_scene_gives_the_same_file(town, scene):
    again = exported(load_job(town), scene.times)
    assert gltf(again) == gltf(scene)


def test_python_and_the_command_write_it(town, tmp_path, capsys):
    from sumo3dviz_pt.cli import main

    scene = sv.load(town)
    assert scene.export(tmp_path / "a.glb", time=4.0, progress=False).stat().st_size > 10_000
    assert main(["export", str(town), "--time", "4", "-o", str(tmp_path / "b.glb")]) == 0
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    assert "triangles" in capsys.readouterr().out
    assert main(["export", str(town), "-o", str(tmp_path / "c.glb")]) == 2
    wide = "cameras.post.lens={projection: fisheye, fov: 180}"
    again = ["export", str(town), "--time", "4", "-o", str(tmp_path / "d.glb"), "--set", wide]
    assert main([*again, "--set", "weather.preset=rain"]) == 0
    said = capsys.readouterr().out
    assert "left out camera post" in said and "left out the weather" in said
    assert main(["view", str(town), "--static", str(tmp_path / "page"), "--to", "5"]) == 0
    text = (tmp_path / "page" / "scene.js").read_text(encoding="utf-8")
    said = json.loads(text.removeprefix("window.SCENE = ").rstrip().rstrip(";"))
    assert (said["start"], said["end"]) == (4.0, 5.0) and said["cameras"] == ["post", "driver"]
