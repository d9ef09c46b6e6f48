"""A log of SUMO's own in which every class drives."""

import shutil

import make_class_parade as parade
import numpy as np
import pytest

from sumo3dviz_pt.cast.choice import PlainChoice, choose, looks_for, models_for
from sumo3dviz_pt.model.traffic import ScenarioFiles
from sumo3dviz_pt.motion import smooth_log
from sumo3dviz_pt.sumo.scenario import read_scenario
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (shutil.which("sumo") and shutil.which("netconvert")), reason="needs SUMO"
    ),
]

BOARDED = {"person:rider", "container:load"}


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parade")
    routes = parade.write_log(folder)
    log = (folder / "parade.fcd.xml.gz",)
    return read_scenario(ScenarioFiles(folder / "parade.net.xml", log, vehicle_types=(routes,)))


@pytest.fixture(scope="module")
def trajectories(scenario):
    options = {"network": scenario.network, "types": scenario.vehicle_types}
    return {t.key: t for t in smooth_log(scenario.traffic, smoother="lane", **options)}


def test_every_class_is_there_and_shows_a_model(scenario, trajectories):
    kinds = scenario.vehicle_types
    seen = {kinds[t.type_id].vclass for t in trajectories.values()}
    assert seen == set(CLASS_DEFAULTS)
    options = {"models": models_for({}), "own": {}, "seed": 1, "looks": looks_for(())}
    for each in trajectories.values():
        choice = choose(kinds[each.type_id], name=each.id, **options)
        assert not isinstance(choice, PlainChoice), each.type_id


def test_who_boards_and_what_is_loaded_is_drawn_only_before(trajectories):
    for key in BOARDED:
        (piece,) = trajectories[key].pieces
        assert piece.end < 4.0
    vehicles = [t for t in trajectories.values() if t.key not in BOARDED]
    assert min(t.pieces[-1].end for t in vehicles) > parade.SECONDS - 1.5
    times = np.arange(0.0, parade.SECONDS - 1.0, 0.5)
    motions = [t.sample(times) for t in trajectories.values()]
    for k in range(len(times)):
        there = np.array([m.positions[k] for m in motions if m.alive[k]])
        apart = np.linalg.norm(there[:, None] - there[None], axis=2)
        assert apart[np.triu_indices(len(there), 1)].min() > 1.5


def test_nobody_jumps(trajectories):
    times = np.arange(0.0, parade.SECONDS - 1.0, 0.1)
    for each in trajectories.values():
        motion = each.sample(times)
        steps = np.linalg.norm(np.diff(motion.positions[motion.alive], axis=0), axis=1)
        assert steps.max(initial=0.0) < 0.1 * 12.0, each.key
