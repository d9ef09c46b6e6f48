"""Finds the libLLVM that Dr.Jit shall load, and reads its version before Dr.Jit does.

Dr.Jit takes 15 and newer, but 15 ends the process at the first kernel ("LLVM ERROR: Cannot
select: fminimum", measured with AVX-512 and with AVX2 only), so 16 is needed. A library tells
its version by `LLVMGetVersion`, which exists from 16 on. It is called in a process of its own,
because a second libLLVM disturbs the one in use. File names only say which library to try first.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt.installation.dependencies import MENDING

OLDEST = 16
"""The oldest major version that compiles our kernels."""

VARIABLE = "DRJIT_LIBLLVM_PATH"
"""Environment variable by which users, and we, name the file to Dr.Jit."""

_FOLDERS = (
    f"{sys.prefix}/lib",  # conda
    f"{sys.prefix}/Library/bin",  # conda on Windows
    f"{sys.base_prefix}/lib",
    "/opt/homebrew/opt/llvm*/lib",
    "/usr/local/opt/llvm*/lib",
    "/usr/local/lib",
    "/usr/lib/llvm-*/lib",  # Debian
    "/usr/lib/*-linux-gnu",
    "/usr/lib64",  # Fedora
    "/usr/lib64/llvm*/lib*",
    "/usr/lib",  # Arch
    "C:/Program Files/LLVM/bin",
)
_SEARCH_PATHS = {"linux": "LD_LIBRARY_PATH", "darwin": "DYLD_LIBRARY_PATH", "win32": "PATH"}
_LOADERS_OWN = {"linux": "libLLVM.so", "darwin": "libLLVM.dylib", "win32": "LLVM-C.dll"}
_NAME = re.compile(r"libLLVM([-.]\d[\d.]*)?\.(so|dylib)[.\d]*|LLVM-C\.dll")
_ASK = """
import ctypes, sys
library = ctypes.CDLL(sys.argv[1])
numbers = [ctypes.c_uint() for _ in range(3)]
if hasattr(library, "LLVMGetVersion"):
    library.LLVMGetVersion(*map(ctypes.byref, numbers))
print(*(number.value for number in numbers), sep=".")
"""


@dataclass(frozen=True, slots=True)
class Library:
    """A libLLVM.

    Attributes:
        path: Its file, or a name that the system's loader finds.
        version: Such as `19.1.7`; empty if it cannot be used.
        problem: Why it cannot be used, and what to do; empty if it can.
    """

    path: str
    version: str
    problem: str = ""


def find_llvm() -> Library:
    """Return the newest libLLVM that can be used, or what stands in the way.

    What `DRJIT_LIBLLVM_PATH` names is taken or refused, never replaced.
    """
    chosen = os.environ.get(VARIABLE)
    if chosen:
        found = _examined(chosen)
        advice = f"let {VARIABLE} name version {OLDEST} or newer, or unset it"
        problem = found.problem and f"{VARIABLE} names {found.problem}; {advice}"
        return Library(chosen, found.version, problem)
    problems = []
    for path in _candidates():
        found = _examined(path)
        if not found.problem:
            return found
        problems.append(found.problem)
    newest = f"the newest libLLVM is {problems[0]}" if problems else "there is no libLLVM"
    return Library("", "", f"{newest}; install one with: {MENDING}")


def _candidates() -> Iterator[str]:
    """Yield files that may be libLLVM: the newest by name first, last what the loader finds."""
    found = {
        path.resolve()
        for folder in _folders()
        for path in folder.glob("*LLVM*")
        if _NAME.fullmatch(path.name)
    }
    yield from map(str, sorted(found, key=_version_by_name, reverse=True))
    own = _LOADERS_OWN.get(sys.platform, "")
    if own and not _asked(own)[1]:
        yield own


def _folders() -> Iterator[Path]:
    """Yield the folders in which libLLVM may lie, the user's search path among them."""
    searched = os.environ.get(_SEARCH_PATHS.get(sys.platform, ""), "").split(os.pathsep)
    yield from (Path(name) for name in searched if name)
    for pattern in _FOLDERS:
        anchor = Path(pattern).anchor
        if anchor:
            yield from Path(anchor).glob(str(Path(pattern).relative_to(anchor)))


def _version_by_name(path: Path) -> tuple[int, str]:
    """Return the largest number after `llvm` in a path, such as llvm@18/ or libLLVM.so.19.1."""
    numbers = re.findall(r"llvm\D{0,4}(\d+)", str(path), re.IGNORECASE)
    return max(map(int, numbers), default=0), str(path)


def _examined(path: str) -> Library:
    """Return a libLLVM with its version, or with what is wrong with it."""
    version, problem = _asked(path)
    if problem:
        return Library(path, "", f"{path}, which cannot be loaded ({problem})")
    if int(version.split(".")[0]) < OLDEST:
        return Library(path, "", f"{path}, which is older than version {OLDEST}")
    return Library(path, version)


def _asked(path: str) -> tuple[str, str]:
    """Return the version that a library tells, `0.0.0` before 16, and why it tells none."""
    command = [sys.executable, "-I", "-S", "-c", _ASK, path]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return "", str(error)
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return "", said[-1].removeprefix("OSError: ")
    return done.stdout.strip(), ""
