"""Run by `.ci/run` against the wheel: is everything inside that the repository holds?

Imports the installed package; exits with 1 and says what is missing.
"""

from __future__ import annotations

import sys
from pathlib import Path

import sumo3dviz_pt
from sumo3dviz_pt import catalog

REPOSITORY = Path(__file__).resolve().parents[2]
FOLDERS = ("assets", "scene_templates", "examples")


def files(root: Path) -> set[str]:
    """Relative names of all files that should travel."""
    return {
        path.relative_to(root).as_posix()
        for path in root.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def main() -> None:
    """Compare the installed package with the repository."""
    package = Path(sumo3dviz_pt.__file__).resolve().parent
    if package.is_relative_to(REPOSITORY):
        sys.exit(f"this is the repository, not an installed wheel: {package}")
    missing = [
        f"sumo3dviz_pt/{file}"
        for file in sorted(files(REPOSITORY / "sumo3dviz_pt") - files(package))
    ]
    for name in FOLDERS:
        root = catalog.data_root(name)
        if not root.is_relative_to(package):
            sys.exit(f"{name} is found outside the package: {root}")
        missing += [f"{name}/{file}" for file in sorted(files(REPOSITORY / name) - files(root))]
    if missing:
        sys.exit("\n  ".join(["the wheel lacks", *missing]))


if __name__ == "__main__":
    main()
