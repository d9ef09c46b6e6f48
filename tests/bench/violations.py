"""Seeds violations into the films of twelve clean pairs, and writes what the certificate says.

Run from the repository's root, with a folder for the films that need not be there:

    python tests/bench/violations.py FOLDER [--size 320,180] -o docs/_bench/violations.json

Films that are there are not rendered again. Tables for the manual are written beside the file: what
was seeded and what is said of it; and how often a relit 2 % of the picture is found, on this scene
and on another one, which no limit was set by.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from manipulations import OUTSIDER, FolderChange, write_small_study
from relit import RATES, rates, rates_table
from violations import (
    FACTORS,
    OTHERS,
    Films,
    Judged,
    Violation,
    all_violations,
    confounded,
    write_other_study,
    write_study,
)

from sumo3dviz_pt.cli import main as command
from sumo3dviz_pt.pipeline.films.film import FilmOrder, render_film
from sumo3dviz_pt.pipeline.production import Request, ready_renderer
from sumo3dviz_pt.studies.certificate.verify import VerifyOrder, verify_study
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.records import film_path

Writer = Callable[..., Path]
"""Writes the study of a scene."""

_LONGEST = 110
"""Most characters of what is said that the table shows."""


def films_in(
    folder: Path, size: str, *, example: str = "crossing", write: Writer = write_study
) -> Films:
    """Return a study's films, rendered where they are missing."""
    place = folder / example
    study = place / "study.yaml" if place.is_dir() else write(place, size=size)
    films = Films(
        plan_study(load_study(study)), folder / ("out" if example == "crossing" else "other")
    )
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


def verified(change: FolderChange, study: Path) -> tuple[str, ...]:
    """Return what is said of the folder of a small study to which something was done."""
    if not (study / "out").is_dir():
        study.mkdir(parents=True)
        assert (
            command(["study", str(write_small_study(study)), "-o", str(study / "out"), "-q"]) == 0
        )
    digest = json.loads((study / "out" / "certificate.json").read_bytes())["digest"]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "out"
        shutil.copytree(study / "out", folder)
        change.change(folder)
        published = digest if change.published else ""
        found = verify_study(VerifyOrder(folder, published=published)).faults
    return tuple(f"{each.file}: {each.what}" for each in found)


def judged(films: Films, violation: Violation, folder: Path) -> Judged:
    """Return what is said of a violation, wherever it is seeded."""
    nothing = ((math.nan, math.nan), 0)
    if violation.level:
        return Judged(confounded(folder / "crossing", violation.level), *nothing)
    if violation.folder:
        return Judged(verified(violation.folder, folder / "small"), *nothing)
    if violation.film:
        return Judged(films.judge_film(violation, folder / "changed"), *nothing)
    return films.judge(violation.factor, violation.light, violation)


def rows(films: Films, folder: Path) -> dict[str, dict[str, Any]]:
    """Return a row for each clean pair and each violation."""
    found = {}
    for light in ("day", "night"):
        for factor in FACTORS:
            clean = films.judge(factor, light)
            said = "; ".join(clean.faults) or "nothing"
            found[f"nothing: {factor}, {light}"] = row(clean, said)
    for name, violation in all_violations().items():
        verdict = judged(films, violation, folder)
        own = (fault for fault in verdict.faults if re.search(violation.said, fault))
        found[name] = row(verdict, next(own, "NOT FOUND")) | {"where": violation.where}
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


def counts(found: dict[str, dict[str, Any]]) -> str:
    """Return how many violations there are, and how many are found, in a sentence."""
    clean = [each for name, each in found.items() if name.startswith("nothing: ")]
    seeded = {name: each for name, each in found.items() if not name.startswith("nothing: ")}
    by_outsider = sum(name.startswith(OUTSIDER) for name in seeded)
    told = sum(each["said"] != "NOT FOUND" for each in seeded.values())
    raised = sum(each["said"] != "nothing" for each in clean)
    return (
        f"Of {len(seeded)} violations {told} are found, {by_outsider} of them by somebody who knew"
        f" the manual alone (*{OUTSIDER.rstrip(': ')}*); of {len(clean)} clean pairs {raised} are"
        " called wrong.\n\n"
    )


def main() -> None:
    """Judge all, and write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", default="96,54")
    parser.add_argument("--other-size", default="128,72", help="of the other scene's films")
    parser.add_argument("-o", "--output", type=Path, required=True)
    asked = parser.parse_args()
    films = films_in(asked.folder, asked.size.replace(",", ", "))
    size = asked.other_size.replace(",", ", ")
    other = films_in(asked.folder, size, example="ronda", write=write_other_study)
    found = rows(films, asked.folder)
    relit = rates(films, FACTORS, "crossing") + rates(other, OTHERS, "ronda")
    content = {"size": asked.size, "other_size": asked.other_size, "rows": found, "relit": relit}
    asked.output.write_text(json.dumps(content, indent=1) + "\n", "utf-8")
    asked.output.with_suffix(".md").write_text(counts(found) + table(found), "utf-8")
    asked.output.with_name(RATES).write_text(rates_table(relit), "utf-8")


if __name__ == "__main__":
    main()
