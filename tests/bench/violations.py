"""Seeds violations into the films of twelve clean pairs, and writes what the certificate says.

Run from the repository's root, with a folder for the films that need not be there:

    python tests/bench/violations.py FOLDER [--size 320,180] -o docs/_bench/violations.json

Films that are there are not rendered again. A table for the manual is written beside the file.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from violations import FACTORS, Films, Judged, all_violations, confounded, write_study

from sumo3dviz_pt.pipeline.films.build import FilmOrder, render_film
from sumo3dviz_pt.pipeline.production import Request, ready_renderer
from sumo3dviz_pt.pipeline.studies.file import load_study
from sumo3dviz_pt.pipeline.studies.plan import plan_study
from sumo3dviz_pt.pipeline.studies.records import film_path

_LONGEST = 110
"""Most characters of what is said that the table shows."""


def films_in(
    folder: Path, size: str, *, example: str = "crossing", write: Writer = write_study
) -> Films:
    """Return a study's films, rendered where they are missing."""
    place = folder / example
    study = place / "study.yaml" if place.is_dir() else write(place, size=size)
    films = Films(plan_study(load_study(study)), folder / ("out" if example == "crossing" else "other"))
    (films.folder / "materials").mkdir(parents=True, exist_ok=True)
    ready_renderer()
    for stimulus in films.plan.stimuli:
        path = film_path(films.folder, films.plan, stimulus)
        if not path.is_file():
            render_film(stimulus.job, Request(), FilmOrder(path, overwrite=True))
    return films


def row(found: Judged, said: str) -> dict[str, Any]:
    """Return what is told of a pair."""
    light = [None if math.isnan(share) else round(share, 4) for share in found.light]
    return {"wrong": found.wrong, "lit": light[0], "beyond": light[1], "said": said}


def rows(films: Films, folder: Path) -> dict[str, dict[str, Any]]:
    """Return a row for each clean pair and each violation."""
    found = {}
    for light in ("day", "night"):
        for factor in FACTORS:
            judged = films.judge(factor, light)
            said = "; ".join(judged.faults) or "nothing"
            found[f"nothing: {factor}, {light}"] = row(judged, said)
    for name, violation in all_violations().items():
        if violation.level:
            judged = Judged(confounded(folder / "crossing", violation.level), (math.nan,) * 2, 0)
        else:
            judged = films.judge(violation.factor, violation.light, violation)
        own = (fault for fault in judged.faults if re.search(violation.said, fault))
        found[name] = row(judged, next(own, "NOT FOUND")) | {"where": violation.where}
    return found


def table(found: dict[str, dict[str, Any]]) -> str:
    """Return the rows as the manual shows them."""
    lines = [
        "| what is wrong | seeded into | wrong pixels | lit otherwise | out of reach |"
        " what is said |",
        "|---|---|--:|--:|--:|---|",
    ]
    for name, each in found.items():
        said = re.sub(r"\s+", " ", each["said"])
        said = said if len(said) <= _LONGEST else said[: _LONGEST - 3] + "..."
        shares = ["-" if each[key] is None else f"{each[key]:.2%}" for key in ("lit", "beyond")]
        cells = [name, each.get("where", "-"), str(each["wrong"]), *shares, said.replace("|", "/")]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Judge all, and write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", default="96,54")
    parser.add_argument("-o", "--output", type=Path, required=True)
    asked = parser.parse_args()
    found = rows(films_in(asked.folder, asked.size.replace(",", ", ")), asked.folder)
    asked.output.write_text(
        json.dumps({"size": asked.size, "rows": found}, indent=1) + "\n", "utf-8"
    )
    asked.output.with_suffix(".md").write_text(table(found), "utf-8")


if __name__ == "__main__":
    main()
