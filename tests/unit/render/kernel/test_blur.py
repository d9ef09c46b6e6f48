"""What blurs while a shutter is open: the camera's own turn, a wheel's, a signal that changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import RAW, box, diffuse, frame_of, mover, scene_of, session_of, static, view_at

from sumo3dviz_pt.model.camera import Shutter
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.scene import FrameState, LampSet, Moment, Part, Prototype, Slots

pytestmark = pytest.mark.usefixtures("compiled")

SHUTTER = Shutter(0.0, 0.02, 16)
FINE = RAW.model_copy(update={"spp": 256, "pass_spp": 16})


def exposed(states, shutter=SHUTTER) -> FrameState:
    """A frame whose moments show what `states` does at their times."""
    moments = [Moment(rows, states(at)) for at, rows in shutter.exposures()]
    return replace(states(shutter.middle), exposure=tuple(moments))


def spread(weights, places) -> float:
    """Mean square distance from the mean."""
    middle = (weights * places).sum() / weights.sum()
    return float((weights * (places - middle) ** 2).sum() / weights.sum())


@pytest.mark.slow
def test_a_camera_that_turns_blurs_what_stands_by_its_angle() -> None:
    wall = static("wall", box((-9.0, 20.0, -5.0), (0.0, 21.0, 9.0)), "black")
    scene = scene_of([wall], {"black": diffuse(0.0)})
    per_second, size = 60.0, (200, 20)
    widths = []
    for turning in (0.0, per_second):

        def seen(at, turning=turning):
            heading = turning * (at - SHUTTER.middle)
            return frame_of(view_at((0.0, 0.0, 1.0), heading=heading, fov=20.0), time=at)

        with session_of(scene, size=size, quality=FINE) as session:
            line = session.render(exposed(seen)).radiance.mean(axis=-1)[9:11].mean(axis=0)
        slope = np.abs(np.diff(line))
        widths.append(12.0 * spread(slope, np.arange(len(slope))))
    angle = np.radians(per_second * 0.02)
    way = angle / view_at((0.0, 0.0, 1.0), fov=20.0).lens.pixel_width(size[0])
    assert np.sqrt(widths[1] - widths[0]) == pytest.approx(way, rel=0.05)


@pytest.mark.slow
def test_a_spoke_is_blurred_by_the_turn_of_its_wheel() -> None:
    """12 turns a second: 86 degrees in 20 ms, each as dark as the others."""
    spoke = Part(box((-0.1, -0.1, 0.0), (0.1, 0.1, 3.0)), "matt_tint")
    scene = scene_of(
        [],
        {"matt_tint": diffuse(0.0)},
        prototypes=[Prototype("spoke", (spoke,), (spoke,))],
        slots=Slots(near={"spoke": 1}),
    )
    view, size = view_at((0.0, 0.0, 0.0), heading=90.0, fov=20.0), (120, 120)
    rate = 2.0 * np.pi * 12.0

    def turned(at):
        angle = rate * (at - SHUTTER.middle)
        matrix = np.eye(4)
        matrix[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        matrix[0, 3] = 20.0
        placed = replace(
            mover("a", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), prototype="spoke"),
            world_from_body=Transform(matrix),
        )
        return frame_of(view, time=at, movers=[placed])

    with session_of(scene, size=size, quality=FINE) as session:
        still, blurred = (
            session.render(frame).radiance.mean(axis=-1)
            for frame in (turned(SHUTTER.middle), exposed(turned))
        )
    row, column = np.mgrid[:120, :120] - 59.5
    ring = (np.hypot(row, column) > 25.0) & (np.hypot(row, column) < 45.0)
    around = np.arctan2(column, -row)[ring]
    dark = [still.max() - picture[ring] for picture in (still, blurred)]
    assert dark[1].sum() == pytest.approx(dark[0].sum(), rel=0.03)
    turn = np.sqrt(12.0 * (spread(dark[1], around) - spread(dark[0], around)))
    assert turn == pytest.approx(rate * 0.02, rel=0.05)
    inside = np.abs(around) < 0.4 * rate * 0.02
    counts = np.histogram(around[inside], bins=5, weights=dark[1][inside])[0]
    assert counts.min() > 0.85 * counts.max()


@pytest.mark.slow
def test_a_signal_gives_as_much_light_as_it_is_on_during_the_exposure() -> None:
    lamp = box((-0.5, 20.0, 0.5), (0.5, 20.1, 1.5))
    signal = LampSet("lamp", "signals", lamp, np.zeros(len(lamp.faces), int), ("one",))
    scene = scene_of([], {"signal_lens": diffuse(0.0)}, lamps=(signal,))
    view = view_at((0.0, 0.0, 1.0), fov=10.0)
    on, off = np.array([[4.0, 1.0, 0.0]]), np.zeros((1, 3))

    def switched(at, since=0.015):
        return frame_of(view, time=at, lamps={"lamp": on if at > since else off})

    with session_of(scene, size=(32, 32), quality=FINE) as session:
        always, part, never = (
            session.render(exposed(lambda at, since=since: switched(at, since))).radiance
            for since in (-1.0, 0.015, 1.0)
        )
    middle = (slice(14, 18), slice(14, 18))
    share = (part - never)[middle].mean(axis=(0, 1))[:2]
    whole = (always - never)[middle].mean(axis=(0, 1))[:2]
    np.testing.assert_allclose(share, 0.25 * whole, rtol=0.02)
