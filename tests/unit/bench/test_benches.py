"""Benches still run: each measures a small scene at a tiny size, and says what it has to."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench import (
    before_after,
    curves,
    finishing,
    frame_parts,
    growth,
    presets,
    rays,
    viewer,
    weathers,
)
from builders import write_scenario
from viewer.browser import chromium

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.pipeline.films.traced import HelpedFrame

SIZE = (48, 28)

ROOT = Path(__file__).resolve().parents[3]
PROGRAMS = [
    path.relative_to(ROOT).as_posix()
    for path in sorted((ROOT / "tests/bench").glob("*.py"))
    if "ArgumentParser" in path.read_text(encoding="utf-8")
]
"""Benches with arguments, which the manual has people start as programs."""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scenario(tmp_path_factory.mktemp("bench"), signals=True)


@pytest.mark.slow
@pytest.mark.parametrize("program", PROGRAMS)
def test_programs_start_as_the_manual_says(program: str) -> None:
    words = [sys.executable, program, "--help"]
    said = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    assert said.stdout.startswith("usage: ")


@pytest.mark.slow
def test_presets_compile_nothing_late(scene: Path) -> None:
    found = presets.run("draft", SIZE, presets.Film(scene, "post", 4.0))
    assert found["preset"] == "draft" and found["spp"] == 1 and found["compiled"] == 0
    assert found["in_view"] > 0 and found["memory_mb"] > 0
    assert found["later"] == found["update"] + found["render"] + found["finish"]
    assert found["finish"] > 0 and 0 < found["render"] < found["first"]
    lines = presets.table([{**found, "errors": {"flip": 0.1, "flicker_mc": 2.0}}], bare=1.0)
    assert "| `draft` |" in lines[2] and lines[2].count("|") == lines[0].count("|")


def test_a_window_finishes_what_has_all_its_neighbours(monkeypatch: pytest.MonkeyPatch) -> None:
    finished = []

    def noted(*given: Any, averager: Any) -> HelpedFrame:
        finished.append(given)
        return HelpedFrame(Layers({"radiance": np.zeros((1, 1, 3), np.float32)}))

    monkeypatch.setattr(presets, "helped", noted)
    window = presets.Window(2)
    for number in range(9):
        window.add(f"frame {number}", f"how {number}")
    assert [(centre, how) for centre, _, how in finished] == [
        (f"frame {number}", f"how {number}") for number in range(2, 7)
    ]
    assert finished[0][1] == [f"frame {number}" for number in (0, 1, 3, 4)]
    assert len(window.costs) == 5


@pytest.fixture(scope="module")
def plan(scene: Path) -> growth.Plan:
    day = growth.View(scene, "post", 4.0)
    return growth.Plan(
        day=day,
        night=replace(day, template="city_night"),
        empty=day,
        size=SIZE,
        sizes=((32, 18), SIZE),
        samples=(1, 4),
        users=(2, 9),
        triangles=(1_000, 4_000),
        lamps=(3, 12),
        frames=4,
    )


@pytest.mark.slow
def test_growth_measures_everything(plan: growth.Plan) -> None:
    said = growth.measured(plan)
    rows = [line.split("|")[1:-1] for line in said.splitlines() if line.startswith("|")]
    first = {cell.strip(): line for line in rows if (cell := line[0])}
    assert {"pixels", "samples", "road users", "triangles", "lamps", "day", "night"} <= set(first)
    kinds = {(row[0].strip(), row[1].strip()) for row in rows if len(row) == 7}
    assert {("day", kind) for kind in rays.KINDS[:3]} | {("day", "all")} <= kinds
    assert {("night", kind) for kind in rays.KINDS} <= kinds
    assert "An empty road costs" in said and "nan" not in said


@pytest.mark.slow
def test_rays_are_counted_exactly_and_pictures_stay_the_same(plan: growth.Plan) -> None:
    from sumo3dviz_pt.pipeline.production import opened

    made = plan.day.made(SIZE)
    state = made.shot.frame_at(4.0)
    with opened(made) as session:
        before = session.samples(state).layers["capped"]
        rows = {row.kind: row for row in rays.rays_of("day", session, state)}
        after = session.samples(state).layers["capped"]
    # Every sample of every pixel has one primary ray; only what was hit sends others.
    samples = SIZE[0] * SIZE[1] * made.quality.spp
    assert rows[rays.PRIMARY].count == samples
    assert 0 < rows[rays.TO_SKY].count < samples * made.quality.max_depth
    assert rays.TO_LAMPS not in rows
    assert rows["all"].count == sum(row.count for kind, row in rows.items() if kind != "all")
    assert np.array_equal(before, after)


def test_shares_are_embrees_time_over_ours() -> None:
    row = rays.RayRow("day", rays.BOUNCE, 2_000_000, raw=0.5, ours=2.0)
    assert row.share == 0.25
    assert rays.table([row])[2] == "| day | bounce | 2,000 | 4.0 | 0.500 | 2.000 | 25% |"
    assert math.isnan(replace(row, ours=0.0).share)
    assert rays.table([replace(row, ours=-0.001)])[2].endswith("| -0.001 | - |")


@pytest.mark.slow
def test_films_are_compared_before_and_after(scene: Path, tmp_path: Path) -> None:
    case = before_after.Case("tiny", str(scene), "post", 4.0, size=SIZE)
    cost = before_after.render(case, "draft", tmp_path)
    assert 0 < cost["developing"] < cost["later"]
    truth = tmp_path / "truth.npy"
    before_after.reference(case, before_after.FRAMES["draft"], truth)
    wrong = before_after.errors(case, "draft", tmp_path, truth)
    assert 0 < wrong["flip"] < 0.3 and wrong["psnr"] > 15 and wrong["flicker"] >= 0
    row = {"case": case.name, "preset": "draft", "state": "after", **cost, **wrong}
    assert "| tiny | draft | after |" in before_after.table([row])


@pytest.mark.slow
def test_weathers_and_lenses_are_measured(scene: Path) -> None:
    # What stands around is no matter: the plainest template is the quickest to build and load.
    hours, few = (("day", ("abstract", 4.0)),), ("fog",)
    plan = weathers.Plan(scene, "post", hours, few, SIZE, "draft", sizes=(SIZE,))
    rows = [line.split("|")[1:-1] for line in weathers.measured(plan) if line.startswith("|")]
    assert [row[1].strip() for row in rows[2:4]] == ["dry", "fog"]
    assert float(rows[2][-1]) == 1.0 and 0.1 < float(rows[3][-1]) < 10.0
    assert [row[0].strip() for row in rows[6:]] == list(weathers.LENSES)
    assert float(rows[6][-1]) == 1.0 and all(float(row[-1]) > 0.1 for row in rows[6:])


@pytest.mark.slow
def test_curves_are_drawn_and_published(scene: Path, tmp_path: Path) -> None:
    case = curves.Case("tiny", str(scene), "post", 4.0, "32x18", top=2, page=True)
    (tmp_path / "work").mkdir()
    assert main([str(word) for word in curves.arguments(case, tmp_path / "work")]) == 0
    curves.publish(case, tmp_path / "docs" / case.name, tmp_path / "work")
    lines = curves.overview(tmp_path / "docs", [case])
    assert lines[2].startswith("| [tiny](../docs/tiny/report.md) |")
    assert lines[2].count("|") == lines[0].count("|")


@pytest.mark.slow
def test_every_part_of_a_frame_is_timed(scene: Path) -> None:
    film = frame_parts.Film(scene, "post", 4.0)
    found = frame_parts.measured(film, "draft", SIZE, "llvm")
    for kind in ("cpu", "wall"):
        assert {*found[kind]} == {*frame_parts.PARTS}
        assert found[kind]["trace"] > 0 and found[kind]["average"] > 0
    lines = frame_parts.table([{"film": "post", "preset": "draft", **found}], "cpu")
    assert lines[2].count("|") == lines[0].count("|")


@pytest.mark.slow
def test_every_part_of_finishing_is_timed(scene: Path, tmp_path: Path) -> None:
    folder = finishing.trace(("post", 4.0), tmp_path, scene=scene, size=SIZE)
    names = [name for name, cpu, wall in finishing.measured(folder) if cpu >= 0 and wall > 0]
    assert {"packing", "unpacking", "8 neighbours", "denoiser fast", "haze", "planes"} <= set(names)


@pytest.mark.slow
@pytest.mark.skipif(chromium() is None, reason="there is no Chromium on the PATH")
def test_the_viewer_is_measured(scene: Path) -> None:
    words = ["--size", "48x28", "--from", "3", "--to", "11", "--seconds", "3", "--keys", "4"]
    rows = dict(viewer.measure(viewer.options_of(words), viewer.Watched(scene, "post", 4.0)))
    assert rows["road users in the picture"] != "0"
    assert float(rows["pictures a second, moving"]) > 0
    assert float(rows["pictures a second, playing"]) > 0
    assert any(name.startswith("key to picture, ") for name in rows)
