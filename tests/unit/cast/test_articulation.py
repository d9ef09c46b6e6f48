"""Vehicles of several units: straight as ever, bent with their pivots on the path."""

from __future__ import annotations

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.axles import unit_frames
from sumo3dviz_pt.cast.bodies import Body, build_body
from sumo3dviz_pt.cast.choice import Model, ModelChoice, choose, models_for
from sumo3dviz_pt.cast.drawing import Stance
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.scene import Mover
from sumo3dviz_pt.model.traffic import VehicleType

BENDING = ("articulated_bus", "semitrailer_truck", "tanker_truck", "tram", "passenger_train")
TIGHT = {"tram": 25.0, "passenger_train": 150.0}
NOW = np.array([9.0])


def body_of(name: str, *, length: float | None = None) -> Body:
    """A vehicle of the catalogue, stretched to a length."""
    model = Model.of(catalog.find("vehicles", name))
    size = model.size if length is None else (length, *model.size[1:])
    return build_body(ModelChoice(model, sorted(model.vclasses)[0], size), {})


@pytest.fixture(scope="module")
def bodies() -> dict[str, Body]:
    return {name: body_of(name) for name in BENDING}


def whole_of(body: Body, frame) -> Mover:
    matrix = frame @ np.diag([*body.scale, 1.0])
    return Mover("vehicle:a", body.prototype.name, Transform(matrix), (0.5, 0.1, 0.1))


@pytest.mark.parametrize("name", BENDING)
@pytest.mark.parametrize("grade", [0.0, 0.08])
def test_on_a_straight_road_units_stand_as_one_body(name, grade, bodies):
    body = bodies[name]
    piece = PathPiece(grade=grade, yaw=0.7)
    motion = piece.sample(NOW)
    frame = Transform.from_pose(
        motion.positions[0], yaw=motion.yaws[0], pitch=motion.pitches[0]
    ).matrix
    whole = whole_of(body, frame)
    units = unit_frames(piece, NOW, body.assembly.links(body.scale))[0]
    bent = list(body.assembly.movers(whole, stance=Stance(units)))
    stiff = list(body.assembly.movers(whole))
    assert [(m.prototype, m.part) for m in bent] == [(m.prototype, m.part) for m in stiff]
    for a, b in zip(bent, stiff, strict=True):
        np.testing.assert_allclose(
            a.world_from_body.matrix, b.world_from_body.matrix, atol=0.02 if grade else 2e-3
        )


@pytest.mark.parametrize("name", BENDING)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_every_pivot_lies_on_the_circle(name, side, bodies):
    body = bodies[name]
    radius = TIGHT.get(name, 12.0)
    piece = PathPiece(curvature=side / radius, start=900.0)
    links = body.assembly.links(body.scale)
    (frames,) = unit_frames(piece, NOW, links)
    centre = np.array([0.0, side * radius, 0.0])
    for frame, pivots in zip(frames, links.pivots, strict=True):
        for pivot in pivots:
            point = frame @ [-pivot, 0.0, 0.0, 1.0]
            off = np.hypot(*(point[:2] - centre[:2])) - radius
            # Modules of trams turn to their hinges; those of others are exact.
            assert abs(off) < (0.06 if links.hinged else 0.004), (name, pivot)


@pytest.mark.parametrize(
    ("name", "joint"), [("articulated_bus", 10.9), ("semitrailer_truck", 4.55)]
)
def test_units_share_their_joint_wherever_they_are(name, joint, bodies):
    body = bodies[name]
    piece = PathPiece(curvature=1 / 10.0, speed=5.0, start=-10.0)
    times = np.linspace(0.0, 10.0, 41)
    frames = unit_frames(piece, times, body.assembly.links(body.scale))
    first, second = body.assembly.units
    assert first.pivots is not None and second.pivots is not None
    ahead = frames[:, 0] @ [-first.pivots[1] * body.scale[0], 0.0, 0.0, 1.0]
    behind = frames[:, 1] @ [-second.pivots[0] * body.scale[0], 0.0, 0.0, 1.0]
    np.testing.assert_allclose(ahead, behind, atol=5e-3)
    assert first.pivots[1] == joint


