"""A scenario that is moved by whole kilometres gives the same scene and picture, bit by bit."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from shifting import differences, first_steps, shift

import sumo3dviz_pt as sv
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

EXAMPLE = Path(__file__).parents[2] / "examples" / "crossing"
SIZE = (48, 27)
TIME = 446.0

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
    there = shift(crossing.iterdir(), tmp_path / "there", (-1_000_000, 10_000_000))
    made, pictures = [], []
    for folder in (crossing, there):
        job = load_job(folder / "scene.yaml")
        flight = prepare(job, Request("flight", "draft", SIZE), np.array([TIME])).shot
        made.append((flight.data, flight.frame_at(TIME)))
        scene = sv.load(folder / "scene.yaml")
        still = scene.still(time=TIME, camera="corner", quality="draft", size=SIZE)
        pictures.append(still.radiance)
    assert made[0][1].movers
    assert not list(differences(*made))[:5]
    assert pictures[0].std() > 0.0
    assert np.array_equal(*pictures)
