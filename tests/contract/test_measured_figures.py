"""Figures that a bench makes are those of its files, in pages that cannot include them.

Pages of the manual include what benches write (`docs/_bench`). The README and the paper are read
as they are, and sentences hold single figures; both are compared with the files here.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import make_kerb
import numpy as np
import pytest
from bench.checks import fitted, table
from manual import DOCS, PAGES, ROOT, name_of, text_of

from sumo3dviz_pt.inspection import checks
from sumo3dviz_pt.pipeline.conditions import MEASURED
from sumo3dviz_pt.pipeline.costs import cost_of
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.pipeline.steps import CHECKS

BENCH = DOCS / "_bench"
DAYS = ("ronda", "crossing", "golden_hour", "glass_queue", "empty_road", "overcast", "wide_trees")
PRESETS = ("draft", "preview", "standard", "study")


@cache
def of_presets() -> dict[str, dict[str, float]]:
    """What the bench of presets measured, by preset."""
    rows = json.loads((BENCH / "presets.json").read_text("utf-8"))["presets"]
    return {row["preset"]: {**row, **row["errors"]} for row in rows}


@cache
def of_curves(scene: str, preset: str, column: str) -> tuple[float, ...]:
    """A column of a scene's curves, of one preset."""
    with (BENCH / scene / "convergence.csv").open(encoding="utf-8") as stream:
        return tuple(
            float(row[column]) for row in csv.DictReader(stream) if row["preset"] == preset
        )


@cache
def of_motion(name: str) -> tuple[float, float, float]:
    """RMSE [m], 95 % of headings [deg] and jerk [m/s^3] of a row of the table of smoothers."""
    row = re.search(rf"^\| {re.escape(name)} \| (.*) \|$", text_of(BENCH / "motion.md"), re.M)
    assert row is not None, name
    cells = [float(cell) for cell in row[1].split("|")]
    return cells[0], cells[4], cells[8]


def listed(values: list[str]) -> str:
    """As people enumerate them."""
    return f"{', '.join(values[:-1])} and {values[-1]}"


def motion() -> Iterator[tuple[str, str]]:
    """What is said of motion, by page."""
    own, heading, jerk = of_motion("`lane`, held out")
    mean, *_ = of_motion("`lane`, held out, Euler")
    theirs, *_ = of_motion("`paper_symmetric`, held out")
    *_, straight = of_motion("`linear`, held out")
    front = f"off by {100 * own:.1f} cm"
    known = f"{100 * mean:.0f} cm where the log's speeds say nothing new"
    for page in ("README.md", "paper.md", "docs/motion.md"):
        yield page, front
        yield page, known
        yield page, f"{heading:.1f}°"
    for page in ("README.md", "paper.md"):
        yield page, f"{theirs / own:.0f} and {theirs / mean:.0f} times closer"
    assert 35 < straight / jerk < 45
    yield "README.md", "at a fortieth of the jerk of straight lines"


def presets() -> Iterator[tuple[str, str]]:
    """What is said of presets, by page."""
    rows = of_presets()
    seen = f"{rows['draft']['in_view']} vehicles in view"
    for page in ("README.md", "paper.md", "docs/quality.md"):
        yield page, seen
    costs = [f"{rows[name]['later']:.1f}" for name in PRESETS]
    words = (
        "cost {} CPU-seconds with the preset `draft`, {} with `preview`, {} with `standard` and {}"
    )
    yield "paper.md", f"{words.format(*costs)} with `study`"
    flips = [f"{rows[name]['flip']:.3f}" for name in PRESETS]
    yield "paper.md", f"FLIP against the reference is {listed(flips)}"


def curves() -> Iterator[tuple[str, str]]:
    """What is said of errors, by page."""
    errors = [np.median(of_curves("ronda", f"{name} still", "flip")) for name in PRESETS[:3]]
    stills = [f"{error:.3f}".lstrip("0") for error in errors]
    yield "README.md", f"still of the first three errs by {listed(stills)}"
    night = {name: bias("crossing_night", name) for name in ("standard", "study")}
    yield "docs/measured/quality.md", f"`standard` are {-100 * night['standard']:.1f} % too dark"
    yield "docs/measured/quality.md", f"of `study` {-100 * night['study']:.1f} %"
    standard = [abs(bias(scene, "standard")) for scene in DAYS]
    yield "docs/measured/quality.md", f"`standard` by {shorter(100 * max(standard))} % at most"
    yield "docs/quality.md", f"`standard` within {100 * max(standard):.1f} %"


def certificates() -> Iterator[tuple[str, str]]:
    """What is said of seeded faults."""
    first = text_of(BENCH / "violations.md").splitlines()[0]
    counts = re.findall(r"\d+", first)
    seeded, found, outsiders, clean, wrong = counts
    yield "paper.md", f"Of {seeded} seeded violations"
    yield "paper.md", f"{found} are found, {outsiders} of which were thought of from the manual"
    yield "paper.md", f"of {clean} clean pairs {wrong} are called wrong"
    relit = re.search(r"All together: (\d+) of (\d+) are found", text_of(BENCH / "relit.md"))
    assert relit is not None
    yield (
        "paper.md",
        f"Of {relit[2]} places that were lit 1.5 or 2.5 times as brightly, {relit[1]} are",
    )


