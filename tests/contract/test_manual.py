"""The manual's generated pages are what the code says now, and the manual builds."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator

import count_manual as manual_words
import make_gallery as gallery
import make_howto_pictures as howto
import make_reference as reference
import pytest
from manual import DOCS, PAGES, ROOT, text_of

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


# Two books ----------------------------------------------------------------------------------

MOST_WORDS = 30_000
"""Of the users' part; see tools/count_manual.py for how they are counted."""


def test_the_users_part_is_short() -> None:
    counts = {page.name: manual_words.words(page) for page in manual_words.parts()["users"]}
    assert sum(counts.values()) <= MOST_WORDS, counts


def test_every_page_is_in_one_of_the_two_books() -> None:
    parts = {
        name: {page.resolve() for page in pages} for name, pages in manual_words.parts().items()
    }
    assert not parts["users"] & parts["builders"]
    pages = {page for page in DOCS.rglob("*.md") if "_bench" not in page.parts}
    pages -= {page for page in pages if "_build" in page.parts}
    found = {page for part in parts.values() for page in part if "_bench" not in page.parts}
    assert found == pages
    builders = {page.relative_to(DOCS).parts[0] for page in parts["builders"]}
    assert builders == {"internals", "measured", "facts", "_bench"}


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("# One two\n\n| three | 4 |\n|---|---|\n", 3),
        ("One `two three`, [four](a/b.md#c-d) 5 %.", 4),
        ("One\n\n```sh\ntwo three\n```\n\n<!-- four -->\n", 1),
        ("* One\n\n  ```yaml\n  two: three\n  ```\n", 1),
    ],
)
def test_words_are_counted_as_the_tool_says(text: str, count: int, tmp_path) -> None:
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    assert manual_words.words(page) == count


def test_the_glossary_keeps_sixty_words() -> None:
    rows = re.findall(r"^\| (?!word \|)\w", text_of(DOCS / "glossary.md"), re.M)
    assert 40 < len(rows) <= 60


# Pictures -----------------------------------------------------------------------------------


def test_every_picture_is_on_some_page() -> None:
    text = "\n".join(text_of(page) for page in PAGES)
    images = {path.name for path in (DOCS / "images").iterdir()}
    assert not {name for name in images if f"images/{name}" not in text}


def test_howto_pictures_are_small_and_those_of_their_tool() -> None:
    made = {f"howto_{name}.jpg" for name in howto.PICTURES}
    there = {path.name: path.stat().st_size for path in (DOCS / "images").glob("howto_*")}
    assert set(there) == made
    assert max(there.values()) <= howto.MOST_BYTES


# Names of files -----------------------------------------------------------------------------

SOURCES = ("sumo3dviz_pt", "tests", "tools", "examples", "docs")


def modules_named() -> Iterator[tuple[str, str]]:
    """Python files that a page names, with the page."""
    for page in (*PAGES, ROOT / "CONTRIBUTING.md"):
        for name in re.findall(r"[\w./]+\.py\b", text_of(page)):
            yield name, page.relative_to(ROOT).as_posix()


def test_every_python_file_that_a_page_names_exists() -> None:
    there = [path.as_posix() for source in SOURCES for path in (ROOT / source).rglob("*.py")]
    named = sorted(set(modules_named()))
    assert len(named) > 100
    gone = [(n, page) for n, page in named if not any(p.endswith(f"/{n}") for p in there)]
    assert not gone


def test_every_folder_that_the_builders_book_names_exists() -> None:
    """Of names in code that begin with a room of the package."""
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir()} - {"model"}
    gone = []
    for page in (*PAGES, ROOT / "CONTRIBUTING.md"):
        for name in re.findall(r"`([a-z_]+/[a-z_/]+)`", text_of(page)):
            if name.split("/")[0] in rooms:
                place = PACKAGE / name
                there = (
                    place.exists() or place.with_suffix(".py").exists() or (ROOT / name).exists()
                )
                gone += [] if there else [(name, page.name)]
    assert not gone


FIRST_TASKS = 18


def test_contributing_answers_first_tasks_with_files_and_tests() -> None:
    text = text_of(ROOT / "CONTRIBUTING.md")
    section = text.split("### First tasks")[1].split("### Rooms")[0]
    rows = [row for row in section.splitlines() if row.startswith("| ")][1:]
    assert len(rows) >= FIRST_TASKS
    for row in rows:
        *_, tests, _ = row.split("|")
        named = re.findall(r"`(tests/[\w/.]+)`", tests)
        assert named, row
        assert all((ROOT / name).exists() for name in named), row
        assert opened_by(row) or "](#" in row, row


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
