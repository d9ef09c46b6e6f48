"""Instruments tell the truth: needles point where the motion says, in every frame."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.bodies import build_body, has_windscreen, open_cockpit
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.library.vehicles.interior.controls import NEEDLE, needle_angles
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import Mover, View
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.motion import smooth

CARS = {m.name: m for m in models_for({}) if "passenger" in m.vclasses}
MODELS = {m.name: (m, vclass) for m in models_for({}) for vclass in sorted(m.vclasses)[:1]}
UNSTEERED = {"ship", "aircraft", "drone", "container", "cable_car"}
BARS = {"rickshaw"}
RAILS = {"rail", "rail_electric", "rail_fast", "rail_urban", "subway", "tram"}
KEY = "vehicle:ego"
SPEEDS = np.array([0.0, 0.0, 0.0, 2.0, 6.0, 12.0, 20.0, 30.0, 36.0, 36.0, 36.0])


def ride(name: str) -> Fleet:
    """A car that waits, sets off and reaches 130 km/h."""
    times = np.arange(len(SPEEDS), dtype=float)
    along = np.concatenate([[0.0], np.cumsum((SPEEDS[1:] + SPEEDS[:-1]) / 2.0)])
    places = np.column_stack([along, 0 * along, 0 * along])
    none = np.full(len(times), -1)
    trace = Trace("ego", "vehicle", "", times, places, 0 * along, SPEEDS, 0 * along, none, none)
    body = build_body(ModelChoice(CARS[name], "passenger", CARS[name].size), {})
    motion = smooth(trace, smoother="paper_symmetric", step=1.0)
    prototypes = {unit.prototype.name: unit.prototype for unit in body.assembly.units}
    fleet = Fleet((motion,), (body,), ((0.5, 0.5, 0.5),), prototypes)
    return fleet.with_cockpit(KEY)


def parts_at(fleet: Fleet, time: float, *, inside: bool = True) -> list[Mover]:
    """What the car is drawn with."""
    view = View(Transform(np.eye(4)), Lens(1.0), rides_in=KEY, cutaway=inside)
    present = fleet.presence.at(time)
    (whole,) = fleet.wholes(present, np.array([0]), view=view)
    return list(fleet.parts(present, 0, whole, level="near", ridden=True))


def kmh_shown(cabin: Mover, needle: Mover) -> float:
    """Read the dial from the driver's side."""
    local = np.linalg.inv(cabin.world_from_body.matrix) @ needle.world_from_body.matrix
    _, y, z = local[:3, 2]
    speeds = np.linspace(0.0, 60.0, 601)
    angles = [needle_angles(float(speed))[0] for speed in speeds]
    return 3.6 * float(np.interp(np.arctan2(-y, z), angles, speeds))


@pytest.mark.parametrize("name", sorted(CARS))
def test_the_needle_shows_the_speed_of_the_motion(name: str) -> None:
    fleet = ride(name)
    for time in np.linspace(0.0, 10.0, 41).tolist():
        cabin, *rest = parts_at(fleet, time)
        speedometer, counter = (mover for mover in rest if mover.prototype == NEEDLE)
        driven = 3.6 * float(fleet.trajectories[0].pieces[0].sample(np.array([time])).speeds[0])
        assert abs(kmh_shown(cabin, speedometer) - driven) < 2.0
        assert speedometer.name != counter.name


def test_there_is_room_for_needles_only_where_the_car_is_open() -> None:
    fleet = ride("sedan")
    assert fleet.drawn(0, opened=True).near.count(NEEDLE) == 2
    assert NEEDLE not in fleet.drawn(0).near
    assert [m.prototype for m in parts_at(fleet, 3.0, inside=False)] == ["sedan"]


def test_revolutions_rise_with_the_speed_and_never_jump() -> None:
    angles = np.array([needle_angles(speed) for speed in np.arange(0.0, 72.0, 0.1)])
    steps = np.degrees(np.diff(angles, axis=0))
    assert (steps > 0.0).all() and steps.max() < 2.0
    np.testing.assert_array_equal(needle_angles(-3.0), needle_angles(3.0))
    assert np.degrees(angles.max()) <= 130.0


@pytest.mark.parametrize("name", sorted(MODELS))
def test_mirrors_and_wheels_are_those_of_road_vehicles(name: str) -> None:
    model, vclass = MODELS[name]
    body = build_body(ModelChoice(model, vclass, model.size), {})
    opened = open_cockpit(body, left_hand=False, wipers=True)
    materials = {part.material for part in opened.body.parts}
    whole = {part.material for part in body.prototype.parts}
    wide = body.size[1] > 1.2
    built = wide and vclass not in UNSTEERED | BARS
    steered = built and vclass not in RAILS
    assert has_windscreen(body) == (wide and vclass not in UNSTEERED), "else no pane is wet"
    assert ("mirror" in materials) == steered
    assert ("dash_pad" in materials - whole) == built
    assert ("leather_rim" in materials) == steered, "a rickshaw has its own handlebar"
    assert len(opened.axes) in ((0, 2) if steered else (0,))


@pytest.mark.parametrize("name", sorted(MODELS))
def test_the_windscreen_stands_where_the_model_has_it(name: str) -> None:
    model, vclass = MODELS[name]
    seat = build_body(ModelChoice(model, vclass, model.size), {}).seat
    said = catalog.find("vehicles", name).meta.get("cowl")
    assert said is None or seat.cowl[0] == pytest.approx(said, abs=0.01 + 0.02 * abs(said))
