"""SUMO's own programs, where they are installed."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path


def program(name: str) -> str | None:
    """Return the path of one of SUMO's programs, or None where it is not installed."""
    found = importlib.util.find_spec("sumo")
    if found is not None and found.origin is not None:
        own = Path(found.origin).parent / "bin" / name
        if own.exists():
            return str(own)
    return shutil.which(name)


def why_missing() -> str:
    """Return why SUMO cannot be run here; empty where it can."""
    missing = [name for name in ("netgenerate", "netconvert", "sumo") if program(name) is None]
    wanted = "pip install -c constraints.txt eclipse-sumo"
    return f"SUMO's {', '.join(missing)} is missing: {wanted}" if missing else ""


def call(name: str, words: Sequence[str], *, folder: Path) -> None:
    """Run one of SUMO's programs.

    Args:
        name: Of the program.
        words: Its options.
        folder: Where it runs; names of files refer to it.

    Raises:
        AssertionError: If it fails; the text holds what it said.
    """
    done = subprocess.run(
        [program(name) or name, *words], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{name} {' '.join(words)}\n{done.stdout[-500:]}\n{done.stderr}"
