"""Follows a request through the house: which modules take it, how often it comes back, climbs.

    python tools/house_walks.py [--scene examples/crossing/scene.yaml] [--camera NAME]

renders two frames of postage-stamp size with every call watched. A stay is a module that a call
hands the request to, when the call before went to another module. A return is a stay in a module
that had it before; a climb is a step to a module that imports the one before it, by any way.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from types import FrameType
from typing import Any

from house import PACKAGE, Graph, imports_of, read_modules

ROOT = Path(__file__).resolve().parents[1]


def watched(work: Callable[[], object], kind: type) -> list[str]:
    """Return the modules whose functions took a value of a kind, in order, while something ran."""
    stays: list[str] = []

    def look(frame: FrameType, event: str, _: Any) -> None:
        name = frame.f_globals.get("__name__", "")
        if event != "call" or not name.startswith(PACKAGE) or frame.f_code.co_name == "<lambda>":
            return
        code = frame.f_code
        taken = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        own = name == kind.__module__ and frame.f_locals.get("self") is not None
        if not own and any(type(frame.f_locals.get(each)) is kind for each in taken):
            module = name.removeprefix(f"{PACKAGE}.")
            if not stays or stays[-1] != module:
                stays.append(module)

    sys.setprofile(look)
    try:
        work()
    finally:
        sys.setprofile(None)
    return stays


def counted(stays: Sequence[str], graph: Graph) -> dict[str, int]:
    """Return how many stays, returns and climbs a walk has, and in how many rooms."""
    reached: dict[str, set[str]] = {}

    def above(one: str, other: str) -> bool:
        if one not in reached:
            found: set[str] = set()
            waiting = list(graph.get(one, ()))
            while waiting:
                next_one = waiting.pop()
                if next_one not in found:
                    found.add(next_one)
                    waiting += graph[next_one]
            reached[one] = found
        return other in reached[one]

    return {
        "stays": len(stays),
        "returns": sum(stay in stays[:place] for place, stay in enumerate(stays)),
        "climbs": sum(above(new, old) for old, new in pairwise(stays)),
        "modules": len(set(stays)),
    }


def main() -> None:
    """Follow the request of a film."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", type=Path, default=ROOT / "examples/crossing/scene.yaml")
    parser.add_argument("--camera", default="corner")
    chosen = parser.parse_args()
    from sumo3dviz_pt.cli.render import render_films
    from sumo3dviz_pt.pipeline.films.orders import FilmOrder
    from sumo3dviz_pt.pipeline.production import Request
    from sumo3dviz_pt.pipeline.scene_file import load_job

    modules = read_modules(ROOT / PACKAGE)
    graph = {name: imports_of(module, modules, late=True) for name, module in modules.items()}
    with tempfile.TemporaryDirectory() as folder:
        job = load_job(chosen.scene, {"output.size": [64, 36]})
        request = Request(chosen.camera, "draft", spp=1)
        order = FilmOrder(Path(folder) / "film.mp4", start=470.0, end=470.08)
        stays = watched(lambda: render_films(job, request, order), Request)
    print(" -> ".join(stays))
    print(counted(stays, graph))


if __name__ == "__main__":
    main()
