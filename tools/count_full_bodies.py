"""Counts the triangles of people, and of vehicles in full detail: reports need not build them.

    python tools/count_full_bodies.py [NAME ...]

Bodies that the user's cache lacks are built, some five CPU-minutes for all. Names given are
counted anew, all others stay as they were counted; people and riders are always counted.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.full_counts import COUNTS, counted, recipe_digest
from sumo3dviz_pt.cast.full_detail import full_prototypes
from sumo3dviz_pt.cast.people_counts import COUNTS as PEOPLE
from sumo3dviz_pt.cast.people_counts import count_people
from sumo3dviz_pt.library.vehicles.bake import has_full_detail


def main(chosen: Sequence[str]) -> int:
    """Write the files anew, vehicle by vehicle in the order of their names."""
    PEOPLE.write_text(json.dumps(count_people(), indent=1) + "\n", encoding="utf-8")
    names = [
        n for n in catalog.names("vehicles") if has_full_detail(catalog.find("vehicles", n).meta)
    ]
    old = json.loads(COUNTS.read_text(encoding="utf-8")) if COUNTS.is_file() else {}
    found = {}
    for name in names:
        if chosen and name not in chosen and name in old:
            found[name] = old[name]
            continue
        made = full_prototypes([name])
        levels = {level: counted(made[f"{name}/{level}"]) for level in ("full", "wheel")}
        found[name] = {"made_from": recipe_digest(name), **levels}
        print(name, {level: sum(parts.values()) for level, parts in levels.items()}, flush=True)
    COUNTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
