"""What pixels' centres show, and where all of that is in the next frame."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import numpy as np
import pytest
from builders import RAW, box, cube, diffuse, frame_of, joined, scene_of, session_of, static

from sumo3dviz_pt.image.layers import flow_of
from sumo3dviz_pt.model.geometry import Mesh, Transform, belonging
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import (
    FrameState,
    Mover,
    Part,
    Poses,
    Prototype,
    SceneData,
    Slots,
    View,
)
from sumo3dviz_pt.render.kernel.integrator import RAYS
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.session import PixelFacts, carried, points_of

pytestmark = pytest.mark.usefixtures("compiled")

SIZE = (160, 90)
PLACE = np.array([1010.0, 2003.0, 0.0])
TINT = {"type": "principled", "base_color": {"type": "tint"}, "roughness": 0.5}
NEARLY = 2e-4
"""Single precision leaves less than this [m]."""

GREY = (0.5, 0.5, 0.5)
GROWTH = np.array([1.0, 1.0, 1.3, 1.6, 1.3])
"""How tall the walker is in each pose, against how it stands."""

HUB = np.array([-1.2, -1.5, 0.5])
"""Where a wheel's axle is, from the middle of the front of the car that it belongs to [m]."""

ROLL = 0.6
"""How far it turns from one frame to the next [rad]."""

POSTS = {"post:left": (-12, 6, 3.0), "post:right": (10, 7, 4.0)}
"""Boxes of one mesh: where they stand, and how tall they are."""


def at(x: float, y: float, z: float = 0.0) -> np.ndarray:
    """A place near the middle of what is shown."""
    return PLACE + np.array([x, y, z])


def walker() -> Prototype:
    part = cube("walker", material="plain").parts[0]
    vertices = np.stack([part.mesh.vertices * [1.0, 1.0, tall] for tall in GROWTH])
    up = np.broadcast_to([0.0, 0.0, 1.0], vertices.shape)
    return Prototype("walker", (part,), (part,), poses=Poses(vertices, up))


def wheel() -> Prototype:
    part = Part(box((-0.5, -0.15, -0.5), (0.5, 0.15, 0.5)), "plain")
    return Prototype("wheel", (part,), (part,))


def wheel_pose(moved: float) -> np.ndarray:
    """The axle, and what the wheel's own axes have become, as columns of (3, 4)."""
    yaw, roll = 0.4 + 0.2 * moved, 0.3 + ROLL * moved
    along = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    turned = np.array(
        [[np.cos(roll), 0, np.sin(roll)], [0, 1, 0], [-np.sin(roll), 0, np.cos(roll)]]
    )
    axle = at(-5, 0) + moved * np.array([0.7, 0.3, 0.1]) + along @ HUB
    return np.column_stack([along @ turned, axle])


def posts() -> Mesh:
    meshes = []
    for name, (x, y, tall) in POSTS.items():
        low = at(x, y)
        meshes.append(belonging(box(low, low + np.array([1.5, 1.5, tall])), name))
    return joined(*meshes)


def scene() -> SceneData:
    ground = Mesh(*_ground(), things=(("terrain", 2),))
    parts = [static("ground", ground, "post"), static("posts", posts(), "post")]
    slots = Slots({"car": 1, "wheel": 1}, {"car": 1}, {"walker": 1})
    bodies = [cube("car", material="plain"), walker(), wheel()]
    return scene_of(parts, {"plain": TINT, "post": diffuse(0.5)}, prototypes=bodies, slots=slots)


def _ground() -> tuple[np.ndarray, np.ndarray]:
    corners = [at(x, y) for x, y in ((-40, -40), (40, -40), (40, 40), (-40, 40))]
    return np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])


