"""What this package stands on: pip's packages, libLLVM, NVIDIA's driver, processors.

It says why one of pip's packages does not work, and how many threads this program may use. NVIDIA's
driver, and OptiX, which comes with it, are found by their own libraries.

The libLLVM that Dr.Jit shall load is found, and its version read, before Dr.Jit loads it. Dr.Jit
takes 15 and newer, but 15 ends the process at the first kernel ("LLVM ERROR: Cannot select:
fminimum", measured with AVX-512 and with AVX2 only), so 16 is needed. A library tells its version
by `LLVMGetVersion`, which exists from 16 on. It is called in a process of its own, because a second
libLLVM disturbs the one in use. File names only say which library to try first.
"""

from __future__ import annotations

import ctypes
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sumo3dviz_pt.errors import InstallationError

MENDING = "sumo3dviz-pt doctor --install"
"""The command that brings shared libraries, for messages."""

_MISSING_LIBRARY = re.compile(r"(lib[\w.+-]+?\.so[\w.]*|[\w.+-]+\.dylib)\b")


@dataclass(frozen=True, slots=True)
class Dependency:
    """A package of pip's.

    Attributes:
        package: What pip calls it.
        module: What Python calls it.
    """

    package: str
    module: str


DEPENDENCIES = (
    Dependency("mitsuba", "mitsuba"),
    Dependency("drjit", "drjit"),
    Dependency("mitsuba-oidn", "mitsuba_oidn"),
    Dependency("numpy", "numpy"),
    Dependency("scipy", "scipy"),
    Dependency("trimesh", "trimesh"),
    Dependency("shapely", "shapely"),
    Dependency("mapbox-earcut", "mapbox_earcut"),
    Dependency("OpenEXR", "OpenEXR"),
    Dependency("colour-science", "colour"),
    Dependency("platformdirs", "platformdirs"),
    Dependency("pyyaml", "yaml"),
    Dependency("pydantic", "pydantic"),
    Dependency("imageio-ffmpeg", "imageio_ffmpeg"),
    Dependency("pillow", "PIL"),
    Dependency("tqdm", "tqdm"),
    Dependency("tzfpy", "tzfpy"),
    Dependency("tzdata", "tzdata"),
)
"""All packages that any command may need; what only an extra brings is not among them."""


