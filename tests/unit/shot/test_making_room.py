"""A vehicle that parks beside its lane stands in no tree, hedge or invented car."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import box, write_scenario
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Floats, belonging, merge_meshes
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.pipeline.live import Ground
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.build import Shot, build_shot
from sumo3dviz_pt.shot.making_room import CUT, WHOLE, TakenGround, with_room
from sumo3dviz_pt.world.build import World
from sumo3dviz_pt.world.cache import place_around

TIMES = np.array([4.0, 5.0])
EYES = CameraPath.all_round(np.array([[10.0, -5.0, 2.0]]))
PLANTS = """<additional>
<poi id="t0" type="tree" x="8" y="14"/> <poi id="t1" type="tree" x="22" y="14"/>
<poly id="h" type="hedge" shape="-20,10 50,10"/></additional>"""
ROW = '<vehicle id="{id}" x="{x}" y="{y}" angle="90" type="car" speed="0" lane="w_0"/></timestep>'


def shot_with(folder: Path, parked: dict[str, tuple[float, float]]) -> Shot:
    """A road beside a hedge and trees, and vehicles that stand beside it."""
    file = write_scenario(folder, vehicles=2, trees=True)
    (folder / "trees.add.xml").write_text(PLANTS, encoding="utf-8")
    log = (folder / "fcd.xml").read_text(encoding="utf-8")
    for name, (x, y) in parked.items():
        log = log.replace("</timestep>", ROW.format(id=name, x=x, y=y))
    (folder / "fcd.xml").write_text(log, encoding="utf-8")
    text = file.read_text(encoding="utf-8").replace("template: abstract", "template: village_day")
    file.write_text(text, encoding="utf-8")
    job = load_job(file)
    ground = Ground.of(job)
    return build_shot(
        World.of(ground.scenario, job),
        ground.trajectories,
        camera=job.cameras["post"],
        times=TIMES,
    )


def middles(shot: Shot) -> Floats:
    """Of all faces of what grows and could be in the way, (n, 3) [m], and where models stand."""
    parts = [part.part.mesh for part in shot.data.static if part.family in WHOLE | CUT]
    feet = [m.world_from_body.matrix[None, :3, 3] + [0, 0, 0.8] for m in shot.stands.movers]
    return np.concatenate([*(m.vertices[m.faces].mean(axis=1) for m in parts), *feet])


def inside(points: Floats, front: tuple[float, float]) -> int:
    """How many points lie in a car that looks to the east."""
    away = points[:, :2] - front
    low = (points[:, 2] > 0.4) & (points[:, 2] < 1.2)
    return int(((away[:, 0] < 0.0) & (away[:, 0] > -4.0) & (abs(away[:, 1]) < 0.7) & low).sum())


def test_nobody_stands_in_what_grows(tmp_path: Path) -> None:
    parked = {"in_hedge": (30.0, 10.0), "in_tree": (10.0, 14.0)}
    for name in ("free", "taken"):
        (tmp_path / name).mkdir()
    free, taken = shot_with(tmp_path / "free", {}), shot_with(tmp_path / "taken", parked)
    for place in parked.values():
        assert inside(middles(free), place) > 0
        assert inside(middles(taken), place) == 0
    gone = [out.what for out in taken.data.left_out if out.why == "road users stand there"]
    assert gone and not any(out.why == "road users stand there" for out in free.data.left_out)
    # What is elsewhere stays: a second tree, and the hedge on both sides of the car.
    for beside in ((26.0, 10.0 - 5.0), (24.0, 14.0), (20.0, 10.0), (40.0, 10.0)):
        assert inside(middles(free), beside) == inside(middles(taken), beside)


def test_an_invented_car_gives_way_as_a_whole_and_a_lamp_stays(tmp_path: Path) -> None:
    shot = shot_with(tmp_path, {"parks": (10.0, -11.0)})
    job = load_job(tmp_path / "scene.yaml")
    place = place_around(World.of(Ground.of(job).scenario, job), EYES)

    def standing(family: str, *fronts: tuple[float, float]) -> StaticPart:
        meshes = [
            belonging(box((x - 4.5, y - 0.9, 0.2), (x, y + 0.9, 1.4)), f"{family}:{x:g},{y:g}")
            for x, y in fronts
        ]
        mesh = merge_meshes(meshes)
        return StaticPart(family, family, Part(mesh, "trim", np.ones((len(mesh.faces), 3))))

    cars = standing("parked cars", (40.0, -11.0), (12.0, -11.4), (-9.0, -11.0))
    lamps = standing("street lamps", (9.0, -11.0))
    cleared = with_room(replace(place, static=(cars, lamps)), shot.fleet, EYES)
    kept, same = cleared.static
    assert [n for n, count in kept.part.mesh.things if count] == [
        "parked cars:40,-11",
        "parked cars:-9,-11",
    ]
    assert kept.part.tint is not None and len(kept.part.tint) == len(kept.part.mesh.faces) == 24
    assert same is lamps
    assert [out.what for out in cleared.left_out[len(place.left_out) :]] == ["1 parked cars"]


@given(
    yaw=st.floats(-3.2, 3.2),
    size=st.tuples(st.floats(0.4, 30.0), st.floats(0.4, 3.0)),
    seed=st.integers(0, 99),
)
def test_points_are_in_a_box_or_not(yaw: float, size: tuple[float, float], seed: int) -> None:
    """The search by cells finds what a box holds, wherever it looks to."""
    rng = np.random.default_rng(seed)
    way = np.array([np.cos(yaw), np.sin(yaw)])
    front = np.array([*rng.uniform(-1e4, 1e4, 2), rng.uniform(-50, 50)])
    taken = TakenGround(front[None], way[None], np.array([size]))
    along, aside = rng.uniform(-1.6, 0.6, 60) * size[0], rng.uniform(-1.1, 1.1, 60) * size[1]
    flat = along[:, None] * way + aside[:, None] * [-way[1], way[0]]
    points = front + np.column_stack([flat, rng.uniform(-0.5, 2.0, 60)])
    up = points[:, 2] - front[2]
    for spare in (0.0, 0.2):
        wanted = (along < spare) & (along > -size[0] - spare) & (abs(aside) < size[1] / 2 + spare)
        wanted &= (up > 0.3) & (up < 1.4)
        np.testing.assert_array_equal(taken.holds(points, spare), wanted)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.array([[900.0, 0.0, 1.0]])])
def test_no_ground_is_taken_where_nobody_is(points: Floats) -> None:
    nobody = TakenGround(np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 2)))
    assert not nobody.holds(points).any()