def test_modules_of_a_tram_meet_at_hinges_before_and_in_a_bend(bodies):
    body = bodies["tram"]
    links = body.assembly.links(body.scale)
    piece = PathPiece(curvature=-1 / 25.0, speed=5.0, start=-20.0)
    times = np.linspace(0.0, 15.0, 31)
    frames = unit_frames(piece, times, links)
    for unit in range(len(links.starts) - 1):
        rear = frames[:, unit] @ [-links.lengths[unit], 0.0, 0.0, 1.0]
        front = frames[:, unit + 1] @ [0.0, 0.0, 0.0, 1.0]
        assert np.linalg.norm(rear - front, axis=1).max() < 0.12
        bogie = links.pivots[unit].mean()
        point = (frames[:, unit] @ [-bogie, 0.0, 0.0, 1.0])[:, :3]
        # On the rails, to what the hinges take where the bend begins without a transition.
        path = piece.point(np.linspace(-60.0, 80.0, 5001))
        off = [np.linalg.norm(path - each, axis=1).min() for each in point]
        assert max(off) < 0.2


@pytest.mark.parametrize("name", ["articulated_bus", "tram", "passenger_train"])
def test_bellows_reach_from_face_to_face(name, bodies):
    body = bodies[name]
    radius = TIGHT.get(name, 10.0)
    piece = PathPiece(curvature=1 / radius, start=900.0)
    links = body.assembly.links(body.scale)
    (frames,) = unit_frames(piece, NOW, links)
    whole = whole_of(body, frames[0])
    drawn = {m.part: m for m in body.assembly.movers(whole, stance=Stance(frames))}
    joints = [(k, unit.joint) for k, unit in enumerate(body.assembly.units) if unit.joint]
    assert joints
    for k, joint in joints:
        mover = drawn[f"joint{k}"]
        poses = joint.prototype.poses
        place = mover.phase * (len(poses.vertices) - 1)
        shape = poses.vertices[1 + round(place)]
        world = mover.world_from_body.points(shape)
        rings = len(shape) // 12
        ends = world.reshape(rings, 12, 3)[[0, -1]].mean(axis=1)
        height = (joint.prototype.parts[0].mesh.bounds[:, 2]).mean() * body.scale[2]
        face = frames[k] @ [-joint.ahead * body.scale[0], 0.0, height, 1.0]
        next_face = frames[k + 1] @ [-joint.behind * body.scale[0], 0.0, height, 1.0]
        np.testing.assert_allclose(ends[0], face[:3], atol=0.02)
        np.testing.assert_allclose(ends[1], next_face[:3], atol=0.05)
        assert mover.effort == 1.0


def test_a_train_bends_up_a_crest(bodies):
    class Crest(PathPiece):
        def point(self, ways):
            points = super().point(ways)
            points[..., 2] = 0.03 * np.minimum(np.asarray(ways), 0.0)
            return points

    body = bodies["passenger_train"]
    piece = Crest(speed=10.0, start=-60.0)
    (frames,) = unit_frames(piece, NOW, body.assembly.links(body.scale))
    pitches = np.arcsin(frames[:, 2, 0])
    assert pitches[0] == pytest.approx(0.0, abs=1e-6)
    assert pitches[-1] == pytest.approx(np.arctan(0.03), abs=1e-3)


PARAMS = {"locomotiveLength": "18", "carriageLength": "25", "carriageGap": "1"}


def train(length: float, **params: str) -> VehicleType:
    return VehicleType("t", "rail", length, 2.84, 3.75, params=params)


@pytest.mark.parametrize(
    ("length", "params", "count"),
    [
        (18.0 + 3 * 26.0, PARAMS, 4),
        (18.0 + 6 * 26.0 + 4.0, PARAMS, 7),
        (75.0, {"carriageLength": "24.5"}, 3),
        (16.0, PARAMS, 1),
    ],
)
def test_trains_have_the_carriages_that_their_type_says(length, params, count):
    choice = choose(train(length, **params), name="a", models=models_for({}), own={}, seed=0)
    assert isinstance(choice, ModelChoice) and choice.carriages is not None
    body = build_body(choice, {})
    links = body.assembly.links(body.scale)
    assert len(links.starts) == count
    assert links.starts[-1] + links.lengths[-1] == pytest.approx(length)
    if count > 1:
        assert links.lengths[0] == pytest.approx(float(params.get("locomotiveLength", 24.5)))
        gaps = links.starts[1:] - (links.starts + links.lengths)[:-1]
        np.testing.assert_allclose(gaps, 1.0, atol=1e-9)


def test_without_parameters_trains_are_as_they_were():
    choice = choose(train(98.0), name="a", models=models_for({}), own={}, seed=0)
    assert isinstance(choice, ModelChoice) and choice.carriages is None


def test_ships_stay_stiff():
    assert not body_of("cargo_ship").assembly.bends
