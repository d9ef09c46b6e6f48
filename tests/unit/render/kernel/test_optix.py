"""What OptiX tells of hits, given on the CPU; and guards against what it does not say."""

from __future__ import annotations

import os
from dataclasses import replace

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

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.scene import Part, Slots
from sumo3dviz_pt.render.backend import (
    answers,
    check_movers,
    check_scenes,
    traces_by_optix,
    watched,
)
from sumo3dviz_pt.render.kernel.air import Solids

import drjit as dr  # isort: skip  (after what chooses its libLLVM)
import mitsuba as mi  # isort: skip

pytestmark = pytest.mark.usefixtures("compiled")

LAYERS = ("radiance", "depth", "albedo", "normal", "ids", "first_depth")
DISABLED = b"more than one OptiX pipeline was used ... Disabling this ray tracing operation to ..."


def town():
    """A road, a wall, and two kinds of bodies, each of three materials."""
    stands = [static("road", plane(40.0), "grey"), static("wall", box((2, -1, 0), (3, 5, 2)), "b")]
    materials = {**MATERIALS, "grey": diffuse(0.4), "matt_tint": diffuse(0.5)}
    materials |= {"a": diffuse(0.8), "b": diffuse(0.1)}
    bodies = []
    for name, side in (("car", 2.0), ("bus", 3.0)):
        whole = cube(name, side=side)
        roof = Part(box((-side, -1, side), (0, 1, side + 0.5)), "a")
        sill = Part(box((-side, -side / 2 - 0.1, 0), (0, -side / 2, 0.5)), "b")
        bodies.append(replace(whole, parts=(*whole.parts, roof, sill)))
    return scene_of(stands, materials, prototypes=bodies, slots=Slots(near={"car": 2, "bus": 2}))


def frames():
    cars = [
        mover("c", (4.5, 1.0, 0.0), (0.5, 0.1, 0.1), prototype="car"),
        mover("d", (-2.5, -1.0, 0.0), (0.1, 0.5, 0.1), prototype="car", yaw=0.7),
        mover("e", (-1.5, 3.0, 0.0), (0.1, 0.1, 0.5), prototype="bus"),
    ]
    for shown in (cars[:1], cars, cars[1:]):
        yield frame_of(view_at((-9, 0, 3), pitch=-12, heading=90.0), movers=shown)


def pictures(session) -> list[dict[str, np.ndarray]]:
    return [dict(session.render(frame).layers) for frame in frames()]


def number(shape) -> int:
    """Mitsuba's number of a shape."""
    return int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])


def as_optix(loaded, nearest):
    """Tell hits of instances as OptiX does: the part's own shape, and no index."""
    pool, known = loaded.pool, {}

    def tables():
        if not known:
            numbers = {shape.id(): number(shape) for shape in loaded.shapes()}
            flat, first = [], {}
            for body, shapes in pool.parts.items():
                first[body] = len(flat)
                flat += [number(shape) for shape in shapes]
            base = np.zeros(max(numbers.values()) + 1, np.uint32)
            for slot, body in pool.body_of_slot.items():
                base[numbers[slot]] = first[body]
            known.update(base=mi.UInt32(base), flat=mi.UInt32(np.array(flat, np.uint32)))
        return known["base"], known["flat"]

    def told(self, ray, coherent, active=True):
        hit = nearest(self, ray, coherent, active)
        base, flat = tables()
        instance = dr.reinterpret_array(mi.UInt32, hit.instance)
        there = hit.is_valid() & (instance != 0)
        place = dr.gather(mi.UInt32, base, instance, there) + hit.shape_index
        own = dr.reinterpret_array(mi.UInt32, hit.shape)
        shape = dr.select(there, dr.gather(mi.UInt32, flat, place, there), own)
        hit.shape, hit.shape_index = dr.reinterpret_array(mi.ShapePtr, shape), mi.UInt32(0)
        return hit

    return told


@pytest.mark.slow
def test_hits_told_as_optix_does_give_the_same_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of bodies have materials of their own, so a part that is mistaken is seen."""
    how = {"size": (64, 48), "quality": RAW, "layers": LAYERS}
    with session_of(town(), **how) as session:
        session.loaded.apart = False
        plain = pictures(session)
    with session_of(town(), **how) as session:
        session.loaded.apart, session.loaded.by_shape = False, True
        monkeypatch.setattr(Solids, "nearest", as_optix(session.loaded, Solids.nearest))
        told = pictures(session)
    assert [len(np.unique(one["ids"])) for one in plain] == [2, 4, 3]
    for one, other in zip(plain, told, strict=True):
        for name in LAYERS:
            np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def test_cuda_is_asked_about_one_scene() -> None:
    assert traces_by_optix("cuda_ad_rgb") and not traces_by_optix("llvm_ad_rgb")
    check_scenes("cuda_ad_rgb", 1)
    check_scenes("llvm_ad_rgb", 2)
    with pytest.raises(RenderError, match="cuda_ad_rgb traces one scene in a kernel, not 2"):
        check_scenes("cuda_ad_rgb", 2)


def test_a_kernel_of_two_scenes_is_refused_by_the_variants_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mi, "variant", lambda: "cuda_ad_rgb")
    Solids(object())
    with pytest.raises(RenderError, match="one scene"):
        Solids(object(), object())


def test_rays_that_are_taken_out_of_a_kernel_are_an_error(capfd) -> None:
    with watched("cuda_ad_rgb"):
        os.write(2, b"compiling\n")
    assert capfd.readouterr().err == "compiling\n"
    with pytest.raises(RenderError, match="the picture would be false"), watched("cuda_ad_rgb"):
        os.write(2, DISABLED)
    assert capfd.readouterr().err.encode() == DISABLED
    with pytest.raises(KeyError), watched("cuda_ad_rgb"):
        raise KeyError
    with watched("llvm_ad_rgb"):
        os.write(2, DISABLED)


def test_a_triangle_is_seen_and_what_is_beside_it_not() -> None:
    assert answers()


def test_a_picture_without_the_road_users_in_view_is_an_error() -> None:
    nobody = np.zeros((48, 64))
    hidden, shown, _ = frames()
    with session_of(town(), size=(64, 48), quality=RAW, layers=LAYERS) as session:
        session.loaded.apart = False
        behind = frame_of(
            view_at((-9, 0, 3), pitch=-12, heading=90.0),
            movers=[mover("c", (60.0, 1.0, -20.0), (0.5, 0.1, 0.1), prototype="car")],
        )
        for frame in (hidden, shown):
            ids = session.render(frame).layers["ids"]
            check_movers(session.loaded.scene, frame, ids, variant="cuda_ad_rgb")
            with pytest.raises(RenderError, match=r"drew no road user at .* pixels show some"):
                check_movers(session.loaded.scene, frame, nobody, variant="cuda_ad_rgb")
        session.render(behind)
        check_movers(session.loaded.scene, behind, nobody, variant="cuda_ad_rgb")
