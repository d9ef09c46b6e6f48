"""Counts the triangles of people and of riders who pedal: reports need not build them.

python tools/count_people.py
"""

from __future__ import annotations

import json
import sys

from sumo3dviz_pt.cast.counts import PEOPLE_COUNTS, count_people


def main() -> int:
    """Write the file anew."""
    PEOPLE_COUNTS.write_text(json.dumps(count_people(), indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
