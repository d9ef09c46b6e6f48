"""What is said about this package outside of it agrees with what it is."""

from __future__ import annotations

import json
import re
import tomllib
from typing import Any

import pytest
import yaml
from manual import DOCS, ROOT, text_of

import sumo3dviz_pt
from sumo3dviz_pt.errors import MissingExtraError
from sumo3dviz_pt.installation.packages import MANAGERS

FOUNDING = "sumo3Dviz: A three dimensional traffic visualisation"
ARXIV = "2604.19194"
WHEEL = f"sumo3dviz_pt-{sumo3dviz_pt.__version__}-py3-none-any.whl"

CONDA = {"OpenEXR": "openexr-python", "mapbox-earcut": "mapbox_earcut", "tzdata": "python-tzdata"}
"""conda-forge's names where they are not pip's."""


def project() -> dict[str, Any]:
    return tomllib.loads(text_of(ROOT / "pyproject.toml"))["project"]


def recipe() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(text_of(ROOT / "conda" / "recipe" / "recipe.yaml"))
    return found


# Conda -------------------------------------------------------------------------------------


def test_condas_recipe_has_pips_requirements() -> None:
    wanted = {}
    for text in project()["dependencies"]:
        if ";" in text:  # conda-forge builds packages of its own, of the source
            continue
        name, limits = re.fullmatch(r"([\w.-]+?)([<>=].*)", text).groups()
        wanted[CONDA.get(name, name.lower())] = limits
    run = [item for item in recipe()["requirements"]["run"] if isinstance(item, str)]
    found = dict(item.split(" ", 1) for item in run)
    assert found.pop("python") == ">=${{ python_min }}"
    assert f">={recipe()['context']['python_min']}" == project()["requires-python"]
    assert found == wanted


@pytest.mark.parametrize("system", ["linux", "osx", "win"])
def test_condas_recipe_has_the_shared_libraries(system: str) -> None:
    chosen = [item for item in recipe()["requirements"]["run"] if isinstance(item, dict)]
    (then,) = [item["then"] for item in chosen if item["if"] == system]
    platform = {"osx": "darwin", "win": "win32"}.get(system, system)
    (manager,) = [one for one in MANAGERS if one.name == "conda" and platform in one.systems]
    assert then == [f"__{system}", *manager.packages.values()]
    forge = yaml.safe_load(text_of(ROOT / "conda" / "recipe" / "conda-forge.yml"))
    assert f"{system}_64" in forge["noarch_platforms"]


