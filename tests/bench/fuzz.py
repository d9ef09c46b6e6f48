"""Damages thousands of files of all kinds, and counts how commands end.

    python tests/bench/fuzz.py [--count 2000] [--seed 0] [--workers 2] [--kind NAME] [--log FILE]

Not run by pytest, which tries a few of each kind (tests/property/test_fuzz_*.py). A case that
ends in anything but success or one clear sentence makes the exit code 1.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TextIO

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from damage import KINDS
from damaged_work import CASES
from fuzzing import Outcome, outcomes

ALL = [kind for kind in (*KINDS, *CASES) if kind != "nothing"]
DEAR = {"cameras": 0.2, "models": 1.5, "images": 0.7}
"""Shares of kinds in the count, where they are not 1."""


def _cases(kinds: list[str], count: int, seed: int) -> list[tuple[str, int]]:
    """Share a number of cases out over kinds, which come by turns."""
    weights = [DEAR.get(kind, 1.0) for kind in kinds]
    own = [round(count * weight / sum(weights)) for weight in weights]
    cases = [(k, kind) for kind, most in zip(kinds, own, strict=True) for k in range(most)]
    return [(kind, seed + number) for number, kind in sorted(cases)]


def _word(outcome: Outcome) -> str:
    """How a case ended."""
    if outcome.fault:
        return "fault"
    return "refused in a sentence" if outcome.code else "done"


def _tried(cases: list[tuple[str, int]], log: TextIO) -> list[Outcome]:
    """Try cases one after the other; write how each ended."""
    found = []
    for outcome in outcomes(cases):
        found.append(outcome)
        line = {"case": f"{outcome.kind} {outcome.seed}", "ended": _word(outcome)}
        line |= {"cpu_s": round(outcome.seconds, 1), "said": outcome.fault or outcome.said[:200]}
        log.write(json.dumps(line) + "\n")
        log.flush()
    return found


def main() -> int:
    """Try all; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kind", action="append", choices=ALL)
    parser.add_argument("--log", type=Path, default=Path(os.devnull), help="a line of JSON a case")
    options = parser.parse_args()
    cases = _cases(options.kind or ALL, options.count, options.seed)
    lots = [cases[k :: options.workers] for k in range(options.workers)]
    with options.log.open("w", encoding="utf-8") as log, ThreadPoolExecutor(len(lots)) as pool:
        tried = pool.map(lambda lot: _tried(lot, log), lots)
        found = [outcome for some in tried for outcome in some]
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
    return 1 if account["faults"] else 0


if __name__ == "__main__":
    sys.exit(main())
