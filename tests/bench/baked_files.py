"""Makes the packed bodies of vehicles again and compares them with those that travel.

    python tests/bench/baked_files.py [NAME ...]

All vehicles take some fifteen CPU-minutes. The usual tests make a few, and compare the digests
of all recipes. The exit code is 1 if any vehicle differs.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

from alike import assert_files_alike
from bakery.bake import bake_folder

from sumo3dviz_pt.catalog import find, names, recipe_files


def baked_again(name: str, scratch: Path) -> Path:
    """Make a vehicle's files in a folder below `scratch` and return that folder."""
    folder = scratch / name
    for path in recipe_files(find("vehicles", name)):
        (scratch / path.parent.name).mkdir(parents=True, exist_ok=True)
        (scratch / path.parent.name / path.name).write_bytes(path.read_bytes())
    bake_folder(folder)
    return folder


def differs(name: str) -> str:
    """Say how a vehicle made again differs from the one that travels; empty if it does not."""
    with tempfile.TemporaryDirectory() as scratch:
        try:
            assert_files_alike(baked_again(name, Path(scratch)), find("vehicles", name).folder)
        except AssertionError as error:
            return str(error).splitlines()[0] if str(error) else "differs"
    return ""


def main(chosen: Sequence[str]) -> int:
    """Print a line for each vehicle."""
    of_one = [
        name
        for name in names("vehicles")
        if not {"units", "turns"} & set(find("vehicles", name).meta)
    ]
    wrong = 0
    for name in chosen or of_one:
        began = time.process_time()
        said = differs(name)
        wrong += bool(said)
        print(f"{name:24} {time.process_time() - began:6.1f} CPU-s  {said or 'as shipped'}")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
