"""Keeps kernels as they are, so that each is compiled once: in a film, and on a machine.

Dr.Jit keeps compiled kernels on disk and finds them by their code. That code depends on more
than the scene: on the order in which objects were numbered, on where arrays begin in memory,
on which numbers are constants, and on what the sensors hold from the picture before. This
module makes all four the same every time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import DTypeLike, NDArray

from sumo3dviz_pt.model.layers import Channels, Layers


@dataclass(frozen=True, slots=True, eq=False)
class Integrator:
    """What traces a picture.

    Attributes:
        plugin: Mitsuba's object.
        channels: Where the layers lie in the pictures that it traces.
    """

    plugin: Any
    channels: Channels


_REGISTER = 64  # bytes of the widest vector register


def load(entry: Mapping[str, Any], *, optimize: bool = True) -> Any:
    """Make what a plugin's dict describes; objects are numbered in its order.

    Mitsuba would make them side by side and number them as threads finish, and kernels
    hold these numbers.

    Args:
        entry: The dict.
        optimize: Whether Mitsuba may merge meshes, which then lose their names.
    """
    return mi.load_dict(dict(entry), parallel=False, optimize=optimize)


def aligned(values: NDArray[Any], kind: DTypeLike) -> NDArray[Any]:
    """Return a flat copy that is aligned to vector registers.

    Dr.Jit reads NumPy's memory in place. From arrays that are not aligned, as is the case for
    some of NumPy's, it gathers numbers one by one, which is another kernel.

    Args:
        values: Of any shape.
        kind: Of the copy's numbers.
    """
    flat = aligned_zeros((values.size,), kind)
    flat[:] = values.ravel()
    return flat


def aligned_zeros(shape: tuple[int, ...], kind: DTypeLike) -> NDArray[Any]:
    """Return zeros of a shape that are aligned so, to be filled and then read in place."""
    size = math.prod(shape) * np.dtype(kind).itemsize
    room = np.zeros(size + _REGISTER, np.uint8)
    begin = -room.ctypes.data % _REGISTER
    return room[begin : begin + size].view(kind).reshape(shape)


def in_place(values: NDArray[Any], kind: DTypeLike) -> NDArray[Any]:
    """Return numbers flat and aligned: the same ones if they already are, else a copy.

    Args:
        values: Of any shape.
        kind: Of the numbers that are returned.
    """
    fits = values.dtype == kind and values.flags.c_contiguous
    return values.ravel() if fits and values.ctypes.data % _REGISTER == 0 else aligned(values, kind)


def traced(scene: Any, integrator: Integrator, sensor: Any, spp: int, seed: int) -> Layers:
    """Trace one pass by an integrator of Mitsuba; return its layers."""
    own = seed % 2**32
    # As a constant it would be part of the code, and each frame would compile a kernel.
    number = own if "scalar" in mi.variant() else dr.opaque(mi.UInt32, own)
    image = mi.render(scene, integrator=integrator.plugin, sensor=sensor, spp=spp, seed=number)
    values = np.array(image, dtype=np.float32)
    settle(sensor)
    return integrator.channels.layers(values)


def settle(sensor: Any) -> None:
    """Clear what a sensor holds of a picture, which would change the code of the next one."""
    if "scalar" not in mi.variant():
        sensor.film().prepare([])
        sensor.sampler().seed(0, 1)


def free_buffers() -> None:
    """Give memory back that Dr.Jit holds for arrays to come.

    It never does so by itself: what loading took stays beside what tracing takes.
    """
    if "scalar" not in mi.variant():
        dr.flush_malloc_cache()
