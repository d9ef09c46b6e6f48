"""Chooses Mitsuba's variant, and guards against what is different on GPUs.

`llvm_ad_rgb` traces about six times faster per CPU-second than `scalar_rgb`, but
needs a shared libLLVM. Without one that can be used we say so and fall back.

On GPUs OptiX traces rays, and may fail silently. A kernel may ask one scene only: Dr.Jit takes the
ray operations of a second one out, says so on standard error and goes on. Hits of instances name
the part's own shape, and no index in its group.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.files.quiet import overheard
from sumo3dviz_pt.installation import dependencies
from sumo3dviz_pt.installation.dependencies import find_driver, threads_asked
from sumo3dviz_pt.job.values import VARIANTS as VARIANTS
from sumo3dviz_pt.job.values import check_variant
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.loading import LIBRARY

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
    heard: list[bytes] = []
    with overheard(heard):
        yield
    if _DISABLED in b"".join(heard):
        raise RenderError(f"{variant} did not trace all rays: the picture would be false")


def worked() -> float:
    """Return the reading of a meter of work [s]: all CPUs', or the clock where a GPU traces.

    No CPU-seconds count what a GPU does.
    """
    by_gpu = traces_by_optix(mi.variant() or "")
    return time.perf_counter() if by_gpu else time.process_time()


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


log = logging.getLogger(__name__)

_LOADED_BEFORE = (
    f"Dr.Jit was imported before sumo3dviz_pt and took no libLLVM of version {dependencies.OLDEST}"
    " or newer; import sumo3dviz_pt.render first"
)


@dataclass(frozen=True, slots=True)
class Backend:
    """A working variant.

    Attributes:
        name: What the user calls it: `llvm`, `cuda` or `scalar`.
        variant: Mitsuba's name.
        jit: Whether frames are compiled by Dr.Jit.
        note: Why it is not the one that was asked for; empty if it is.
    """

    name: str
    variant: str
    jit: bool
    note: str = ""


def choose_backend(name: str = "llvm") -> Backend:
    """Activate a variant, falling back from `llvm` to `scalar` with a warning.

    Raises:
        ConfigError: If the name is unknown, or there is no GPU for it.
        RenderError: If a variant that was asked for by name cannot work here.
    """
    check_variant(name)
    if name == "cuda":
        _check_driver()
    problem = _try_variant(VARIANTS[name])
    if problem is None and name == "cuda":
        problem = _question_unanswered(VARIANTS[name])
    if problem is None:
        return Backend(name, VARIANTS[name], jit=name != "scalar")
    if name != "llvm":
        raise RenderError(f"the variant {VARIANTS[name]} does not work here: {problem}")
    note = f"rendering takes three to nine times as long as it need: {problem}"
    log.warning("%s", note)
    problem = _try_variant(VARIANTS["scalar"])
    if problem is not None:
        raise RenderError(f"the variant {VARIANTS['scalar']} does not work here: {problem}")
    return Backend("scalar", VARIANTS["scalar"], jit=False, note=note)


def _check_driver() -> None:
    """Refuse CUDA where there is no driver, GPU or OptiX; Dr.Jit would say so in its own words."""
    problem = find_driver().problem
    if problem:
        raise ConfigError(problem, key="variant")


def _question_unanswered(variant: str) -> str | None:
    """Ask the active variant about one triangle; return what is wrong with the answer, or None."""
    try:
        with watched(variant):
            return None if answers() else "it does not see a single triangle; update the driver"
    except (RuntimeError, RenderError) as error:
        return str(error).splitlines()[0]


def _try_variant(variant: str) -> str | None:
    """Activate a variant; return the problem in words, or None if it works."""
    if variant not in mi.variants():
        return "this build of Mitsuba does not have it"
    if variant.startswith("llvm") and dr.detail.llvm_version()[0] < dependencies.OLDEST:
        return LIBRARY.problem or _LOADED_BEFORE
    try:
        mi.set_variant(variant)
        mi.Float(0.0)
    except (ImportError, RuntimeError) as error:
        return str(error).splitlines()[0]
    mi.set_log_level(mi.LogLevel.Error)
    threads = threads_asked()
    if threads is not None:
        dr.set_thread_count(threads)
    return None


def llvm_description() -> str:
    """Return the version of the libLLVM that the active variant uses."""
    if not mi.variant().startswith("llvm"):
        return "not in use"
    return ".".join(map(str, dr.detail.llvm_version()))


def try_out() -> Backend:
    """Choose the backend that works here, and compile and run a kernel, which may end the process.

    Raises:
        RenderError: If no variant works.
    """
    backend = choose_backend()
    if backend.jit:
        dr.eval(dr.minimum(dr.arange(mi.Float, 3), 1.0))
        dr.sync_thread()
    return backend
