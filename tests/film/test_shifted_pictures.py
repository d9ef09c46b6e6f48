"""A scenario that is moved by whole kilometres gives the same scene and picture, bit by bit."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from shifting import differences, first_steps, shift

import sumo3dviz_pt as sv
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.accounts import film_account
from sumo3dviz_pt.pipeline.production import Request, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job, make_job
from sumo3dviz_pt.proposals.proposal import propose

EXAMPLE = Path(__file__).parents[2] / "examples" / "crossing"
SIZE = (48, 27)
TIME = 446.0
AWAY = (-1_000_000, 10_000_000)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The crossing of the examples with the beginning of its log."""
    folder = tmp_path_factory.mktemp("crossing")
    for pattern in ("*.xml", "*.sumocfg", "scene.yaml", "[!f]*.gz"):
        for file in EXAMPLE.glob(pattern):
            shutil.copy(file, folder)
    log = first_steps(EXAMPLE / "fcd.xml.gz", folder, 60)
    assert log.is_file()
    return folder


def test_the_scene_and_the_picture_are_the_same(crossing, tmp_path):
    there = shift(crossing.iterdir(), tmp_path / "there", AWAY)
    made, pictures, said = [], [], []
    for folder in (crossing, there):
        job = load_job(folder / "scene.yaml")
        flight = prepare(job, Request("flight", "draft", SIZE), np.array([TIME]))
        made.append((flight.shot.data, flight.shot.frame_at(TIME)))
        said.append(film_account(flight, "a", shared={}, pace={})["frames"][0])
        with opened(flight) as session:
            pictures.append(session.render(made[-1][1]).radiance)
    assert made[0][1].movers
    # Only what is said of the scene tells its place, in SUMO's coordinates.
    for unlike in differences(*made):
        assert ".left_out." in unlike, unlike
        (x, y), (its_x, its_y) = re.findall(r"\((-?\d+), (-?\d+)\)", unlike)
        assert (int(its_x) - int(x), int(its_y) - int(y)) == AWAY
    assert pictures[0].std() > 0.0
    assert np.array_equal(*pictures)
    # What is said of it is in SUMO's coordinates.
    here, away = (each["camera"].pop("position") for each in said)
    assert np.subtract(away, here) == pytest.approx([*AWAY, 0.0], abs=1e-6)
    assert said[0] == said[1]


def test_proposals_and_lists_are_in_the_coordinates_of_sumo(crossing, tmp_path):
    there = shift(crossing.iterdir(), tmp_path / "there", AWAY)
    texts, users = [], []
    for folder in (crossing, there):
        text, _ = propose(folder / "crossing.sumocfg", output=folder / "new.yaml")
        (folder / "new.yaml").write_text(text)
        make_job(parse_yaml(text)[0], folder=folder)
        found = sv.load(folder / "scene.yaml").find_vehicles(near="corner", radius=200.0, at=TIME)
        users.append([(user.id, user.place, user.passage) for user in found])
    shift([crossing / "new.yaml"], tmp_path / "moved", AWAY)
    for folder in (there, tmp_path / "moved"):
        lines = (folder / "new.yaml").read_text().splitlines()
        texts.append([line for line in lines if not line.startswith("# Most")])
    assert texts[0] == texts[1]
    assert users[0] and [user[0] for user in users[0]] == [user[0] for user in users[1]]
    for (_, place, passage), (_, other, its) in zip(*users, strict=True):
        assert (other.x - place.x, other.y - place.y) == pytest.approx(AWAY, abs=1e-6)
        assert passage == its
