"""How bodies are put together: coupled units, and wheels that stay round."""

import numpy as np
import pytest
from builders import cube

from sumo3dviz_pt.cast.drawing import Assembly, Stance, Unit
from sumo3dviz_pt.library.vehicles.recipe import WheelPlace
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.scene import Mover, Poses, Prototype

AXLES = (WheelPlace((-0.8, 0.7, 0.3), 0.3, steered=True), WheelPlace((-3.2, -0.7, 0.3), 0.3))
"""One wheel on the left and one on the right."""

SCALES = [(1.0, 1.0, 1.0), (1.4, 1.1, 0.9), (0.7, 1.25, 1.2)]


def whole_at(scale, *, name="cube", yaw=0.4, pitch=0.05):
    stretch = Transform(np.diag([*scale, 1.0]))
    place = Transform.from_pose((30.0, -4.0, 2.0), yaw=yaw, pitch=pitch)
    return Mover("vehicle:a", name, place @ stretch, (0.5, 0.1, 0.1), lit=frozenset(["head"]))


def test_a_single_body_is_the_whole():
    whole = whole_at((1.0, 1.0, 1.0))
    assembly = Assembly("cube", (Unit(cube()),))
    assert assembly.drawn.near == assembly.drawn.far == ("cube",)
    assert assembly.drawn.full == () and assembly.drawn.deforming == ()
    (drawn,) = assembly.movers(whole)
    assert (drawn.prototype, drawn.part, drawn.lit) == ("cube", "", whole.lit)
    np.testing.assert_array_equal(drawn.world_from_body.matrix, whole.world_from_body.matrix)


def test_the_first_unit_shows_what_the_whole_does():
    """A camera's own vehicle is opened: its first unit only."""
    assembly = Assembly("train", (Unit(cube("engine")), Unit(cube("car"), at=-12.0)))
    first, second = assembly.movers(whole_at((1.0,) * 3, name="engine~cockpit"))
    assert (first.prototype, second.prototype) == ("engine~cockpit", "car")


@pytest.mark.parametrize("scale", SCALES)
def test_units_are_coupled_where_the_scaled_body_says(scale):
    units = (Unit(cube("engine")), Unit(cube("car"), at=-12.0), Unit(cube("car"), at=-20.0))
    assembly = Assembly("train", units)
    assert assembly.drawn.near == ("engine", "car", "car")
    assert set(assembly.prototypes) == {"engine", "car"}
    whole = whole_at(scale)
    drawn = list(assembly.movers(whole))
    assert [mover.part for mover in drawn] == ["", "unit1", "unit2"]
    for mover, unit in zip(drawn, units, strict=True):
        expected = whole.world_from_body.points(np.array([[unit.at, 0.0, 0.0]]))[0]
        np.testing.assert_allclose(mover.world_from_body.position, expected, atol=1e-9)
        assert mover.id == whole.id and mover.colour == whole.colour


@pytest.mark.parametrize("scale", SCALES)
def test_wheels_stay_round_and_stand_on_the_ground(scale):
    assembly = Assembly("cube", (Unit(cube(), wheels=AXLES),))
    assert assembly.drawn.full == ("cube/full", "cube/wheel", "cube/wheel")
    whole = whole_at(scale)
    body, *wheels = assembly.movers(whole, full=True)
    assert (body.prototype, body.part) == ("cube/full", "")
    assert [wheel.part for wheel in wheels] == ["wheel0", "wheel1"]
    up = whole.world_from_body.matrix[:3, 2] / scale[2]
    for wheel, place in zip(wheels, AXLES, strict=True):
        assert wheel.prototype == "cube/wheel"
        linear = wheel.world_from_body.matrix[:3, :3]
        # The same factor along all three axes, which stay at right angles: round.
        np.testing.assert_allclose(linear.T @ linear, scale[2] ** 2 * np.eye(3), atol=1e-9)
        assert np.linalg.det(linear) > 0.0, "a mirrored wheel would be inside out"
        centre = wheel.world_from_body.position
        above = (centre - whole.world_from_body.position) @ up
        assert above == pytest.approx(scale[2] * place.radius)


@pytest.mark.parametrize("reversed_", [False, True])
def test_outer_faces_of_wheels_look_outwards(reversed_):
    """A wheel's outer face looks to its own +y; inner twins look the other way."""
    places = tuple(WheelPlace(place.at, 0.3, reversed=reversed_) for place in AXLES)
    assembly = Assembly("cube", (Unit(cube(), wheels=places),))
    whole = whole_at((1.0, 1.0, 1.0), yaw=0.0, pitch=0.0)
    _, *wheels = assembly.movers(whole, full=True)
    looks = [wheel.world_from_body.matrix[1, 1] for wheel in wheels]
    assert looks == ([-1.0, 1.0] if reversed_ else [1.0, -1.0])


def test_full_detail_needs_all_units():
    bare = Assembly("lorry", (Unit(cube("tractor"), wheels=AXLES), Unit(cube("trailer"), at=-3.0)))
    assert bare.drawn.full == ()
    both = (Unit(cube("tractor"), wheels=AXLES), Unit(cube("trailer"), at=-3.0, wheels=AXLES[:1]))
    full = Assembly("lorry", both)
    assert full.drawn.full == (
        *("tractor/full", "tractor/wheel", "tractor/wheel"),
        *("trailer/full", "trailer/wheel"),
    )
    names = [
        (mover.part, mover.prototype) for mover in full.movers(whole_at((1.0,) * 3), full=True)
    ]
    assert len({part for part, _ in names}) == len(names), "parts have names of their own"
    assert sorted(name for _, name in names) == sorted(full.drawn.full)


def test_a_changed_body_keeps_the_full_detail_of_its_model():
    unit = Unit(cube("sedan~1.10"), wheels=AXLES, model="sedan")
    assert (unit.source, unit.full, unit.wheel) == ("sedan", "sedan/full", "sedan/wheel")
    assert Assembly("sedan", (unit,)).drawn.near == ("sedan~1.10",)


def test_bodies_with_poses_are_told_apart():
    plain = cube("walker")
    still = np.zeros((3, 8, 3))
    walker = Prototype("walker", plain.parts, plain.far, poses=Poses(still, still))
    drawn = Assembly("walker", (Unit(walker),)).drawn
    assert (drawn.near, drawn.deforming, drawn.far) == ((), ("walker",), ("walker",))


def test_bodies_sway_and_their_wheels_do_not():
    assembly = Assembly("cube", (Unit(cube(), wheels=AXLES),))
    whole = whole_at((1.0, 1.0, 1.0))
    still = list(assembly.movers(whole, full=True))
    sway = Transform.from_pose((0.0, 0.0, 0.0), pitch=0.02).matrix[None]
    turned = np.array([[0.5, 0.2], [0.5, 0.0]])
    moved = list(assembly.movers(whole, full=True, stance=Stance(sway=sway, wheels=turned)))
    assert not np.allclose(moved[0].world_from_body.matrix, still[0].world_from_body.matrix)
    for before, after in zip(still[1:], moved[1:], strict=True):
        np.testing.assert_allclose(after.world_from_body.position, before.world_from_body.position)
        assert not np.allclose(after.world_from_body.matrix, before.world_from_body.matrix)
