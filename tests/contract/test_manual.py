"""The manual's generated pages are what the code says now, and the manual builds."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

from sumo3dviz_pt.job import Job, Quality

COMMANDS = (
    "demo", "init", "check", "still", "render", "develop", "converge", "report", "motion", "view",
    "doctor",
)  # fmt: skip
DOCS = Path(__file__).resolve().parents[2] / "docs"


def script(name: str) -> ModuleType:
    """One of the manual's scripts as a module."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", DOCS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_reference_pages_are_current() -> None:
    stale = script("make_reference").out_of_date()
    assert not stale, "run: python docs/make_reference.py"


def test_every_key_of_the_scene_file_is_described() -> None:
    page = script("make_reference").scene_file()
    models = [Job.model_json_schema(), Quality.model_json_schema()]
    models += Job.model_json_schema()["$defs"].values()
    for model in models:
        for key in model["properties"]:
            assert f"| `{key}` |" in page, key


def test_every_command_and_option_is_described() -> None:
    page = script("make_reference").command_line()
    for name in COMMANDS:
        assert f"\n## {name}\n" in page
    assert "`--set KEY.PATH=VALUE`" in page


def test_gallery_shows_what_its_script_makes() -> None:
    gallery = script("make_gallery")
    assert (DOCS / "gallery.md").read_text(encoding="utf-8") == gallery.page()
    for name in (*gallery.PICTURES, *gallery.TELL_TALES):
        assert 0 < (DOCS / "images" / f"{name}.jpg").stat().st_size < 1_300_000
