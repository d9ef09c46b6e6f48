"""Keeps kernels as they are, so that each is compiled once: in a film, and on a machine.

Dr.Jit keeps compiled kernels on disk and finds them by their code. That code depends on more
than the scene: on the order in which objects were numbered, on where arrays begin in memory,
on which numbers are constants, and on what the sensors hold from the picture before. This
module makes all four the same every time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import DTypeLike, NDArray

from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.render.integrator import Integrator

_REGISTER = 64  # bytes of the widest vector register

Tracer = Callable[[Any, Integrator, Any, int, int], Layers]
"""Traces a pass: (scene, integrator, sensor, samples, seed) to the integrator's layers."""


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
    size = values.size * np.dtype(kind).itemsize
    room = np.empty(size + _REGISTER, np.uint8)
    begin = -room.ctypes.data % _REGISTER
    flat = room[begin : begin + size].view(kind)
    flat[:] = values.ravel()
    return flat


def tracer(*, recorded: bool) -> Tracer:
    """Return a function that traces passes.

    Args:
        recorded: Whether it is traced by Dr.Jit once and then replayed, as films want it:
            every sensor it is given must be settled first.
    """
    jit = "scalar" not in mi.variant()
    trace = dr.freeze(_trace) if recorded and jit else _trace

    def traced(scene: Any, integrator: Integrator, sensor: Any, spp: int, seed: int) -> Layers:
        own = seed % 2**32
        # As a constant it would be part of the code, and each frame would compile a kernel.
        number = dr.opaque(mi.UInt32, own) if jit else own
        image = np.array(trace(scene, integrator.plugin, sensor, spp, number), dtype=np.float32)
        settle(sensor)
        return integrator.channels.layers(image)

    return traced


def settle(sensor: Any) -> None:
    """Clear what a sensor holds of a picture; recordings need it to be the same every time."""
    if "scalar" not in mi.variant():
        sensor.film().prepare([])
        sensor.sampler().seed(0, 1)


def _trace(scene: Any, integrator: Any, sensor: Any, spp: int, seed: Any) -> Any:
    """Trace one pass; as a frozen function it replays the same kernels with new data."""
    return mi.render(scene, integrator=integrator, sensor=sensor, spp=spp, seed=seed)
