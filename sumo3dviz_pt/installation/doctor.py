"""Looks at an installation and says what is missing and how to get it.

It loads nothing that may be missing: rendering is tried out in another process, whose crash does
no harm.
"""

from __future__ import annotations

import json
import os
import platform
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from pathlib import Path

from sumo3dviz_pt.errors import Sumo3dvizError
from sumo3dviz_pt.installation import dependencies
from sumo3dviz_pt.installation.dependencies import (
    DEPENDENCIES,
    Driver,
    explained,
    find_driver,
    missing_library,
    version_of,
)
from sumo3dviz_pt.installation.packages import LIBRARIES, LLVM

_TRY = """
import sys
sys.path.insert(0, sys.argv[1])
from sumo3dviz_pt.installation import doctor
print(doctor.tried_out().as_json(), flush=True)
"""
_USEFUL = ("sse4_2", "avx", "avx2", "fma", "f16c", "avx512f", "avx512vl", "asimd", "sve")
"""Vector units that kernels use, as Linux calls them."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What is installed here, and what is missing.

    Attributes:
        healthy: Whether films can be rendered and encoded.
        gpu: Whether the variant `cuda` may work.
        lines: What there is, each with its name in front.
        lacks: Shared libraries that a package manager may bring, by the keys of its packages.
    """

    healthy: bool
    gpu: bool
    lines: tuple[str, ...]
    lacks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LoadingTrial:
    """How trying out the renderer went.

    Attributes:
        variant: Mitsuba's name of the variant that works; empty if none does.
        note: Why it is not the fast one; empty if it is.
        problems: A sentence for each package that cannot be loaded, or for what else went wrong.
        missing: Shared libraries that are not there, such as `libatomic.so.1`.
    """

    variant: str = ""
    note: str = ""
    problems: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()

    def as_json(self) -> str:
        """Return it in one line, for another process."""
        return json.dumps(asdict(self))


def examine() -> Diagnosis:
    """Look at the installation."""
    trial = _tried_in_another_process()
    llvm = dependencies.find_llvm()
    driver = find_driver()
    encodes, about_ffmpeg = _ffmpeg()
    packages = ("sumo3dviz_pt", *(known.package for known in DEPENDENCIES))
    about = {
        "Python": f"{platform.python_version()} on {platform.platform()}",
        **{package: version_of(package) for package in packages},
        "processor": processor(),
        "CPU threads": str(os.cpu_count()),
        "memory": f"{physical_memory() / 2**30:.1f} GiB" if physical_memory() else "unknown",
        "renderer": trial.variant or "does not work",
        "libLLVM": _about_llvm(llvm, trial),
        "CUDA, OptiX": _about_gpu(driver),
        "ffmpeg": about_ffmpeg,
        "bodies kept in": _bodies_folder(),
        "kernels kept in": _writable(_kernels_folder()),
    }
    return Diagnosis(
        healthy=bool(trial.variant) and encodes and not trial.problems,
        gpu=not driver.problem,
        lines=tuple(f"{name:<15} {text}" for name, text in [*about.items(), *_remarks(trial)]),
        lacks=tuple(_lacks(trial, llvm)),
    )


def _about_llvm(llvm: dependencies.Library, trial: LoadingTrial) -> str:
    """Return version and file, or why there is none; a note on the renderer says that already."""
    if llvm.version:
        return f"{llvm.version} ({llvm.path})"
    return "not in use" if trial.note else llvm.problem


def _about_gpu(driver: Driver) -> str:
    """Return what the variant `cuda` would use, or why it cannot work."""
    if driver.problem:
        return f"not in use: {driver.problem}"
    memory = f" ({driver.memory / 2**30:.0f} GiB)" if driver.memory else ""
    return f"CUDA {driver.cuda} and OptiX on {driver.device}{memory}; for `--variant cuda`"


def _remarks(trial: LoadingTrial) -> list[tuple[str, str]]:
    """Return what is wrong, and what could be better."""
    wrong = [("problem", problem) for problem in trial.problems]
    return [*wrong, ("note", trial.note)] if trial.note else wrong


def _lacks(trial: LoadingTrial, llvm: dependencies.Library) -> Iterator[str]:
    """Yield libraries that a package manager may bring; none that the user's own choice hides."""
    yield from (LIBRARIES[name] for name in trial.missing if name in LIBRARIES)
    if llvm.problem and not os.environ.get(dependencies.VARIABLE):
        yield LLVM


