"""Configurations of sumo3Dviz become scene files."""

import numpy as np
import pytest
import yaml
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.import_sumo3dviz import FOV, translate
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.cameras.standing import standing_view

PLACE = {"pos_x": 10.0, "pos_y": 20.0, "pos_z": 5.0}


def configuration(**changes):
    """A complete one; changes by section."""
    content = {
        "rendering": {
            "record_video": True,
            "headless": False,
            "video_width_px": 1141,
            "video_height_px": 900,
            "video_fps": 20.0,
        },
        "visualization": {
            "show_other_vehicles": True,
            "show_signals": True,
            "lane_width": 3.2,
            "sep_line_width": 0.2,
            "sky_texture": "sky_dawn",
            "ground_texture": "ground_sand",
        },
        "paths": {
            "trajectory_file": "logs/fcd.xml",
            "sumo_network_file": "logs/net.net.xml",
            "traffic_signal_states_file": "logs/tls.xml",
            "tree_positions_file": "logs/trees.add.xml",
            "shops_positions_file": "logs/none.add.xml",
        },
        "signals": {"num_heads": 3, "countdown_timer": False},
        "modes": {
            "eulerian": {
                "simtime_start": 2,
                "simtime_end": 5,
                "ego_identifier": "v0",
                "camera_position": {**PLACE, "ori_h": 90.0, "ori_p": -10.0, "ori_r": 3.0},
            },
            "lagrangian": {"simtime_start": 1.0, "simtime_end": 4.0, "ego_identifier": "v0"},
            "cinematic": {
                "simtime_start": 2.0,
                "simtime_end": 11.0,
                "camera_position_trajectory": {
                    "10.5": {**PLACE, "ori_h": 10.0},
                    "2.0": {**PLACE, "ori_h": -10.0},
                },
            },
            "interactive": {
                "initial_camera_position": {
                    "position": [1.0, 2.0, 3.0],
                    "orientation": [180.0, -20.0, 0.0],
                }
            },
        },
    }
    for section, values in changes.items():
        content[section] = {**content[section], **values}
    return content


@pytest.fixture
def place(tmp_path):
    """A folder as the peer has it: paths refer to where the program is started."""
    (tmp_path / "logs").mkdir()
    (tmp_path / "configs").mkdir()
    write_scenario(tmp_path / "logs", signals=True, trees=True)
    return tmp_path


def written(place, **changes):
    file = place / "configs" / "peer.yaml"
    file.write_text(yaml.safe_dump(configuration(**changes)), encoding="utf-8")
    return file


def job_of(place, **changes):
    text, notes = translate(written(place, **changes), output=place / "scene.yaml")
    (place / "scene.yaml").write_text(text, encoding="utf-8")
    return load_job(place / "scene.yaml"), notes


def test_files_looks_and_film(place):
    job, _ = job_of(place)
    assert job.scenario.network == place / "logs" / "net.net.xml"
    assert job.scenario.trajectories == (place / "logs" / "fcd.xml",)
    assert job.scenario.signals == (place / "logs" / "tls.xml",)
    assert job.objects.trees.file == place / "logs" / "trees.add.xml"
    assert (job.sky.preset, job.ground.texture) == ("sky_dawn", "ground_sand")
    assert job.signals.design == "three_heads" and job.roads.line_width == 0.2
    assert job.output.size == (1140, 900) and job.output.fps == 20


def test_cameras_look_where_theirs_looked(place):
    """Their angle goes counter-clockwise from +y, whatever their template's comment says."""
    job, _ = job_of(place)
    view = standing_view(job.cameras["eulerian"])
    np.testing.assert_allclose(view.position, [10, 20, 5])
    forward = view.world_from_camera.matrix[:3, 0]
    west = [-np.cos(np.radians(10)), 0.0, -np.sin(np.radians(10))]
    np.testing.assert_allclose(forward, west, atol=1e-9)
    assert np.degrees(view.lens.opening) == pytest.approx(FOV)
    south = standing_view(job.cameras["interactive"]).world_from_camera.matrix[:3, 0]
    np.testing.assert_allclose(south[:2] / np.linalg.norm(south[:2]), [0, -1], atol=1e-9)
    assert job.cameras["lagrangian"].vehicle == "v0"
    flight = job.cameras["cinematic"].keyframes
    assert [(key.time, key.heading) for key in flight] == [(2.0, 10.0), (10.5, 350.0)]


def test_shots_keep_their_times(place):
    job, _ = job_of(place)
    shots = [(shot.camera, shot.start, shot.end) for shot in job.shots]
    assert shots == [("eulerian", 2, 5), ("lagrangian", 1, 4), ("cinematic", 2, 11)]


@pytest.mark.parametrize(
    ("heads", "countdown", "design"),
    [(2, True, "two_heads"), (3, True, "countdown"), (3, False, "three_heads")],
)
def test_designs_of_signals(place, heads, countdown, design):
    job, _ = job_of(place, signals={"num_heads": heads, "countdown_timer": countdown})
    assert job.signals.design == design


def test_what_is_not_taken_over_is_said(place):
    _, notes = job_of(place, visualization={"show_other_vehicles": False, "glow": 3})
    said = "\n".join(notes)
    assert "none.add.xml" in said and "done without" in said
    assert "visualization.lane_width was not taken over" in said
    assert "show_other_vehicles was not taken over" in said
    assert "visualization.glow is no key of sumo3Dviz" in said
    assert "without scenario.vehicle_types everybody is drawn as a car" in said
    # Nothing that was taken over is complained about.
    assert "sky_texture" not in said and "pos_x" not in said and "simtime" not in said


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"paths": {"sumo_network_file": "gone.net.xml"}}, "--root"),
        ({"paths": {"trajectory_file": "gone.xml"}}, "--trajectories"),
        ({"visualization": {"sky_texture": "sky_pink"}}, "no sky 'sky_pink'"),
        ({"rendering": {"video_fps": "fast"}}, "'fast' is no number"),
        ({"modes": {"lagrangian": {"simtime_start": 1}}}, "nobody to ride with"),
        ({"modes": {"cinematic": {"simtime_start": 1}}}, "no key frames"),
    ],
)
def test_wrong_configurations_are_refused(place, changes, message, capsys):
    command = ["import-sumo3dviz", written(place, **changes), "-o", place / "scene.yaml"]
    assert main([str(word) for word in command]) == 2
    assert message in capsys.readouterr().err
    assert not (place / "scene.yaml").exists()


def test_a_root_without_the_network_is_named_and_what_lies_packed_there(place, capsys):
    network = place / "logs" / "net.net.xml"
    network.rename(network.with_name("net.net.xml.gz"))
    command = ["import-sumo3dviz", written(place), "--root", place, "-o", place / "scene.yaml"]
    assert main([str(word) for word in command]) == 2
    said = capsys.readouterr().err
    assert f"there is no {network}; {network}.gz is there" in said and "--root" not in said


def test_no_configuration_at_all(tmp_path, capsys):
    (tmp_path / "a.yaml").write_text("scenario: {}\n", encoding="utf-8")
    assert main(["import-sumo3dviz", str(tmp_path / "a.yaml")]) == 2
    assert "no configuration of sumo3Dviz" in capsys.readouterr().err


def test_the_command_writes_a_scene_that_can_be_checked(place, capsys):
    scene = place / "scene.yaml"
    command = ["import-sumo3dviz", written(place), "-o", scene]
    assert main([str(word) for word in command]) == 0
    assert "next: sumo3dviz-pt check" in capsys.readouterr().out
    assert load_job(scene).shots
