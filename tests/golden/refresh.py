"""Renders the golden pictures anew: python tests/golden/refresh.py [NAME ...] [--look FOLDER].

Do this in a commit of its own, and look at old, new and difference before: `--look` writes
the three side by side into a folder.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from pictures import DATA, PICTURES, SEEDS, Stored, stored, stored_of, write

from sumo3dviz_pt.image.png import write_png

LARGER = 8
"""Pixels along a side of each block."""


def side_by_side(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Old, new and four times their difference, as 8-bit pixels."""
    row = np.concatenate([old, new, 4.0 * np.abs(new - old)], axis=1)
    large = row.repeat(LARGER, axis=0).repeat(LARGER, axis=1)
    return np.round(255.0 * np.clip(large, 0.0, 1.0)).astype(np.uint8)


def made(name: str) -> Stored:
    """A picture as the present code renders it."""
    with PICTURES[name].taken() as take:
        return stored_of([take(seed) for seed in SEEDS])


def main(arguments: list[str]) -> None:
    """Write mean and variance of blocks in half precision, below 60 kB each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="all if none is given")
    parser.add_argument("--look", type=Path, help="a folder for old, new and difference")
    chosen = parser.parse_args(arguments)
    for name in chosen.names or PICTURES:
        new = made(name)
        if chosen.look is not None and (DATA / f"{name}.npz").exists():
            chosen.look.mkdir(parents=True, exist_ok=True)
            write_png(chosen.look / f"{name}.png", side_by_side(stored(name).mean, new.mean))
        path = write(name, new)
        sys.stdout.write(f"{path.name}: {path.stat().st_size} bytes, mean {new.mean.mean():.4f}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
