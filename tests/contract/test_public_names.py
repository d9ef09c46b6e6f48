"""What the package shows to the outside, and what it must not load to do so."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import sumo3dviz_pt
from sumo3dviz_pt.job.settings import Job

ROOT = Path(__file__).resolve().parents[2]
HEAVY = ("mitsuba", "drjit", "trimesh", "colour", "matplotlib", "imageio_ffmpeg", "OpenEXR")


def project() -> dict[str, object]:
    with (ROOT / "pyproject.toml").open("rb") as stream:
        table: dict[str, object] = tomllib.load(stream)["project"]
    return table


def loaded_by(code: str) -> set[str]:
    """Heavy packages that a fresh interpreter has loaded after running some code."""
    probe = f"{code}\nimport sys; print('|'.join(n for n in {HEAVY!r} if n in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return {name for name in done.stdout.splitlines()[-1].split("|") if name}


def test_public_names_are_sorted_and_exist() -> None:
    names = sumo3dviz_pt.__all__
    assert names == sorted(names)
    assert len(set(names)) == len(names)
    for name in names:
        assert getattr(sumo3dviz_pt, name).__doc__, name


def test_version_is_said_once_in_all_places() -> None:
    version = sumo3dviz_pt.__version__
    assert project()["version"] == version
    assert re.search(
        rf"^## \[{re.escape(version)}\]", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M
    )
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


def test_importing_loads_nothing_heavy() -> None:
    assert loaded_by("import sumo3dviz_pt") == set()


@pytest.mark.parametrize("arguments", [["--help"], ["render", "--help"], ["--version"]])
def test_help_loads_nothing_heavy(arguments: list[str]) -> None:
    code = (
        "from sumo3dviz_pt.cli import main\n"
        f"try: main({arguments!r})\n"
        "except SystemExit as leaving: assert not leaving.code, leaving.code"
    )
    assert loaded_by(code) == set()


def test_reading_a_scene_file_loads_nothing_heavy() -> None:
    code = (
        "import sumo3dviz_pt as sv\n"
        "from sumo3dviz_pt.pipeline.production import example\n"
        "sv.load(example('ronda'))"
    )
    assert loaded_by(code) == set()


def test_the_command_is_installed_under_its_name() -> None:
    scripts = project()["scripts"]
    assert scripts == {"sumo3dviz-pt": "sumo3dviz_pt.cli:main"}
    done = subprocess.run(
        [sys.executable, "-m", "sumo3dviz_pt.cli", "--version"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert done.stdout.split() == ["sumo3dviz-pt", sumo3dviz_pt.__version__]


def test_every_setting_says_what_it_means_in_the_schema() -> None:
    schema = Job.model_json_schema()
    assert schema["additionalProperties"] is False
    for name, model in {"Job": schema, **schema["$defs"]}.items():
        for key, value in model["properties"].items():
            assert value.get("description") or "$ref" in value or "const" in value, (name, key)
