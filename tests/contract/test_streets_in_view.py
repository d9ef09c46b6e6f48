"""Lamps, signs and furniture of our own yield to cameras of scene files, whoever wrote these.

`init` and `import-sumo3dviz` choose cameras before anybody knows where a lamp will stand. Only
streets are built here, on plain ground. What stands there is looked at through pictures, not by
the rule that placed it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
import shapely
import yaml
from any_network.programs import why_missing
from any_network.proposed import Pose, furnished
from any_network.simulation import simulate
from needed import skip_if

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.pipeline.reading import read_files
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.worlds import world_of
from sumo3dviz_pt.shot.cameras.aiming import clearance_of
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.street.places import Site, crossing_areas
from sumo3dviz_pt.world.street.street import build_street

CROSSING = Path(__file__).parents[2] / "examples" / "crossing"
ANGLES = ("ori_h", "ori_p", "ori_r")
NETWORKS = (4, 16)
"""Numbers of networks made by netgenerate, with footways."""

needs_sumo = skip_if(bool(why_missing()), why_missing() or "SUMO is here")


@pytest.fixture(scope="module")
def towns(tmp_path_factory):
    """Folders of simulations by number, made when they are asked for."""
    made: dict[int, Path] = {}

    def town(number: int) -> Path:
        if number not in made:
            made[number] = simulate(number, tmp_path_factory.mktemp("towns") / str(number))
        return made[number]

    return town


def street_of(job: Job, *, clear: bool) -> tuple[StaticPart, ...]:
    """What stands along streets around a scene's cameras, with its own clearance or without one."""
    files, scenario = read_files(job)
    network, world = scenario.network, world_of(scenario, job, files)
    around = surroundings(
        network,
        seed=job.seed,
        camera_path=CameraPath.joined(world.clearance.ways),
        clearance=world.clearance if clear else Clearance(),
    )
    taken, lines = np.zeros((0, 2)), shapely.STRtree([])
    site = Site(around, around.height_at, crossing_areas(network), taken, lines)
    return build_street(scenario, job.street, site=site, dark=False).static


def hidden_in(job: Job, static: Sequence[StaticPart]) -> Iterator[tuple[str, str]]:
    """Cameras, and what hides more than a little of their pictures, all along their ways."""
    _, scenario = read_files(job)
    for name, camera in job.cameras.items():
        own = clearance_of([camera], aspect=9.0 / 16.0, location=scenario.network.location)
        for way in own.ways:
            for eye, ahead in zip(way.positions, way.forwards, strict=True):
                pose = Pose(eye, eye + ahead, float(camera.lens.fov))
                yield from ((name, fault) for fault in furnished(pose, static))


def things_in(static: Sequence[StaticPart]) -> list[str]:
    """Names of what stands along streets."""
    return sorted({name for part in static for name, _ in part.part.mesh.things})


def proposed(folder: Path, scene: Path) -> Job:
    """The scene that `init` writes of a simulation."""
    assert main(["init", str(folder), "-o", str(scene)]) == 0
    return load_job(scene)


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(None, id="crossing", marks=pytest.mark.slow),
        pytest.param(NETWORKS[0], id="cycle lanes", marks=[needs_sumo, pytest.mark.slow]),
        pytest.param(NETWORKS[1], id="stops", marks=needs_sumo),
    ],
)
def test_what_init_writes_shows_no_lamp_right_before_a_camera(number, towns, tmp_path):
    job = proposed(CROSSING if number is None else towns(number), tmp_path / "scene.yaml")
    static = street_of(job, clear=True)
    assert {"street lamps", "signs", "furniture"} == {part.family for part in static}
    assert not list(hidden_in(job, static))
    if number is not None:
        assert len(things_in(static)) < len(things_in(street_of(job, clear=False))), "some yield"


def standing_before(name: str, *, aside: float) -> dict[str, float]:
    """Where sumo3Dviz has an eye 2.5 m from something along a street, that looks at it."""
    place = np.array([float(word) for word in name.split(":")[1].split(",")])
    eye = place + 2.5 * np.array([np.cos(aside), np.sin(aside), 0.0]) + [0.0, 0.0, 2.0]
    to_left = np.degrees(np.arctan2(eye[0] - place[0], place[1] - eye[1]))
    turned = {"ori_h": float(to_left), "ori_p": 0.0, "ori_r": 0.0}
    return dict(zip(("pos_x", "pos_y", "pos_z"), eye.tolist(), strict=True)) | turned


@needs_sumo
@pytest.mark.slow
def test_imported_cameras_are_cleared_as_others_are(towns, tmp_path):
    """All that stand or fly, put right before lamps by one who knows nothing of them."""
    folder = towns(NETWORKS[0])
    names = things_in(street_of(proposed(folder, tmp_path / "own.yaml"), clear=False))
    some = [name for name in names if "lamp" in name]
    poses = [
        standing_before(name, aside=float(turn))
        for turn, name in enumerate(some[:: max(1, len(some) // 4)][:4])
    ]
    visit = [[poses[3][key] for key in keys] for keys in (("pos_x", "pos_y", "pos_z"), ANGLES)]
    config = {
        "paths": {"trajectory_file": "fcd.xml", "sumo_network_file": "net.net.xml"},
        "modes": {
            "eulerian": {"simtime_start": 2, "simtime_end": 5, "camera_position": poses[0]},
            "cinematic": {
                "simtime_start": 2,
                "simtime_end": 5,
                "camera_position_trajectory": {"2.0": poses[1], "5.0": poses[2]},
            },
            "interactive": {
                "initial_camera_position": {"position": visit[0], "orientation": visit[1]}
            },
        },
    }
    (tmp_path / "peer.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    words = ["import-sumo3dviz", tmp_path / "peer.yaml", "--root", folder, "-o"]
    assert main([*map(str, words), str(tmp_path / "scene.yaml")]) == 0
    job = load_job(tmp_path / "scene.yaml")
    hidden, kept = (list(hidden_in(job, street_of(job, clear=clear))) for clear in (False, True))
    assert {name for name, _ in hidden} == {"eulerian", "cinematic", "interactive"}
    assert not kept
