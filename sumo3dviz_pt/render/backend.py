"""Chooses Mitsuba's variant and finds libLLVM.

`llvm_ad_rgb` traces about six times faster per CPU-second than `scalar_rgb`, but
needs a shared libLLVM. Dr.Jit takes 15 and newer, but 15 aborts the process on CPUs
with AVX-512 ("Cannot select: fminimum", measured), so we ask for 16. Without one we
say so and fall back.
"""

from __future__ import annotations

import logging
import os
import platform
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, RenderError

log = logging.getLogger(__name__)

VARIANTS = {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb", "scalar": "scalar_rgb"}
"""Mitsuba's variants by the names that users choose."""

_OLDEST_LLVM = (16, 0, 0)
_LLVM_VARIABLE = "DRJIT_LIBLLVM_PATH"
_LLVM_PLACES = (
    "/opt/homebrew/opt/llvm/lib/libLLVM*.dylib",
    "/usr/local/opt/llvm/lib/libLLVM*.dylib",
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "C:/Program Files/LLVM/bin/LLVM-C.dll",
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
        ConfigError: If the name is unknown.
        RenderError: If a variant that was asked for by name cannot work here.
    """
    if name not in VARIANTS:
        raise ConfigError(
            f"no variant is called {name!r}{did_you_mean(name, VARIANTS)}", key="variant"
        )
    problem = _try_variant(VARIANTS[name])
    if problem is None:
        return Backend(name, VARIANTS[name], jit=name != "scalar")
    if name != "llvm":
        raise RenderError(f"the variant {VARIANTS[name]} does not work here: {problem}")
    note = f"rendering takes about six times longer than it need: {problem}; {llvm_advice()}"
    log.warning("%s", note)
    problem = _try_variant(VARIANTS["scalar"])
    if problem is not None:
        raise RenderError(f"the variant {VARIANTS['scalar']} does not work here: {problem}")
    return Backend("scalar", VARIANTS["scalar"], jit=False, note=note)


def _try_variant(variant: str) -> str | None:
    """Activate a variant; the problem in words, or None if it works."""
    if variant not in mi.variants():
        return "this build of Mitsuba does not have it"
    if variant.startswith("llvm"):
        _point_to_llvm()
    try:
        mi.set_variant(variant)
        mi.Float(0.0)
    except (ImportError, RuntimeError) as error:
        return str(error).splitlines()[0]
    mi.set_log_level(mi.LogLevel.Error)
    if variant.startswith("llvm") and dr.detail.llvm_version() < _OLDEST_LLVM:
        found = ".".join(map(str, dr.detail.llvm_version()))
        return f"libLLVM {found} is too old, {_OLDEST_LLVM[0]} is needed"
    return None


def _point_to_llvm() -> None:
    """Name libLLVM to Dr.Jit where its own search does not look.

    Programs that we start inherit the name: one that is too old would hide a newer one there.
    """
    if _LLVM_VARIABLE in os.environ:
        return
    for pattern in _LLVM_PLACES:
        anchor = Path(pattern).anchor
        there = Path(anchor).glob(str(Path(pattern).relative_to(anchor)))
        found = [path for path in there if _major(path) >= _OLDEST_LLVM[0]]
        newest = max(found, key=_numbers, default=None)
        if newest is not None:
            os.environ[_LLVM_VARIABLE] = str(newest)
            return


def _numbers(path: Path) -> list[int]:
    """All numbers in a path, so that 19 comes after 9."""
    return [int(number) for number in re.findall(r"\d+", str(path))]


def _major(path: Path) -> int:
    """LLVM's version by a path such as llvm-19/lib/libLLVM.so.1; the oldest one if it has none."""
    versions = re.findall(r"LLVM(?:-|\.so\.)(\d+)", str(path), re.I)
    return max(map(int, versions), default=_OLDEST_LLVM[0])


def llvm_advice() -> str:
    """The one command that installs libLLVM on this system."""
    commands: dict[str, Callable[[], str]] = {
        "linux": _linux_command,
        "darwin": lambda: "brew install llvm",
        "win32": lambda: "winget install LLVM.LLVM",
    }
    command = commands.get(sys.platform, lambda: "install LLVM 16 or newer")()
    return f"install it with: {command}"


def _linux_command() -> str:
    """The package manager's command, by what /etc/os-release says."""
    try:
        family = platform.freedesktop_os_release()
    except OSError:
        family = {}
    likeness = f"{family.get('ID', '')} {family.get('ID_LIKE', '')}"
    if "fedora" in likeness or "rhel" in likeness:
        return "sudo dnf install llvm-libs"
    if "arch" in likeness:
        return "sudo pacman -S llvm-libs"
    return "sudo apt-get install libllvm19 (or another version from 16 up)"


def llvm_description() -> str:
    """Which libLLVM the active variant uses."""
    if not mi.variant().startswith("llvm"):
        return f"not in use; {llvm_advice()}"
    return ".".join(map(str, dr.detail.llvm_version()))
