"""Slots show their road users wherever those are, and only what moved is told to Mitsuba."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import (
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

from sumo3dviz_pt.model.scene import Slots

pytestmark = pytest.mark.usefixtures("compiled")


def scene():
    materials = {"grey": diffuse(0.3), "matt_tint": {**diffuse(0.5), "reflectance": TINT}}
    parts = [static("ground", plane(400.0), "grey")]
    return scene_of(parts, materials, prototypes=[cube()], slots=Slots(near={"cube": 3}))


TINT = {"type": "tint"}
EYE = (0.0, -20.0, 8.0)


def frame(time: float, *places: float, eye=EYE):
    cars = [mover(f"v{k}", (x, 0.0, 0.0), (0.6, 0.1, 0.1)) for k, x in enumerate(places)]
    return frame_of(view_at(eye, pitch=-15), time=time, movers=cars)


class Written(dict):
    """Parameters that remember what was written to them."""

    def __init__(self, parameters) -> None:
        self._parameters = parameters

    def __setitem__(self, key, value) -> None:
        super().__setitem__(key, value)
        self._parameters[key] = value

    def __getattr__(self, name):
        return getattr(self._parameters, name)

    def __getitem__(self, key):
        return self._parameters[key]

    def keys(self):
        return self._parameters.keys()


def moved(session, state) -> set[str]:
    """Slots that a frame tells Mitsuba of."""
    written = Written(session.loaded.parameters)
    session.loaded.pool.update(written, state)
    session.loaded.parameters.update()
    return {key.split(".")[0] for key in dict.keys(written) if key.endswith("to_world")}


def test_only_slots_that_moved_are_told() -> None:
    with session_of(scene()) as session:
        session.show(frame(0.0, -4.0, 4.0))
        assert moved(session, frame(1.0, -4.0, 4.0)) == set()
        assert moved(session, frame(2.0, -4.0, 5.0)) == {"slot_0001"}
        assert moved(session, frame(3.0, -4.0)) == {"slot_0001"}
        # What is shown lies elsewhere relative to another origin; free slots wait below that one.
        assert moved(session, frame(4.0, -4.0, eye=(1000.0, -20.0, 8.0))) == {"slot_0000"}
        everyone = {"slot_0000", "slot_0001", "slot_0002"}
        assert moved(session, frame(5.0, -4.0, eye=(0.0, -20.0, 500.0))) == everyone


@pytest.mark.slow
@pytest.mark.parametrize("before", [(), (9.0,), (-4.0, 3.0), (-4.0, 4.0, 8.0)])
def test_pictures_do_not_depend_on_where_slots_were(before: tuple[float, ...]) -> None:
    wanted = frame(1.0, -4.0, 4.0)
    with session_of(scene()) as session:
        alone = session.render(wanted).radiance
    with session_of(scene()) as session:
        session.render(frame(0.0, *before))
        assert np.array_equal(session.render(wanted).radiance, alone)
        # A scene that is loaded again finds its slots where they were.
        session.loaded.drop()
        assert np.array_equal(session.render(wanted).radiance, alone)
        assert np.array_equal(session.render(replace(wanted)).radiance, alone)


@pytest.mark.parametrize("level", ["movers", "far"])
def test_who_was_left_out_of_the_trees_is_seen_later(level) -> None:
    """Whatever was shown before, a frame is the picture that it is alone."""
    bare = scene()
    slots = replace(bare.slots, far={"cube": 3})
    states = [frame_of(view_at(EYE, pitch=-15), time=1.0)]
    for places in ((-4.0, 4.0), (-4.0,), (-4.0, 0.0, 4.0)):
        cars = frame(1.0, *places).movers
        states.append(replace(states[0], **{level: cars}))
    alone = []
    for state in states:
        with session_of(replace(bare, slots=slots)) as session:
            alone.append(session.render(state).radiance)
    with session_of(replace(bare, slots=slots)) as session:
        for number in (1, 0, 2, 3, 2, 0, 3):
            np.testing.assert_array_equal(session.render(states[number]).radiance, alone[number])
    assert not any(np.array_equal(alone[0], other) for other in alone[1:])
