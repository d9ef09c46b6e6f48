"""Chooses Mitsuba's variant.

`llvm_ad_rgb` traces about six times faster per CPU-second than `scalar_rgb`, but
needs a shared libLLVM. Without one that can be used we say so and fall back.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.installation import libllvm
from sumo3dviz_pt.installation.nvidia import find_driver
from sumo3dviz_pt.installation.processors import threads_asked
from sumo3dviz_pt.job.variants import VARIANTS as VARIANTS
from sumo3dviz_pt.job.variants import check_variant
from sumo3dviz_pt.render.loading import LIBRARY
from sumo3dviz_pt.render.optix import answers, watched

log = logging.getLogger(__name__)

_LOADED_BEFORE = (
    f"Dr.Jit was imported before sumo3dviz_pt and took no libLLVM of version {libllvm.OLDEST}"
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
    if variant.startswith("llvm") and dr.detail.llvm_version()[0] < libllvm.OLDEST:
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
