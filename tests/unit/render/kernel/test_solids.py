"""Two scenes, of what stands and of what moves, are seen as one."""

from __future__ import annotations

import numpy as np
import pytest
from builders import (
    RAW,
    box,
    cube,
    diffuse,
    frame_of,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.scene import Slots

pytestmark = pytest.mark.usefixtures("compiled")

LAYERS = ("radiance", "depth", "albedo", "normal", "ids")


def shown(slots: Slots):
    """A wall on a plane, and what may drive before or behind it."""
    stands = [
        static("road", plane(40.0), "grey"),
        static("wall", box((2, -1, 0), (3, 5, 2)), "grey"),
    ]
    materials = {**MATERIALS, "grey": diffuse(0.4), "matt_tint": diffuse(0.5)}
    return scene_of(stands, materials, prototypes=[cube()], slots=slots)


def pictures(*, apart: bool):
    """Frames in which a cube comes from behind the wall."""
    scene = shown(Slots(near={"cube": 1}))
    with session_of(scene, size=(48, 36), quality=RAW, layers=LAYERS) as session:
        assert session.loaded.apart
        session.loaded.apart = apart
        found = []
        for x in (4.5, 1.0, -1.5):
            car = mover("a", (x, 1.0, 0.0), (0.5, 0.1, 0.1))
            state = frame_of(view_at((-9, 0, 3), pitch=-12, heading=90.0), movers=[car])
            found.append(session.render(state).layers)
            standing = session.loaded.standing
            assert (standing is not None) == apart
    return found


@pytest.mark.slow
def test_two_scenes_are_seen_as_one() -> None:
    one, two = pictures(apart=False), pictures(apart=True)
    seen = [int((frame["ids"] > 0).sum()) for frame in two]
    assert seen[0] < seen[1] < seen[2] and seen[2] > 20
    for whole, parted in zip(one, two, strict=True):
        for name in LAYERS:
            np.testing.assert_array_equal(whole[name], parted[name])


def test_where_nothing_moves_there_is_one_scene() -> None:
    with session_of(shown(Slots()), size=(16, 12), quality=RAW) as session:
        session.render(frame_of(view_at((-9, 0, 3), pitch=-12, heading=90.0)))
        assert session.loaded.standing is None


def test_what_stands_stays_when_something_moves() -> None:
    with session_of(shown(Slots(near={"cube": 1})), size=(16, 12), quality=RAW) as session:
        for x in (1.0, 1.5):
            car = mover("a", (x, 1.0, 0.0), (0.5, 0.1, 0.1))
            session.render(frame_of(view_at((-9, 0, 3), pitch=-12, heading=90.0), movers=[car]))
            moving, standing = (
                {shape.id() for shape in scene.shapes()}
                for scene in (session.loaded.scene, session.loaded.standing)
            )
            assert not any(name.startswith("static") for name in moving)
            assert standing and all(name.startswith("static") for name in standing)
