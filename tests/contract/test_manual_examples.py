"""Commands that the manual gives for the bundled examples suit them: cameras, times, road users."""

from __future__ import annotations

from argparse import Namespace
from fnmatch import fnmatchcase
from functools import cache

import pytest
from manual import PAGES, ROOT, commands, text_of

import sumo3dviz_pt as sv
from sumo3dviz_pt import cli
from sumo3dviz_pt.cli.options import overrides_of
from sumo3dviz_pt.job.settings import LagrangianCamera
from sumo3dviz_pt.pipeline.scene_file import load_job

SCENES = ("examples/crossing/scene.yaml", "examples/ronda/scene.yaml")
_NAMED = ("time", "at", "start", "end")
"""Options that hold SUMO's times."""


@cache
def lives(scene: str) -> dict[str, tuple[float, float]]:
    """First and last time of everyone in an example's log [s]."""
    return {user.id: (user.begin, user.end) for user in sv.load(ROOT / scene).vehicles}


@pytest.mark.parametrize("scene", SCENES)
def test_commands_suit_the_example_that_they_name(scene: str) -> None:
    parser = cli.build_parser()
    found = [words for page in PAGES for words in commands(text_of(page)) if scene in words]
    assert len(found) >= 8
    for words in found:
        check(parser.parse_args(words), scene)


def check(options: Namespace, scene: str) -> None:
    """Cameras are there, times lie in the log, and who is named drives then."""
    known = lives(scene)
    begin, end = min(b for b, _ in known.values()), max(e for _, e in known.values())
    times = [t for name in _NAMED if isinstance(t := getattr(options, name, None), float)]
    assert all(begin <= time <= end for time in times), options
    if getattr(options, "vehicle", None):
        first, last = known[options.vehicle]
        assert all(first <= time <= last for time in times), options
    if not hasattr(options, "set"):
        return
    job = load_job(ROOT / scene, overrides_of(options))
    for pattern in job.vehicles.by_id:
        assert any(fnmatchcase(user, pattern) for user in known), pattern
    if getattr(options, "camera", None):
        # The page itself writes the camera where the example has none of that name.
        camera = job.cameras.get(options.camera)
        assert camera is not None or options.camera in ("path", "my_view"), options
        if isinstance(camera, LagrangianCamera):
            first, last = known[camera.vehicle]
            assert all(first <= time <= last for time in times), options
