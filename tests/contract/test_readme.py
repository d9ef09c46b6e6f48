"""The README's commands, example and tables do what they say."""

from __future__ import annotations

import json
import re
import runpy
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest
from builders import write_scenario
from manual import DOCS, ROOT, blocks, text_of

from sumo3dviz_pt import catalog
from sumo3dviz_pt.pipeline.scene_file import load_job, quality_preset

README = text_of(ROOT / "README.md")
SMALLER = {"(960, 540)": "(64, 36)", "(640, 360)": "(64, 36)", "end=462": "end=460.08"}
"""What examples are changed to, so that they render few pixels and frames."""

STREET = {
    "examples/ronda/scene.yaml": "scene.yaml",
    "time=460": "time=4",
    "start=460": "start=4",
    "end=460.08": "end=4.2",
}
"""The same of a street with a few cars, for a tenth of the time; the notebook films ronda."""


def test_two_commands_set_a_fresh_machine_up() -> None:
    first, second = (block.strip() for block in blocks("sh", README)[:2])
    assert "\n" not in first + second
    mend = "venv/bin/sumo3dviz-pt doctor --install --yes"
    assert first.endswith(f"venv/bin/pip install . && {mend} && venv/bin/sumo3dviz-pt demo")
    assert second.endswith(
        f'venv/bin/pip install -e ".[test]" && {mend} && venv/bin/pytest -q -n 2'
    )
    with (ROOT / "pyproject.toml").open("rb") as stream:
        assert "test" in tomllib.load(stream)["project"]["optional-dependencies"]
    assert '"$bin/pytest" -q -n 2' in (ROOT / ".ci" / "run").read_text("utf-8")


def test_preset_table_is_current() -> None:
    rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", README, re.M))
    assert set(rows) == set(catalog.template_names("quality"))
    for name, row in rows.items():
        preset = quality_preset(name, together=True)
        cells = [cell.strip() for cell in row.split("|")]
        assert cells[:4] == [
            f"{preset.spp} ({preset.alone})" if preset.alone else str(preset.spp),
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
        preset = quality_preset(result["preset"], together=True)
        assert result["spp"] == preset.spp, "measure again"
        assert result["compiled"] == 0


def replaced(code: str, changes: dict[str, str]) -> str:
    """Code in which some words are others."""
    for old, new in changes.items():
        code = code.replace(old, new)
    return code


def run(code: str, scene: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Run an example beside a street, or a copy of the bundled scenario, with few pixels."""
    job = load_job(ROOT / "examples" / "ronda" / "scene.yaml")
    assert set(re.findall(r'camera="(\w+)"', code)) <= set(job.cameras)
    code = replaced(code, SMALLER)
    if scene == "street":
        write_scenario(folder, vehicles=4)
        code = replaced(code, STREET)
        assert "ronda" not in code
    else:
        shutil.copytree(ROOT / "examples" / scene, folder / "examples" / scene)
    (folder / "example.py").write_text(code, encoding="utf-8")
    monkeypatch.chdir(folder)
    return runpy.run_path("example.py")


def test_python_example_has_about_ten_lines_and_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (code,) = blocks("python", README)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    assert all(long in code for long in SMALLER)
    names = run(code, "street", tmp_path, monkeypatch)
    assert names["image"].radiance.shape == (36, 64, 3)
    assert (tmp_path / "driver.exr").stat().st_size > 0
    assert (tmp_path / "driver.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "drive.mp4").stat().st_size > 0
    assert len(list((tmp_path / "drive.frames").glob("*.exr"))) == 2


@pytest.mark.slow
def test_python_example_of_the_manual_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = blocks("python", text_of(DOCS / "first_film.md"))
    run(code, "ronda", tmp_path, monkeypatch)
    assert (tmp_path / "above.png").stat().st_size > 0
