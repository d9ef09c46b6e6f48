"""Whatever is odd about shapes, widths and lengths of a network, it is built."""

from __future__ import annotations

import logging
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest
from damage import NETWORK, write_town
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.sumo import read_network

SHAPES = len(re.findall(r"\sshape=", NETWORK))
NUMBERS = len(re.findall(r'(?:width|length)="', NETWORK))

WAYS = {
    # way: what becomes of a shape's points
    "empty": lambda points, at: [],
    "one point": lambda points, at: [points[at]],
    "all the same": lambda points, at: [points[at]] * len(points),
    "repeated": lambda points, at: [*points[: at + 1], *points[at:]],
    "one is missing": lambda points, at: points[:at] + points[at + 1 :],
    "spike": lambda points, at: [*points[: at + 1], "37.00,41.00", *points[at:]],
    "backward": lambda points, at: points[::-1],
    "swapped": lambda points, at: [points[at], *points[1:at], points[0], *points[at + 1 :]],
    "there and back": lambda points, at: [*points, *points[::-1]],
    "nearly repeated": lambda points, at: [*points[: at + 1], points[at] + "00001", *points[at:]],
    "closed": lambda points, at: [*points, points[0]],
}
"""Geometry that a program may write; points are text."""

shapes = st.tuples(st.integers(0, SHAPES - 1), st.sampled_from(sorted(WAYS)), st.integers(0, 10))
numbers = st.tuples(
    st.integers(0, NUMBERS - 1), st.sampled_from(["0", "-1", "0.001", "0.05", "-0.5", "150"])
)
oddities = st.tuples(st.lists(shapes, max_size=4), st.lists(numbers, max_size=3))


def odd_text(chosen) -> str:
    """The town's network with odd shapes and numbers."""
    text = NETWORK
    for number, way, at in chosen[0]:
        found = list(re.finditer(r'(?<=\sshape=")[^"]*(?=")', text))[number]
        points = found[0].split() or ["0.00,0.00"]
        new = " ".join(WAYS[way](points, at % len(points)))
        text = text[: found.start()] + new + text[found.end() :]
    for number, value in chosen[1]:
        found = list(re.finditer(r'(?<=width=")[^"]*|(?<=length=")[^"]*', text))[number]
        text = text[: found.start()] + value + text[found.end() :]
    return text


def read(text: str) -> Network:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "net.net.xml"
        path.write_text(text, encoding="utf-8")
        return read_network(path)


@settings(max_examples=tries(60), deadline=None)
@given(oddities)
def test_odd_networks_are_read_with_one_note_at_most(chosen):
    said: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: said.append(record.getMessage())
    logger = logging.getLogger("sumo3dviz_pt")
    logger.addHandler(handler)
    try:
        network = read(odd_text(chosen))
    finally:
        logger.removeHandler(handler)
    assert len(said) <= 1 and all("\n" not in text for text in said)
    assert len(network.lanes) == len(read(NETWORK).lanes)
    for lane in network.lanes.values():
        assert len(lane.shape) > 1 and np.isfinite(lane.shape).all()
        assert lane.width > 0 and lane.length > 0


@pytest.mark.slow
@settings(max_examples=tries(5), deadline=None)
@given(oddities)
def test_odd_networks_are_built(chosen):
    with tempfile.TemporaryDirectory() as folder:
        scene = write_town(Path(folder))
        scene.with_name("net.net.xml").write_text(odd_text(chosen), encoding="utf-8")
        # Odd lanes lie elsewhere than the log's.
        text = scene.read_text(encoding="utf-8")
        text = text.replace("scenario:\n", "scenario:\n  allow_misfit: true\n")
        scene.write_text(text, encoding="utf-8")
        production = prepare(load_job(scene), Request(camera="post"), np.array([4.0]))
        for each in production.shot.data.static:
            assert np.isfinite(each.part.mesh.vertices).all()
            assert each.part.mesh.faces.max(initial=-1) < len(each.part.mesh.vertices)
