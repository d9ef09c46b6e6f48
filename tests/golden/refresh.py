"""Renders the golden pictures anew: python tests/golden/refresh.py [NAME ...].

Do this in a commit of its own, and look at old, new and difference before.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from pictures import DATA, PICTURES, render


def main(names: list[str]) -> None:
    """Write mean and variance in half precision, below 60 kB each."""
    DATA.mkdir(exist_ok=True)
    for name in names or PICTURES:
        mean, variance = render(name)
        path = DATA / f"{name}.npz"
        np.savez_compressed(
            path, mean=mean.astype(np.float16), deviation=np.sqrt(variance).astype(np.float16)
        )
        sys.stdout.write(f"{path.name}: {path.stat().st_size} bytes, mean {mean.mean():.4f}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
