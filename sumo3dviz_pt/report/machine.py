"""What a measurement needs beyond the package itself, and what it was made with.

What is missing is said before any work begins. Beside a measurement stand the machine, the versions
and the memory that it was made with.
"""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from sumo3dviz_pt.errors import MissingExtraError
from sumo3dviz_pt.installation.doctor import processor_name
from sumo3dviz_pt.pipeline.provenance import versions

_NEEDED = {"flip_evaluator": "flip-evaluator", "matplotlib": "matplotlib"}


def check_extra(*modules: str) -> None:
    """Refuse to start work whose results could not be measured or drawn.

    Args:
        modules: Those that the work needs; none means all of the extra.

    Raises:
        MissingExtraError: If a package of the extra `report` is missing.
    """
    needed = {module: _NEEDED[module] for module in modules or _NEEDED}
    missing = [package for module, package in needed.items() if find_spec(module) is None]
    if missing:
        raise MissingExtraError(f"reports need {' and '.join(missing)}", extra="report")


def machine() -> dict[str, str | int]:
    """Return the processor, threads and versions, by the names of the report's columns."""
    known = versions()
    return {
        "git": git_commit(),
        "mitsuba": known["mitsuba"],
        "drjit": known["drjit"],
        "oidn": known["mitsuba-oidn"],
        "cpu": processor_name(),
        "threads": os.cpu_count() or 1,
    }


def git_commit() -> str:
    """Return the short hash of the checkout this runs from, or the package's version."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return versions()["sumo3dviz_pt"]
    try:
        answer = subprocess.run(
            ["git", "-C", str(root), "rev-parse", "--short", "HEAD"],
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return versions()["sumo3dviz_pt"]
    return answer.stdout.strip()


def peak_memory() -> float:
    """Return the peak resident memory of this process [MiB]; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0.0
    scale = 2**20 if sys.platform == "darwin" else 2**10
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / scale)