def cycles() -> Iterator[tuple[str, str]]:
    """What is said of another renderer's cost."""
    rows = re.findall(
        r"^\| 16 samples: FLIP [\d.]+ \|([^|]*\|){2} ([\d.]+) \|",
        text_of(BENCH / "cycles.md"),
        re.M,
    )
    (_, day), (_, night) = rows
    yield "paper.md", f"our kernel takes {day} of its CPU time by day and {night} by night"


def nights() -> Iterator[tuple[str, str]]:
    """What is said of dark nights."""
    standard, study = (-100 * bias("crossing_night", name) for name in ("standard", "study"))
    words = f"nights are {standard:.1f} % too dark with the preset `standard`, and {study:.1f} %"
    yield "paper.md", words


def shorter(value: float) -> str:
    """A figure below 1 without its nought."""
    return f"{value:.1f}".lstrip("0")


def bias(scene: str, preset: str) -> float:
    """Mean share of light that a preset adds."""
    return float(np.mean(of_curves(scene, preset, "mean_bias")))


@pytest.mark.parametrize("said", [motion, presets, curves, certificates, cycles, nights])
def test_sentences_hold_the_figures_of_the_benches(
    said: Callable[[], Iterator[tuple[str, str]]],
) -> None:
    for page, words in said():
        assert words in " ".join(text_of(ROOT / page).split()), f"{page}: {words}"


def test_nights_cost_more_as_the_page_says() -> None:
    """From a third to a half."""
    rows = re.findall(
        r"^\| (\d+)x\d+, (day|night)[^|]*\| ([\d.]+)", text_of(BENCH / "weathers.md"), re.M
    )
    costs = {(width, hour): float(dry) for width, hour, dry in rows}
    more = sorted(costs[width, "night"] / costs[width, "day"] - 1 for width in ("1280", "640"))
    assert 0.25 < more[0] < more[1] < 0.58
    page = text_of(DOCS / "howto" / "sun_by_date.md")
    assert "nights cost a third to a half more than days" in page


def test_forecasts_reckon_with_the_weathers_of_the_bench() -> None:
    table = [line.split("|")[1:-1] for line in text_of(BENCH / "weathers.md").splitlines()]
    kinds = [cell.strip(" `") for cell in table[0][1:]]
    rows = []
    for what, *cells in table[2:]:
        found = re.match(r" (\d+)x(\d+), (day|night)", what)
        assert found is not None
        costs = [float(cell.split()[0]) for cell in cells]
        size = [int(found[1]), int(found[2])]
        rows.append({"size": size, "hour": found[3], **dict(zip(kinds, costs, strict=True))})
    assert json.loads(MEASURED.read_text(encoding="utf-8"))["rows"] == rows


def test_check_says_first_how_long_it_takes() -> None:
    """Within a factor of 1.5; what was said stands in the bench's file, not in a formula here."""
    rows = json.loads((BENCH / "checks.json").read_text("utf-8"))
    assert len(rows) >= 7
    for name, row in rows.items():
        assert 0.7 <= row["said_seconds"] / row["cpu_seconds"] <= 1.5, name


def test_check_takes_a_minute_at_most() -> None:
    rows = json.loads((BENCH / "checks.json").read_text("utf-8"))
    assert all(row["cpu_seconds"] <= 60.0 for row in rows.values())


def test_forecasts_of_check_are_those_of_its_bench() -> None:
    """The constants follow from all rows; else run the bench, with --said on a busy machine."""
    rows = json.loads((BENCH / "checks.json").read_text("utf-8"))
    assert json.loads(CHECKS.read_text("utf-8")) == fitted(rows)
    assert table(rows) == text_of(BENCH / "checks.md")


def test_the_page_of_costs_shows_what_check_forecasts() -> None:
    page = text_of(DOCS / "howto" / "cost.md")
    found = re.search(r"triangles ([\d,]+)", page)
    assert found is not None
    triangles = int(found[1].replace(",", ""))
    forecast = {
        name: cost_of(
            quality_preset(name, together=True),
            size=(1920, 1080), triangles=triangles, frames=500, cores=2,
        ).as_dict()
        for name in PRESETS
    }  # fmt: skip
    lines = checks._cost_lines({"forecast": forecast})
    assert "\n".join(lines) in page, "\n".join(lines)
    samples = {name: quality_preset(name, together=True).spp for name in ("standard", "preview")}
    words = f"`standard` ({samples['standard']} samples) | `preview` ({samples['preview']})"
    assert words in page


def test_every_file_of_a_bench_is_in_the_manual() -> None:
    """Included, or linked where it is a page of its own."""
    text = "\n".join(text_of(page) for page in PAGES)
    for path in BENCH.glob("*.md"):
        assert f"_bench/{path.name}\n```" in text, path.name
    for folder in BENCH.iterdir():
        if (folder / "report.md").exists():
            assert f"_bench/{folder.name}/report>" in text


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_what_a_page_includes_is_there(page: Path) -> None:
    for target in re.findall(r"^```\{include\} (\S+)", text_of(page), re.M):
        assert (page.parent / target).is_file(), target


@pytest.mark.slow
def test_the_page_of_gaps_shows_what_the_program_says(tmp_path):
    for name, content in make_kerb.pages(tmp_path).items():
        assert text_of(DOCS / "_bench" / name) == content, "run tools/make_kerb.py"