def version_of(package: str) -> str:
    """Return the installed version, or `missing`; a checkout that is not installed is `source`."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "source" if package == "sumo3dviz_pt" else "missing"


def require_packages() -> None:
    """Refuse to begin work that a missing package would end; nothing is loaded.

    Raises:
        InstallationError: If one is not installed.
    """
    missing = [known.package for known in DEPENDENCIES if find_spec(known.module) is None]
    if missing:
        raise InstallationError(
            f"not installed: {', '.join(missing)}; install with: {_pip_command(missing)}"
        )


def load(*modules: str) -> None:
    """Load packages before work begins that would end without them.

    Raises:
        InstallationError: If one cannot be loaded.
    """
    for module in modules:
        try:
            import_module(module)
        except (ImportError, RuntimeError) as error:
            raise InstallationError(explained(package_of(module), error)) from error


def package_of(module: str | None) -> str:
    """Return what pip calls the package of a module."""
    name = (module or "a package").split(".")[0]
    known = {dependency.module: dependency.package for dependency in DEPENDENCIES}
    return known.get(name, name)


def _pip_command(packages: list[str]) -> str:
    """Return what installs packages beside this one, in the versions that it takes."""
    try:
        ranges = metadata.requires("sumo3dviz_pt") or []
    except metadata.PackageNotFoundError:
        ranges = []
    wanted = {re.split(r"[^\w.-]", text)[0].lower(): text for text in reversed(ranges)}
    texts = [f'"{wanted.get(package.lower(), package)}"' for package in packages]
    return " ".join([_quoted(sys.executable), "-m pip install", *texts])


def _quoted(path: str) -> str:
    """Return a path as a shell takes it."""
    return f'"{path}"' if " " in path else path


def explained(package: str, error: BaseException) -> str:
    """Return why a package cannot be loaded, and the one command that mends it.

    Args:
        package: What pip calls it.
        error: What its import raised. Dr.Jit hides the reason behind a NameError.
    """
    first = [error, *_import_errors(error)][-1]
    reason = next(iter(str(first).splitlines()), type(first).__name__)
    library = missing_library(error)
    if library:
        return f"{package} cannot be loaded: {library} is missing; install it with: {MENDING}"
    again = f"{_quoted(sys.executable)} -m pip install --force-reinstall {package}"
    return f"{package} cannot be loaded: {reason}; install it anew with: {again}"


def missing_library(error: BaseException) -> str:
    """Return the shared library that is missing by an error, such as `libatomic.so.1`, or ''."""
    for cause in _import_errors(error):
        match = _MISSING_LIBRARY.search(str(cause))
        if match and ("cannot open shared object" in str(cause) or "not loaded" in str(cause)):
            return match.group(1)
    return ""


def _import_errors(error: BaseException | None) -> Iterator[ImportError]:
    """Yield the failed imports behind an error, the first cause last."""
    while error is not None:
        if isinstance(error, ImportError):
            yield error
        error = error.__cause__ or error.__context__


THREADS = "SUMO3DVIZ_PT_THREADS"
"""Environment variable with the number of threads to use; workers of a farm set it."""


def threads_asked() -> int | None:
    """Return the threads that the environment asks for; None where it asks for none."""
    value = os.environ.get(THREADS, "")
    return int(value) if value.isdecimal() and 0 < int(value) <= 4096 else None


def threads() -> int:
    """Return the threads that this process may use."""
    wanted = threads_asked()
    if wanted is not None:
        return wanted
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


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
        library = _examined(chosen)
        advice = f"let {VARIABLE} name version {OLDEST} or newer, or unset it"
        problem = library.problem and f"{VARIABLE} names {library.problem}; {advice}"
        return Library(chosen, library.version, problem)
    problems = []
    for path in _candidates():
        library = _examined(path)
        if not library.problem:
            return library
        problems.append(library.problem)
    newest = f"the newest libLLVM is {problems[0]}" if problems else "there is no libLLVM"
    return Library("", "", f"{newest}; install one with: {MENDING}")


def _candidates() -> Iterator[str]:
    """Yield files that may be libLLVM: the newest by name first, last what the loader finds."""
    paths = {
        path.resolve()
        for folder in _folders()
        for path in folder.glob("*LLVM*")
        if _NAME.fullmatch(path.name)
    }
    yield from map(str, sorted(paths, key=_version_by_name, reverse=True))
    own = _LOADERS_OWN.get(sys.platform, "")
    if own and not _version_of(own)[1]:
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
    version, problem = _version_of(path)
    if problem:
        return Library(path, "", f"{path}, which cannot be loaded ({problem})")
    if int(version.split(".")[0]) < OLDEST:
        return Library(path, "", f"{path}, which is older than version {OLDEST}")
    return Library(path, version)


def _version_of(path: str) -> tuple[str, str]:
    """Return the version that a library tells, `0.0.0` before 16, and why it tells none."""
    command = [sys.executable, "-I", "-S", "-c", _ASK, path]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return "", str(error)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return "", lines[-1].removeprefix("OSError: ")
    return done.stdout.strip(), ""


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
        memory: Of that GPU [bytes]; 0 where the driver does not say.
        optix: Whether rays can be traced; True on Windows, where only using it tells.
        problem: Why the variant `cuda` cannot work, and what to do; empty if it may.
    """

    cuda: str = ""
    device: str = ""
    memory: int = 0
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
    room = ctypes.c_size_t(0)
    memory = 0 if cuda.cuDeviceTotalMem_v2(ctypes.byref(room), 0) else room.value
    if _WINDOWS:
        return Driver(known, device, memory, optix=True)
    try:
        load(_OPTIX)
    except OSError:
        missing = (
            f"the NVIDIA driver has no OptiX ({_OPTIX} is not here): install all of the driver; a"
            " container needs NVIDIA_DRIVER_CAPABILITIES=all"
        )
        return Driver(known, device, memory, problem=missing)
    return Driver(known, device, memory, optix=True)


def _number(ask: Callable[[Any], int]) -> int:
    """Return the number that a function of the driver writes; 0 where it fails."""
    number = ctypes.c_int(0)
    return 0 if ask(ctypes.byref(number)) else number.value
