"""What is otherwise on GPUs, where OptiX traces rays, and guards against its silent failures.

A kernel may ask one scene only: Dr.Jit takes the ray operations of a second one out, says so on
standard error and goes on. Hits of instances name the part's own shape, and no index in its group.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.files.quiet import overheard
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.render.kernels import aligned

_DISABLED = b"Disabling this ray tracing operation"
"""What Dr.Jit says of rays that it does not trace."""

_SURE = 16
"""So many pixels of road users are no accident [px]."""


def traces_by_optix(variant: str) -> bool:
    """Return whether OptiX traces the rays of one of Mitsuba's variants."""
    return variant.startswith("cuda")


def check_scenes(variant: str, scenes: int) -> None:
    """Refuse to build a kernel that asks more scenes than a variant allows.

    Raises:
        RenderError: If rays of one would not be traced.
    """
    if scenes > 1 and traces_by_optix(variant):
        raise RenderError(f"{variant} traces one scene in a kernel, not {scenes}")


@contextmanager
def watched(variant: str) -> Iterator[None]:
    """Make an error of it where Dr.Jit takes rays out of a kernel; elsewhere nothing is watched.

    What anybody says on standard error meanwhile is passed on at the end.

    Raises:
        RenderError: If rays were not traced.
    """
    if not traces_by_optix(variant):
        yield
        return
    said: list[bytes] = []
    with overheard(said):
        yield
    if _DISABLED in b"".join(said):
        raise RenderError(f"{variant} did not trace all rays: the picture would be false")


def answers() -> bool:
    """Return whether the active variant sees one triangle with one ray, and not with another."""
    triangle = mi.Mesh("question", 3, 1)
    parameters = mi.traverse(triangle)
    parameters["vertex_positions"] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    scene = mi.load_dict({"type": "scene", "one": triangle}, optimize=False)
    start = mi.Point3f(mi.Float([0.0, 5.0]), 0.0, 1.0)
    ray = mi.Ray3f(start, mi.Vector3f(0.0, 0.0, -1.0))
    met, hidden = scene.ray_intersect_preliminary(ray).is_valid(), scene.ray_test(ray)
    return [*met] == [*hidden] == [True, False]


def check_movers(scene: Any, frame: FrameState, ids: Image, *, variant: str) -> None:
    """Refuse a picture without road users where Mitsuba itself sees some.

    Args:
        scene: Mitsuba's, which shows the frame.
        frame: The picture's.
        ids: Numbers of what moves, (h, w); 0 for all that stands.
        variant: Of Mitsuba, for the message.

    Raises:
        RenderError: If they are not there.
    """
    if ids.any() or not frame.instanced or not frame.view.lens.has_one_centre:
        return
    height, width = ids.shape
    start = mi.Point3f(*map(float, frame.view.position - frame.origin))
    towards = frame.view.directions((width, height)).reshape(-1, 3)
    direction = mi.Vector3f(*(mi.Float(aligned(one, np.float32)) for one in towards.T))
    hit = scene.ray_intersect_preliminary(mi.Ray3f(start, direction), coherent=True)
    moves = hit.is_valid() & (dr.reinterpret_array(mi.UInt32, hit.instance) != 0)
    pixels = int(np.count_nonzero(np.array(moves)))
    if pixels >= _SURE:
        raise RenderError(
            f"{variant} drew no road user at {frame.time:.12g} s, where {pixels} pixels show some:"
            " the picture would be false; take the variant llvm"
        )
