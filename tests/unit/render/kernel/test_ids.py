"""Pictures say which moving part each pixel shows, and where it is in the network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from builders import RAW, box, cube, diffuse, frame_of, mover, scene_of, session_of, static, view_at

from sumo3dviz_pt.cast.lamps import running_lights
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import (
    FrameState,
    Mover,
    Poses,
    Prototype,
    SceneData,
    Slots,
    VehicleLamp,
)
from sumo3dviz_pt.render.session import Rendered

pytestmark = pytest.mark.usefixtures("compiled")

SIZE = (80, 45)
PLACE = np.array([1010.0, 2003.0, 0.0])  # far from the network's origin
LAYERS = ("radiance", "depth", "hit", "ids", "first_depth")
TINT = {"type": "principled", "base_color": {"type": "tint"}, "roughness": 0.5}
LENS = VehicleLamp("brake", (-1.0, -1.02, 1.0), (1.8, 1.8), -0.5 * np.pi)
RED = (0.5, 0.1, 0.1)
PARTS = {
    "vehicle:a/body": (-8.0, 0.0, 0.0),
    "vehicle:a/wheel0": (-4.0, 0.0, 0.0),
    "vehicle:b/body": (0.0, 0.0, 0.0),
    "person:c/body": (4.0, 0.0, 0.0),
}


def at(*offset: float) -> np.ndarray:
    """A place near the middle of what is shown."""
    return np.asarray(PLACE + offset)


def walker() -> Prototype:
    part = cube("walker", material="plain").parts[0]
    count, shape = len(part.mesh.vertices), (5, 1, 1)
    poses = Poses(np.tile(part.mesh.vertices, shape), np.tile([0.0, 0.0, 1.0], (5, count, 1)))
    return Prototype("walker", (part,), (part,), poses=poses)


def scene(*, lamps: bool = False) -> SceneData:
    """Room for a car, its wheel, a far car and somebody who walks; a box that stands."""
    car = replace(cube("car", material="plain"), lamps=(LENS,) if lamps else ())
    wheel = cube("wheel", material="plain", side=1.0)
    post = static("post", box(at(7, -1, 0), at(9, 1, 2)), "post")
    slots = Slots({"car": 2, "wheel": 1}, {"car": 2}, {"walker": 1})
    materials = {"plain": TINT, "post": diffuse(0.5), "signal_lens": MATERIALS["signal_lens"]}
    found = scene_of([post], materials, prototypes=[car, wheel, walker()], slots=slots)
    lights = running_lights([car], dark=True, left_hand=False) if lamps else None
    return replace(found, running=lights)


def placed(name: str, prototype: str, aside: float = 0.0) -> Mover:
    owner, part = name.split("/")
    found = mover(owner, at(*np.add(PARTS[name], (0, aside, 0))), RED, prototype=prototype)
    return replace(found, part="" if part == "body" else part)


def frame(*, without: Sequence[str] = (), aside: float = 0.0) -> FrameState:
    """Everyone, seen from above."""
    shown = [
        placed("vehicle:a/body", "car", aside),
        placed("vehicle:a/wheel0", "wheel", aside),
    ]
    near = [each for each in shown if each.name not in without]
    state = frame_of(
        view_at(at(0, -14, 14), pitch=-45, fov=70),
        movers=near,
        far=[placed("vehicle:b/body", "car", aside)],
    )
    return replace(state, deforming=(placed("person:c/body", "walker", aside),))


def traced(
    *frames: FrameState, lamps: bool = False, tracer: str = "kernel", **settings: object
) -> list[Rendered]:
    passes = {"spp": 8, "pass_spp": 4, "max_depth": 2, "tracer": tracer}
    quality = RAW.model_copy(update=passes)
    wanted = {"layers": LAYERS, **settings}
    with session_of(scene(lamps=lamps), size=SIZE, quality=quality, **wanted) as session:
        return [session.render(state) for state in frames]


def seen(layers: Layers, state: FrameState, point: np.ndarray) -> int:
    """The number of what the pixel of a place shows."""
    forward, left, up = (point - state.view.position) @ state.view.world_from_camera.matrix[:3, :3]
    scale = 0.5 * SIZE[0] / np.tan(np.radians(35.0))
    column, row = 0.5 * SIZE[0] - scale * left / forward, 0.5 * SIZE[1] - scale * up / forward
    return int(layers["ids"][int(row), int(column)])


@pytest.mark.slow
@pytest.mark.parametrize("lamps", [False, True])
def test_each_part_has_its_number_and_place(lamps: bool) -> None:
    state = frame()
    (found,) = traced(state, lamps=lamps)
    ids = found.layers["ids"]
    names = {part.name: k + 1 for k, part in enumerate(found.movers)}
    assert set(names) == set(PARTS)
    assert set(np.unique(ids)) == {0, 1, 2, 3, 4}
    for name, offset in PARTS.items():
        height = 0.5 if "wheel" in name else 1.0
        assert seen(found.layers, state, at(*np.add(offset, (-0.5, 0.0, height)))) == names[name]
        placement = found.movers[names[name] - 1].world_from_part
        if name.startswith("person"):
            assert placement is None
        else:
            assert placement is not None
            np.testing.assert_array_equal(placement.position, at(*offset))
    assert seen(found.layers, state, at(8.0, -0.9, 1.0)) == 0


@pytest.mark.slow
def test_a_lamp_that_shines_belongs_to_its_road_user() -> None:
    state = frame()
    car, wheel = state.movers
    shining = replace(state, movers=(replace(car, lit=frozenset({"brake"})), wheel))
    (found,) = traced(shining, lamps=True, layers=("emitted", "hit", "ids"))
    emitted = found.layers["emitted"].max(axis=-1)
    lens = (emitted > 0.5 * emitted.max()) & (found.layers["hit"] == 1.0)
    number = 1 + [part.name for part in found.movers].index("vehicle:a/body")
    assert lens.sum() > 3
    np.testing.assert_array_equal(found.layers["ids"][lens], number)


@pytest.mark.slow
def test_names_stay_where_numbers_change() -> None:
    first, second = traced(frame(), frame(without=["vehicle:a/body"], aside=0.5))
    for found, aside in ((first, 0.0), (second, 0.5)):
        k = [part.name for part in found.movers].index("vehicle:b/body")
        placement = found.movers[k].world_from_part
        assert placement is not None
        assert placement.position[1] == PLACE[1] + aside
        ids = found.layers["ids"]
        depth = found.layers["first_depth"][ids == k + 1]
        assert len(depth) > 10
        assert np.ptp(depth) < 4.0
    assert len(first.movers) == len(second.movers) + 1


@pytest.mark.slow
def test_depth_is_of_the_same_sample() -> None:
    """Means mix a body with what lies behind it at its edge; first samples do not."""
    state = frame()
    (found,) = traced(state)
    ids, depth, hit = (found.layers[name] for name in ("ids", "first_depth", "hit"))
    assert np.isfinite(depth).all()
    assert (depth[ids > 0] > 0.0).all()
    np.testing.assert_array_equal(depth[hit == 0.0], 0.0)
    edge = (hit > 0.0) & (hit < 1.0)
    assert (depth[edge] == 0.0).any()
    assert (depth[edge] > 10.0).any()


@pytest.mark.slow
def test_they_do_not_change_the_picture_and_are_the_same_in_a_film() -> None:
    with_ids, alone = traced(frame(aside=0.3), frame())
    (still,) = traced(frame())
    (plain,) = traced(frame(), layers=("radiance", "depth"))
    for name in ("ids", "first_depth", "radiance"):
        np.testing.assert_array_equal(alone.layers[name], still.layers[name])
    np.testing.assert_array_equal(still.radiance, plain.radiance)
    assert plain.movers == ()
    assert (with_ids.layers["ids"] != alone.layers["ids"]).any()


@pytest.mark.parametrize(("tracer", "variant"), [("path", "llvm"), ("kernel", "scalar")])
def test_others_refuse_them(tracer: str, variant: str) -> None:
    with pytest.raises(ConfigError, match="layer 'ids' cannot be traced"):
        traced(frame(), tracer=tracer, variant=variant)
