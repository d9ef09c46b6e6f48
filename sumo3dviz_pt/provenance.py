"""What pixels depend on: hashes of inputs and versions of what renders them."""

from __future__ import annotations

import hashlib
from importlib import metadata
from pathlib import Path

from sumo3dviz_pt.model.scenario import ScenarioFiles


def input_hashes(files: ScenarioFiles) -> dict[str, str]:
    """SHA-256 of every input by file name."""
    paths = (
        files.network,
        *files.trajectories,
        *files.signals,
        *files.additional,
        *files.vehicle_types,
    )
    return {path.name: _hash(path) for path in sorted(set(paths))}


def _hash(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def versions() -> dict[str, str]:
    """Versions of what pixels depend on."""
    names = ("sumo3dviz_pt", "mitsuba", "drjit", "mitsuba-oidn", "numpy")
    known = {}
    for name in names:
        try:
            known[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            known[name] = "source"
    return known