def frame(moved: float = 0.0) -> FrameState:
    """Two cars, one of them far, and somebody who walks; all of it moves, and the camera, too.

    The near car has a wheel, which turns.
    """

    def one(name: str, body: str, place: tuple[float, float], **more: float) -> Mover:
        spot = at(*place) + moved * np.array([0.7, 0.3, 0.1])
        placed = Transform.from_pose(spot, yaw=0.4 + 0.2 * moved, scale=(1.2, 0.9, 1.1))
        return Mover(name, body, placed, GREY, **more)

    eye = at(0.0, -14.0, 9.0) + moved * np.array([0.2, 0.5, 0.1])
    turned = Transform.from_pose(eye, yaw=np.radians(90 + 2 * moved), pitch=np.radians(-28))
    rolling = Transform(np.vstack([wheel_pose(moved), [0.0, 0.0, 0.0, 1.0]]))
    state = frame_of(
        View(turned, Lens.of_degrees(70)),
        movers=[
            one("vehicle:a", "car", (-5, 0)),
            Mover("vehicle:a", "wheel", rolling, GREY, part="wheel0"),
        ],
        far=[one("vehicle:b", "car", (1, 3))],
    )
    phase = (0.25 + 0.25 * moved) % 1.0
    return replace(state, deforming=(one("person:c", "walker", (5, 0), phase=phase, effort=1.0),))


def shown(*states: FrameState) -> tuple[LoadedScene, PixelFacts]:
    """The scene as it was loaded, and what the last frame shows."""
    quality = RAW.model_copy(update={"spp": 1, "pass_spp": 1, "max_depth": 2})
    with session_of(scene(), size=SIZE, quality=quality) as session:
        for state in states:
            session.samples(state)
        return session.loaded, session.facts(set(RAYS))


def pixels(facts: PixelFacts, name: str) -> np.ndarray:
    assert facts.owner is not None
    return facts.owner == facts.names.index(name)


def in_body(mover: Mover, points: np.ndarray) -> np.ndarray:
    inverse = Transform(np.linalg.inv(mover.world_from_body.matrix))
    return inverse.points(points)


def test_merged_things_have_their_own_names_and_places() -> None:
    state = frame()
    _, facts = shown(state)
    points = points_of(facts, state, SIZE)
    for name, (x, y, tall) in POSTS.items():
        own = points[pixels(facts, name)] - PLACE - np.array([x, y, 0.0])
        assert len(own) > 20
        assert (own > -NEARLY).all()
        assert (own < np.array([1.5, 1.5, tall]) + NEARLY).all()
    height = points[pixels(facts, "terrain")][:, 2]
    np.testing.assert_allclose(height, 0.0, atol=1e-4)
    for mover in state.everyone:
        assert pixels(facts, mover.name).sum() > 20


def test_depth_is_exact_at_the_centres_of_pixels() -> None:
    state = frame()
    _, facts = shown(state)
    points = points_of(facts, state, SIZE)
    low, high = np.array([-2.0, -1.0, 0.0]), np.array([0.0, 1.0, 2.0])
    for mover, tall in (
        (state.movers[0], 1.0),
        (state.far[0], 1.0),
        (state.deforming[0], GROWTH[2]),
    ):
        own = in_body(mover, points[pixels(facts, mover.name)]) / [1.0, 1.0, tall]
        beside = np.minimum(np.abs(own - low), np.abs(own - high)).min(axis=1)
        assert beside.max() < NEARLY
    sky = facts.layers["depth"] == 0.0
    assert sky.any()
    assert (facts.owner[sky] == 0).all()
    assert facts.names[0] == ""


@pytest.mark.parametrize("name", ["vehicle:a/body", "vehicle:b/body", "person:c/body", "post:left"])
def test_flow_ends_where_the_same_place_is_in_the_next_picture(name: str) -> None:
    before, after = frame(), frame(1.0)
    loaded, facts = shown(before)
    points = points_of(facts, before, SIZE)
    places, known = carried(facts, loaded, (before, after), points)
    sky = facts.layers["depth"] == 0.0
    flow, ahead = flow_of(places, before.view.directions(SIZE), sky, view=after.view)
    here = pixels(facts, name)
    assert (known & ahead)[here].all()
    # The same place on the body, by hand.
    own = points[here]
    movers = {mover.name: mover for mover in before.everyone}
    if name in movers:
        then = next(mover for mover in after.everyone if mover.name == name)
        taller = GROWTH[3] / GROWTH[2] if name.startswith("person") else 1.0
        own = then.world_from_body.points(in_body(movers[name], own) * [1.0, 1.0, taller])
    local = (own - after.view.position) @ after.view.world_from_camera.matrix[:3, :3]
    (row, column), _ = after.view.lens.project(local, SIZE)
    rows, columns = np.nonzero(here)
    wanted = np.stack([column - columns, row - rows], axis=-1)
    assert np.abs(wanted).max() > 1.0
    assert np.abs(flow[here] - wanted).max() < 0.02