def tried_out() -> LoadingTrial:
    """Load every package and render a little, in this process."""
    trial = _loaded_all()
    if trial.problems:
        return trial
    try:
        from sumo3dviz_pt.render.backend import try_out

        backend = try_out()
    except Sumo3dvizError as error:
        return LoadingTrial(problems=(str(error),))
    return replace(trial, variant=backend.variant, note=backend.note)


def _loaded_all() -> LoadingTrial:
    """Load every package; what went wrong."""
    problems: dict[str, str] = {}
    for known in DEPENDENCIES:
        # Our own stage loads Mitsuba and Dr.Jit, because it chooses their libLLVM.
        ours = known.module in ("mitsuba", "drjit")
        try:
            import_module("sumo3dviz_pt.render" if ours else known.module)
        except Exception as error:  # noqa: BLE001 (a broken package may raise anything)
            clear = isinstance(error, Sumo3dvizError)
            sentence = str(error) if clear else explained(known.package, error)
            problems[sentence] = missing_library(error)
    # Where a library is missing, other packages fail with misleading reasons.
    first = {words: library for words, library in problems.items() if library} or problems
    return LoadingTrial(
        problems=tuple(first), missing=tuple(filter(None, dict.fromkeys(first.values())))
    )


def _tried_in_another_process() -> LoadingTrial:
    """Try rendering out in another process, with this very package; a crash there does no harm."""
    place = str(Path(__file__).resolve().parents[2])
    command = [sys.executable, "-P", "-c", _TRY, place]
    try:
        done = subprocess.run(
            command, capture_output=True, encoding="utf-8", errors="replace", check=False
        )
    except OSError as error:
        return LoadingTrial(problems=(f"no other process could be started: {error}",))
    if done.returncode == 0:
        trial = json.loads(done.stdout.splitlines()[-1])
        problems, missing = tuple(trial["problems"]), tuple(trial["missing"])
        return LoadingTrial(trial["variant"], trial["note"], problems, missing)
    lines = done.stderr.strip().splitlines() or ["nothing was said"]
    return LoadingTrial(problems=(f"a trial ended with {_ending(done.returncode)}: {lines[-1]}",))


def _ending(code: int) -> str:
    """Return an exit code, or the name of the signal that ended a process."""
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"exit code {code}"


def processor() -> str:
    """Return the processor's name, and which of its vector units kernels use."""
    facts = _processor_facts()
    if not facts:
        return processor_name()
    flags = set(f"{facts.get('flags', '')} {facts.get('Features', '')}".split())
    units = " ".join(name for name in _USEFUL if name in flags)
    return f"{processor_name()} ({units})"


def processor_name() -> str:
    """Return the processor's name, or its kind where the system does not tell the name."""
    named = _processor_facts().get("model name")
    return named or platform.processor() or platform.machine()


def _processor_facts() -> dict[str, str]:
    """Read what Linux tells about the processor; other systems have nothing to read."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    return dict(re.findall(r"^(model name|flags|Features)\s*: (.*)$", text, re.MULTILINE))


def physical_memory() -> int:
    """Return the physical memory [bytes], or 0 where the system does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 0


def _ffmpeg() -> tuple[bool, str]:
    """Return whether films can be encoded, and by what."""
    try:
        import imageio_ffmpeg

        return True, str(imageio_ffmpeg.get_ffmpeg_version())
    except (ImportError, RuntimeError, OSError) as error:
        return False, f"does not work: {error}"


def _bodies_folder() -> str:
    """Return where our own cache lies."""
    try:
        from sumo3dviz_pt.catalog import cache_root
    except ImportError as error:
        return f"unknown: {error}"
    return _writable(cache_root())


def _kernels_folder() -> Path:
    """Return where Dr.Jit keeps compiled kernels."""
    chosen = os.environ.get("DRJIT_CACHE_DIR")
    usual = Path(tempfile.gettempdir(), "drjit") if os.name == "nt" else Path("~/.drjit")
    return Path(chosen) if chosen else usual.expanduser()


def _writable(folder: Path) -> str:
    """Return a cache's place, and whether something can be kept there."""
    whole = folder.absolute()
    there = next(place for place in (whole, *whole.parents) if place.exists())
    try:
        with tempfile.TemporaryFile(dir=there):
            return str(folder)
    except OSError as error:
        return f"{folder}, which cannot be written ({error.strerror}): built anew every time"
