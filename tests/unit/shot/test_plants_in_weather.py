"""Levels of a study may differ in the weather: then no plant and nobody may differ with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.job.settings import WeatherSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.pipeline.live import Ground
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.build import Shot, build_shot
from sumo3dviz_pt.world.build import World

TIMES = np.array([4.0, 5.0])
CALM = {"wind": {"speed": 0.0}}


def shot_in(weather: dict[str, object] | None, file: Path) -> Shot:
    """Cars and trees seen from a post beside a road, in a weather of the scene file."""
    job = load_job(file)
    given = None if weather is None else WeatherSettings.model_validate(weather)
    job = job.model_copy(update={"weather": given})
    ground = Ground.of(job)
    world = World.of(ground.scenario, job)
    return build_shot(world, ground.trajectories, camera=job.cameras["post"], times=TIMES)


def crowns(shot: Shot) -> dict[str, tuple[str, Floats]]:
    """Which model each plant has, and where it stands."""
    return {
        mover.id: (mover.prototype, mover.world_from_body.matrix)
        for mover in shot.frame_at(4.0).fixtures
        if mover.part == "plant"
    }


def leaves(shot: Shot) -> dict[str, Floats]:
    """The corners of all leaves that stand by themselves, and of models."""
    bodies = shot.data.prototypes.items()
    return {
        **{part.id: part.part.mesh.vertices for part in shot.data.static if _leafy(part.family)},
        **{n: p.parts[-1].mesh.vertices for n, p in bodies if n.startswith("plant/")},
    }


def _leafy(family: str) -> bool:
    return family in ("trees", "shrubs", "hedges")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("weather")
    scene = write_scenario(folder, vehicles=2, persons=12, trees=True)
    plants = [
        f'<poi id="{kind}{k}" type="{kind}" x="{3 + 4 * k}" y="{y}"/>'
        for k in range(7)
        for kind, y in (("tree", 12), ("shrub", 8))
    ]
    text = "\n".join(("<additional>", *plants, "</additional>"))
    (folder / "trees.add.xml").write_text(text, encoding="utf-8")
    scene.write_text(scene.read_text().replace("template: abstract", "template: village_day"))
    return Path(scene)


@pytest.fixture(scope="module")
def dry(file: Path) -> Shot:
    return shot_in(None, file)


@pytest.mark.parametrize(
    "weather",
    [
        {"preset": "rain", **CALM},
        {"preset": "fog", **CALM},
        {"preset": "downpour", **CALM},
        {"wind": {"speed": 9.0}},
    ],
    ids=str,
)
def test_weather_changes_no_crown(weather: dict[str, object], dry: Shot, file: Path) -> None:
    other = shot_in(weather, file)
    mine, theirs = crowns(dry), crowns(other)
    assert len(mine) > 8 and mine.keys() == theirs.keys()
    for name, (model, place) in mine.items():
        assert theirs[name][0] == model, name
        # Wind leans a plant about its foot.
        np.testing.assert_array_equal(theirs[name][1][:3, 3], place[:3, 3])
    still, moved = leaves(dry), leaves(other)
    assert still.keys() == moved.keys()
    for name, corners in still.items():
        np.testing.assert_array_equal(moved[name], corners)
    # Nor does anybody dress for it.
    assert other.fleet.outfits == dry.fleet.outfits
    assert [b.prototype.name for b in other.fleet.bodies] == [
        b.prototype.name for b in dry.fleet.bodies
    ]
