"""The README's commands, example and tables do what they say."""

from __future__ import annotations

import json
import re
import runpy
import shlex
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from sumo3dviz_pt import arguments, catalog
from sumo3dviz_pt.jobfile import make_job, quality_preset

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
MANUAL = sorted((ROOT / "docs").glob("*.md"))
SMALLER = (("(960, 540)", "(64, 36)"), ("(640, 360)", "(64, 36)"), ("end=462", "end=460.08"))
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.M | re.S)


def blocks(language: str, text: str = README) -> list[str]:
    return [body for name, body in BLOCK.findall(text) if name == language]


def commands(text: str) -> list[str]:
    """Calls of our command in a page's shell blocks."""
    lines = "\n".join(blocks("sh", text)).replace("\\\n", " ").splitlines()
    calls = [part.strip() for line in lines for part in line.split("#")[0].split("&&")]
    return [call for call in calls if re.match(r"(venv/bin/)?sumo3dviz-pt ", call)]


def test_two_commands_set_a_fresh_machine_up() -> None:
    first, second = (block.strip() for block in blocks("sh")[:2])
    assert "\n" not in first + second
    assert first.endswith("venv/bin/pip install . && venv/bin/sumo3dviz-pt demo")
    assert second.endswith('venv/bin/pip install -e ".[test]" && venv/bin/pytest -q -n 2')
    with (ROOT / "pyproject.toml").open("rb") as stream:
        assert "test" in tomllib.load(stream)["project"]["optional-dependencies"]
    assert '"$bin/pytest" -q -n 2' in (ROOT / ".ci" / "run").read_text("utf-8")


@pytest.mark.parametrize("page", [ROOT / "README.md", *MANUAL], ids=lambda path: path.name)
def test_commands_exist_with_their_options(page: Path) -> None:
    parser = arguments.build_parser()
    for call in commands(page.read_text(encoding="utf-8")):
        parser.parse_args(shlex.split(call)[1:])


@pytest.mark.parametrize("page", [ROOT / "README.md", *MANUAL], ids=lambda path: path.name)
def test_links_and_pictures_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), target


def test_preset_table_is_current() -> None:
    rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", README, re.M))
    assert set(rows) == set(catalog.template_names("quality"))
    for name, row in rows.items():
        preset = quality_preset(name)
        cells = [cell.strip() for cell in row.split("|")]
        assert cells[:4] == [
            str(preset.spp),
            str(preset.max_depth),
            preset.denoise,
            preset.purpose,
        ]


def test_preset_table_holds_what_was_measured() -> None:
    """CPU-seconds, FLIP and flicker are those of the last run of tests/bench/presets.py."""
    measured = json.loads((ROOT / "docs" / "_bench" / "presets.json").read_text("utf-8"))
    rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", README, re.M))
    assert len(measured["presets"]) >= 4
    for result in measured["presets"]:
        cells = [cell.strip() for cell in rows[result["preset"]].split("|")]
        errors = result["errors"]
        assert cells[4:] == [
            f"{result['later']:.1f}",
            f"{errors['flip']:.3f}",
            f"{errors['flicker_mc']:.1f}",
        ]
        assert result["spp"] == quality_preset(result["preset"]).spp, "measure again"
        assert result["compiled"] == 0


def run(code: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Run an example beside a copy of the bundled scenario, with few pixels and frames."""
    for long, short in SMALLER:
        code = code.replace(long, short)
    shutil.copytree(ROOT / "examples" / "ronda", folder / "examples" / "ronda")
    (folder / "example.py").write_text(code, encoding="utf-8")
    monkeypatch.chdir(folder)
    return runpy.run_path("example.py")


def test_python_example_has_about_ten_lines_and_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (code,) = blocks("python")
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    assert all(long in code for long, _ in SMALLER)
    names = run(code, tmp_path, monkeypatch)
    assert names["image"].radiance.shape == (36, 64, 3)
    assert (tmp_path / "driver.exr").stat().st_size > 0
    assert (tmp_path / "driver.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "drive.mp4").stat().st_size > 0
    assert len(list((tmp_path / "drive.frames").glob("*.exr"))) == 2


def test_python_example_of_the_manual_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = blocks("python", (ROOT / "docs" / "first_film.md").read_text(encoding="utf-8"))
    run(code, tmp_path, monkeypatch)
    assert (tmp_path / "above.png").stat().st_size > 0


def test_cameras_of_the_manual_are_valid() -> None:
    cameras = blocks("yaml", (ROOT / "docs" / "cameras.md").read_text(encoding="utf-8"))
    assert len(cameras) == 3
    for text in cameras:
        settings = {"scenario": {"folder": "."}, "cameras": yaml.safe_load(text)}
        assert make_job(settings).cameras