def test_flow_of_a_wheel_follows_its_turn() -> None:
    before, after = frame(), frame(1.0)
    loaded, facts = shown(before)
    points = points_of(facts, before, SIZE)
    places, _ = carried(facts, loaded, (before, after), points)
    sky = facts.layers["depth"] == 0.0
    flow, _ = flow_of(places, before.view.directions(SIZE), sky, view=after.view)
    here = pixels(facts, "vehicle:a/wheel0")
    assert here.sum() > 20
    ((axes, axle), (axes_then, axle_then)) = (
        (pose[:, :3], pose[:, 3]) for pose in (wheel_pose(0.0), wheel_pose(1.0))
    )
    own = (points[here] - axle) @ axes  # on the wheel
    assert (np.abs(own) < np.array([0.5, 0.15, 0.5]) + NEARLY).all()

    def wanted(then: np.ndarray) -> np.ndarray:
        local = (then - after.view.position) @ after.view.world_from_camera.matrix[:3, :3]
        (row, column), _ = after.view.lens.project(local, SIZE)
        return np.stack([column, row], axis=-1) - np.argwhere(here)[:, ::-1]

    assert np.abs(flow[here] - wanted(own @ axes_then.T + axle_then)).max() < 0.02
    # As the car moves alone, without the turn, would be elsewhere.
    yaw = np.array([[np.cos(0.2), -np.sin(0.2), 0], [np.sin(0.2), np.cos(0.2), 0], [0, 0, 1]])
    slid = (points[here] - axle) @ yaw.T + axle_then
    assert np.abs(flow[here] - wanted(slid)).max() > 0.5


def test_the_sky_moves_with_the_camera_alone() -> None:
    before, after = frame(), frame(1.0)
    loaded, facts = shown(before)
    points = points_of(facts, before, SIZE)
    places, _ = carried(facts, loaded, (before, after), points)
    sky = facts.layers["depth"] == 0.0
    flow, _ = flow_of(places, before.view.directions(SIZE), sky, view=after.view)
    far = before.view.position + 1e9 * before.view.directions(SIZE)[sky]
    local = (far - after.view.position) @ after.view.world_from_camera.matrix[:3, :3]
    (row, column), _ = after.view.lens.project(local, SIZE)
    wanted = np.stack([column, row], axis=-1) - np.argwhere(sky)[:, ::-1]
    np.testing.assert_allclose(flow[sky], wanted, atol=1e-3)


def test_who_is_gone_in_the_next_frame_has_no_flow() -> None:
    before, after = frame(), replace(frame(1.0), movers=())
    loaded, facts = shown(before)
    points = points_of(facts, before, SIZE)
    _, known = carried(facts, loaded, (before, after), points)
    gone = pixels(facts, "vehicle:a/body") | pixels(facts, "vehicle:a/wheel0")
    np.testing.assert_array_equal(~known, gone)


@pytest.mark.slow
def test_facts_do_not_depend_on_what_was_shown_before() -> None:
    _, alone = shown(frame(1.0))
    _, later = shown(frame(), frame(1.0))
    for name, values in alone.layers.items():
        if name != "instance":  # Mitsuba's own numbers
            np.testing.assert_array_equal(values, later.layers[name])
    assert alone.owner is not None and later.owner is not None
    names = np.array(alone.names)[alone.owner], np.array(later.names)[later.owner]
    np.testing.assert_array_equal(*names)


def operations(wanted: set[str] | None) -> list[int]:
    """Operations of all kernels of a later frame, where some facts are asked for."""
    quality = RAW.model_copy(update={"spp": 1, "pass_spp": 1, "max_depth": 2})
    with session_of(scene(), size=(16, 9), quality=quality) as session:
        session.samples(frame())
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            session.samples(frame())
            if wanted is not None:
                session.facts(wanted)
            history = dr.kernel_history([dr.KernelType.JIT])
    return sorted(entry["operation_count"] for entry in history)


@pytest.mark.slow
def test_only_what_is_asked_for_is_compiled() -> None:
    plain = operations(None)
    depth, owners, everything = (
        operations(wanted) for wanted in ({"depth"}, {"depth", "face", "instance"}, {*RAYS})
    )
    assert depth[-1] == plain[-1]  # the picture's own kernel is the same
    assert sum(plain) < sum(depth) < sum(owners) < sum(everything)
