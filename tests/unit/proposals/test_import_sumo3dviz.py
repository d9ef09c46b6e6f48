"""Configurations of sumo3Dviz become scene files."""

import gzip

import numpy as np
import pytest
import yaml
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.proposals.sumo3dviz import FOV, translate
from sumo3dviz_pt.shot.cameras.free import standing_view

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
    assert "name the files that define them in scenario.vehicle_types" in said
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
        (
            {"modes": {"cinematic": {"camera_position_trajectory": {"soon": PLACE}}}},
            "'soon' is no time in seconds",
        ),
        (
            {"modes": {"interactive": {"initial_camera_position": {"position": [1, 2]}}}},
            "are not 3 numbers",
        ),
        ({"modes": {"eulerian": {"simtime_start": "a", "simtime_end": 3}}}, "'a' is no number"),
    ],
)
def test_wrong_configurations_are_refused(place, changes, message, capsys):
    command = ["import-sumo3dviz", written(place, **changes), "-o", place / "scene.yaml"]
    assert main([str(word) for word in command]) == 2
    assert message in capsys.readouterr().err
    assert not (place / "scene.yaml").exists()


def test_a_root_without_the_network_is_named(place, capsys):
    network = place / "logs" / "net.net.xml"
    network.unlink()
    command = ["import-sumo3dviz", written(place), "--root", place, "-o", place / "scene.yaml"]
    assert main([str(word) for word in command]) == 2
    said = capsys.readouterr().err
    assert f"there is no {network}" in said and "--root" not in said


def test_packed_and_moved_files_are_found(place):
    """Examples are copied without the folders above them, and packed."""
    packed = gzip.compress((place / "logs" / "net.net.xml").read_bytes())
    (place / "logs" / "net.net.xml").unlink()
    (place / "configs" / "net.net.xml.gz").write_bytes(packed)
    (place / "logs" / "trees.add.xml").rename(place / "configs" / "trees.add.xml")
    (place / "logs" / "fcd.xml").rename(place / "configs" / "other.xml")
    job, notes = job_of(place)
    assert job.scenario.network.name == "net.net.xml.gz"
    assert job.objects.trees.file == place / "configs" / "trees.add.xml"
    assert job.scenario.trajectories == (place / "configs" / "other.xml",)
    said = "\n".join(notes)
    assert "not just where the configuration says: net.net.xml.gz, trees.add.xml" in said
    assert "does not exist" in said and "other.xml is taken instead" in said


def test_shots_last_as_long_as_their_ego(place):
    """There, a film has frames only while its ego exists."""
    modes = configuration()["modes"]
    modes["eulerian"] |= {"simtime_start": 5, "simtime_end": 90}
    modes["lagrangian"] |= {"simtime_start": 50, "simtime_end": 90}
    modes["cinematic"]["ego_identifier"] = "nobody"
    job, notes = job_of(place, modes=modes)
    shots = [(shot.camera, shot.start, shot.end) for shot in job.shots]
    assert shots == [("eulerian", 5, 12), ("cinematic", 2, 11)]
    said = "\n".join(notes)
    assert "modes.eulerian is filmed from 5 to 12 s, while 'v0' is in the log" in said
    assert "no shot for modes.lagrangian: 'v0' is in the log at other times (0 to 12 s)" in said
    assert "modes.cinematic.ego_identifier: 'nobody' is not in the log" in said


def test_sizes_of_trees_and_widths_of_lines(place):
    job, notes = job_of(
        place,
        visualization={
            "tree_scale_1": 0.4,
            "tree_scale_2": 0.5,
            "tree_size_variability": 2.0,
            "sep_line_width": 0,
            "viewer_height": 1.5,
        },
    )
    assert job.objects.trees.scale == 3.0 and job.objects.trees.file is not None
    assert not job.roads.markings
    assert any("viewer_height" in each and "had no effect there" in each for each in notes)
    job, notes = job_of(place, visualization={"tree_size_variability": 0})
    assert (job.objects.trees.scale, job.objects.trees.variation) == (1.0, 0.0)
    assert any("hid all trees" in each for each in notes)


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
