"""Finds NVIDIA's driver and OptiX, which comes with it, by their own libraries."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

_WINDOWS = sys.platform == "win32"
_CUDA = "nvcuda.dll" if _WINDOWS else "libcuda.so.1"
_OPTIX = "libnvoptix.so.1"
_INSTEAD = "leave out `--variant cuda`, or install NVIDIA's driver"


@dataclass(frozen=True, slots=True)
class Driver:
    """What there is to render on a GPU.

    Attributes:
        cuda: Newest version of CUDA that the driver knows, such as `12.4`; empty without a driver.
        device: Name of the first GPU; empty without one.
        optix: Whether rays can be traced; True on Windows, where only using it tells.
        problem: Why the variant `cuda` cannot work, and what to do; empty if it may.
    """

    cuda: str = ""
    device: str = ""
    optix: bool = False
    problem: str = ""


def find_driver(load: Callable[[str], Any] = ctypes.CDLL) -> Driver:
    """Return the driver, or what stands in the way.

    Args:
        load: Loads a shared library by its name, or raises OSError.
    """
    try:
        cuda = load(_CUDA)
    except OSError:
        return Driver(problem=f"there is no NVIDIA driver ({_CUDA} is not here); {_INSTEAD}")
    version = _number(cuda.cuDriverGetVersion)
    known = f"{version // 1000}.{version % 1000 // 10}"
    error = cuda.cuInit(0)
    if error or not _number(cuda.cuDeviceGetCount):
        why = f"CUDA error {error}" if error else "it counts none"
        return Driver(known, problem=f"the NVIDIA driver finds no GPU ({why}); {_INSTEAD}")
    name = ctypes.create_string_buffer(100)
    cuda.cuDeviceGetName(name, len(name), 0)
    device = name.value.decode("utf-8", errors="replace")
    if _WINDOWS:
        return Driver(known, device, optix=True)
    try:
        load(_OPTIX)
    except OSError:
        missing = (
            f"the NVIDIA driver has no OptiX ({_OPTIX} is not here): install all of the driver; a"
            " container needs NVIDIA_DRIVER_CAPABILITIES=all"
        )
        return Driver(known, device, problem=missing)
    return Driver(known, device, optix=True)


def _number(ask: Callable[[Any], int]) -> int:
    """Return the number that a function of the driver writes; 0 where it fails."""
    found = ctypes.c_int(0)
    return 0 if ask(ctypes.byref(found)) else found.value