def test_condas_packages_hold_no_program_of_one_processor() -> None:
    """What is the same everywhere may be named so: `noarch`."""
    assert recipe()["build"]["noarch"] == "python"
    heads = (b"\x7fELF", b"MZ", b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe", b"!<arch>")
    for folder in ("sumo3dviz_pt", "assets", "scene_templates", "examples"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                with path.open("rb") as file:
                    assert not file.read(7).startswith(heads), path


def test_condas_recipe_is_of_this_package() -> None:
    made = recipe()
    scripts = [f"{name} = {target}" for name, target in project()["scripts"].items()]
    of_ours = {"name": project()["name"], "version": sumo3dviz_pt.__version__}
    assert of_ours.items() <= made["context"].items()
    assert made["build"]["python"]["entry_points"] == scripts
    assert made["about"]["license"] == project()["license"]
    assert made["about"]["license_file"] == project()["license-files"]
    assert made["about"]["summary"] == project()["description"]
    for key in ("Homepage", "Repository", "Documentation"):
        assert made["about"][key.lower()] == project()["urls"][key]


# Names, papers -----------------------------------------------------------------------------


def test_the_founding_paper_is_named_alike_everywhere() -> None:
    cited = yaml.safe_load(text_of(ROOT / "CITATION.cff"))["references"][0]
    assert cited["title"] == FOUNDING
    assert cited["url"] == project()["urls"]["Founding paper"] == f"https://arxiv.org/abs/{ARXIV}"
    pages = ("README.md", "docs/motion.md", "docs/references.md", "docs/howto/from_sumo3dviz.md")
    for name in (*pages, "paper.bib"):
        text = " ".join(text_of(ROOT / name).replace("{", "").replace("}", "").split())
        assert FOUNDING in text and ARXIV in text, name
    for page in [ROOT / "README.md", *DOCS.rglob("*.md")]:
        assert "ounding paper's" not in text_of(page), page


def test_citation_has_the_facts_and_nothing_else() -> None:
    cited = yaml.safe_load(text_of(ROOT / "CITATION.cff"))
    assert cited["license"] == project()["license"]
    assert cited["abstract"].startswith(project()["name"])
    assert [author["name"] for author in cited["authors"]] == [
        author["name"] for author in project()["authors"]
    ]
    assert not {"doi", "date-released", "repository-code"} & set(cited)
    for reference in cited["references"]:
        assert reference["authors"] and reference["year"] and reference["type"]


SECTIONS = [
    *("Summary", "Statement of need", "State of the field", "Software design"),
    *("Research impact statement", "AI usage disclosure", "Acknowledgements", "References"),
]
"""Of a paper, as the Journal of Open Source Software asks; it has 750 to 1750 words."""


def test_the_paper_has_the_form_that_its_journal_asks_for() -> None:
    """Figures: test_measured_figures.py."""
    _, head, text = text_of(ROOT / "paper.md").split("---\n", 2)
    said = yaml.safe_load(head)
    assert [author["name"] for author in said["authors"]] == [
        author["name"] for author in project()["authors"]
    ]
    places = {place["index"] for place in said["affiliations"] if place["name"]}
    assert {author["affiliation"] for author in said["authors"]} == places
    assert re.fullmatch(r"\d{1,2} [A-Z][a-z]+ 20\d\d", said["date"]) and said["tags"]
    assert re.findall(r"^# (.*)$", text, re.M) == SECTIONS
    assert 750 <= len(text.split()) <= 1750
    library = text_of(ROOT / said["bibliography"])
    known = set(re.findall(r"^@\w+\{(\w+),", library, re.M))
    assert set(re.findall(r"@(\w+)", text)) == known
    assert library.count("author = {") == library.count("year = {") == len(known)
    scripts = re.findall(r"`(tests/bench/\w+\.py)`", text)
    assert scripts and all((ROOT / script).is_file() for script in scripts)


# Extras ------------------------------------------------------------------------------------


@pytest.mark.parametrize("extra", ["viewer", "report"])
def test_extras_are_installed_as_the_error_says(extra: str) -> None:
    assert extra in project()["optional-dependencies"]
    said = str(MissingExtraError("x needs y", extra=extra))
    assert said.startswith(f'x needs y: pip install ".[{extra}]" in a checkout, pip install "')
    assert f'.whl[{extra}]" with a wheel' in said


def test_the_manual_names_this_versions_wheel() -> None:
    named = [
        found
        for page in [ROOT / "README.md", *DOCS.rglob("*.md")]
        for found in re.findall(r"[\w.-]+\.whl", text_of(page))
    ]
    assert named and set(named) == {WHEEL}


# Where it is published ----------------------------------------------------------------------


def test_zenodo_says_what_the_citation_says() -> None:
    deposit = json.loads(text_of(ROOT / ".zenodo.json"))
    cited = yaml.safe_load(text_of(ROOT / "CITATION.cff"))
    assert deposit["title"] == cited["title"] and deposit["keywords"] == cited["keywords"]
    assert deposit["version"] == cited["version"] == sumo3dviz_pt.__version__
    assert deposit["license"] == cited["license"] == project()["license"]
    assert deposit["creators"] == cited["authors"]
    assert deposit["description"] == cited["abstract"].strip()
    founding = f"10.48550/arXiv.{ARXIV}"
    assert [one["identifier"] for one in deposit["related_identifiers"]] == [founding]


def test_the_published_manual_is_built_as_ours() -> None:
    said = yaml.safe_load(text_of(ROOT / ".readthedocs.yaml"))
    assert (ROOT / said["sphinx"]["configuration"]).is_file() and said["sphinx"]["fail_on_warning"]
    (installed,) = said["python"]["install"]
    assert set(installed["extra_requirements"]) <= set(project()["optional-dependencies"])
    named = f"Programming Language :: Python :: {said['build']['tools']['python']}"
    assert named in project()["classifiers"]
