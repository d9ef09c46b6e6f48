"""The manual's generated pages are what the code says now, and the manual builds."""

from __future__ import annotations

import importlib
import re

import make_gallery as gallery
import make_reference as reference
import pytest
from manual import DOCS, ROOT, text_of

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import Job, Quality

PACKAGE = ROOT / "sumo3dviz_pt"
CLASSES = re.findall(r"autoclass:: (sumo3dviz_pt\S+)", (DOCS / "api.md").read_text("utf-8"))
COMMANDS = (
    "demo", "init", "check", "still", "render", "develop", "converge", "report", "compare",
    "motion", "view", "doctor", "vehicles", "completion", "schema", "study", "farm",
)  # fmt: skip


def test_reference_pages_are_current() -> None:
    stale = reference.out_of_date()
    assert not stale, "run: python tools/make_reference.py"


def test_every_key_of_the_scene_file_is_described() -> None:
    page = reference.scene_file()
    models = [Job.model_json_schema(), Quality.model_json_schema()]
    models += Job.model_json_schema()["$defs"].values()
    for model in models:
        for key in model["properties"]:
            assert f"| `{key}` |" in page, key


def test_every_command_and_option_is_described() -> None:
    page = reference.command_line()
    for name in COMMANDS:
        assert f"\n## {name}\n" in page
    assert "`--set KEY.PATH=VALUE`" in page


@pytest.mark.parametrize("page", ["gallery.md", "templates.md"])
def test_pages_of_pictures_show_what_their_script_makes(page: str) -> None:
    assert (DOCS / page).read_text(encoding="utf-8") == gallery.PAGES[page]()
    for name in (*gallery.ALL, *gallery.TELL_TALES):
        assert 0 < (DOCS / "images" / f"{name}.jpg").stat().st_size < 1_300_000


def test_every_template_and_sky_has_its_picture_or_row() -> None:
    page = (DOCS / "templates.md").read_text(encoding="utf-8")
    for name in catalog.template_names("scene"):
        assert f"\n## {name}\n" in page and f"](images/template_{name}.jpg)" in page
    for name in catalog.template_names("sky"):
        assert f"\n| `{name}` | " in page


def test_contributing_names_places_that_are_there() -> None:
    text = text_of(ROOT / "CONTRIBUTING.md")
    named = [name for quoted in re.findall(r"`([a-z_/{},.]+)`", text) for name in spread(quoted)]
    places = [name for name in named if "/" in name and not name.startswith("tests/")]
    assert len(places) > 40
    missing = [n for n in places if not any((root / n).exists() for root in (ROOT, PACKAGE))]
    assert not missing


def test_contributing_names_what_is_defined_in_its_row() -> None:
    """A class or table stands in a file or folder that the same row opens."""
    rows = [row for row in text_of(ROOT / "CONTRIBUTING.md").splitlines() if row.startswith("| ")]
    named = [(row, name) for row in rows for name in re.findall(r"`([A-Z]\w+)`", row)]
    assert len(named) >= 7
    for row, name in named:
        places = [root / each for each in opened_by(row) for root in (PACKAGE, ROOT)]
        files = [file for place in places for file in (place, *place.glob("*.py"))]
        texts = (text_of(file) for file in files if file.is_file())
        defined = re.compile(rf"^(class )?{name}\b( =|:|\()", re.M)
        assert any(defined.search(text) for text in texts), f"{name}: {row}"


def opened_by(row: str) -> list[str]:
    """Files and folders that a row of the table names."""
    return [name for quoted in re.findall(r"`([a-z_/{},.]+)`", row) for name in spread(quoted)]


def test_pages_that_the_code_cites_are_there() -> None:
    for path in PACKAGE.rglob("*.py"):
        for name in re.findall(r"\bdocs/[\w/.]+\.md", path.read_text(encoding="utf-8")):
            assert (ROOT / name).exists(), f"{path.name}: {name}"


def spread(name: str) -> list[str]:
    """`a/{b,c}` as its two meanings."""
    found = re.fullmatch(r"(.*)\{(.*)\}(.*)", name)
    if found is None:
        return [name]
    return [f"{found[1]}{word}{found[3]}" for word in found[2].split(",")]


@pytest.mark.parametrize("name", CLASSES)
def test_classes_that_the_manual_shows_exist(name: str) -> None:
    module, _, own = name.rpartition(".")
    assert hasattr(importlib.import_module(module), own)
