"""Damages thousands of files of all kinds, and counts how commands end.

    python tests/bench/fuzz.py [--count 2000] [--seed 0] [--workers 2] [--kind NAME ...] [-o JSON]

Not run by pytest, which tries a few of each kind (tests/property/test_fuzz_*.py). A case that
ends in anything but success or one clear sentence makes the exit code 1.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from damage import KINDS
from damaged_work import CASES
from fuzzing import Outcome, outcomes

ALL = [kind for kind in (*KINDS, *CASES) if kind != "nothing"]
DEAR = {"cameras": 0.2, "models": 1.5, "images": 0.7}
"""Shares of kinds in the count, where they are not 1."""

_PART = 15


def _parts(kinds: list[str], count: int, seed: int) -> list[tuple[str, range]]:
    """Share a number of cases out over kinds, in parts of a few each."""
    weights = [DEAR.get(kind, 1.0) for kind in kinds]
    parts = []
    for kind, weight in zip(kinds, weights, strict=True):
        last = seed + -int(-count * weight // sum(weights))
        parts += [(kind, range(k, min(k + _PART, last))) for k in range(seed, last, _PART)]
    return sorted(parts, key=lambda part: part[1].start)


def _word(outcome: Outcome) -> str:
    """How a case ended."""
    if outcome.fault:
        return "fault"
    return "refused in a sentence" if outcome.code else "done"


def _tried(part: tuple[str, range]) -> list[Outcome]:
    """Try some cases; print what is wrong with them."""
    found = list(outcomes(*part))
    for outcome in found:
        if outcome.fault:
            print(outcome.fault, flush=True)
    return found


def main() -> int:
    """Try all; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kind", action="append", choices=ALL)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    parts = _parts(options.kind or ALL, options.count, options.seed)
    with ThreadPoolExecutor(options.workers) as pool:
        found = [outcome for some in pool.map(_tried, parts) for outcome in some]
    counts = Counter((outcome.kind, _word(outcome)) for outcome in found)
    total = Counter(_word(outcome) for outcome in found)
    account = {
        "cases": len(found),
        "total": dict(total),
        "kinds": {
            kind: {word: counts[kind, word] for word in total if counts[kind, word]}
            for kind in sorted({outcome.kind for outcome in found})
        },
        "longest_cpu_s": round(max(outcome.seconds for outcome in found), 1),
        "faults": [outcome.fault for outcome in found if outcome.fault],
    }
    text = json.dumps(account, indent=1)
    print(text)
    if options.output:
        options.output.write_text(text + "\n", encoding="utf-8")
    return 1 if account["faults"] else 0


if __name__ == "__main__":
    sys.exit(main())
