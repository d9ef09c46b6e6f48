"""What the world sees of this repository: its top level, and its front page on an index."""

from __future__ import annotations

import re
import subprocess
import tomllib
from typing import Any

import pytest
import yaml
from manual import ROOT, text_of
from needed import package

TOP = {
    *(".ci", ".dockerignore", ".gitattributes", ".github", ".gitignore", ".readthedocs.yaml"),
    ".zenodo.json",
    *("CHANGELOG.md", "CITATION.cff", "CODE_OF_CONDUCT.md", "CONTRIBUTING.md", "Containerfile"),
    *("GOVERNANCE.md", "LICENSE", "NOTICE", "README.md", "SECURITY.md", "SUPPORT.md"),
    *("constraints.txt", "environment.yml", "hatch_build.py", "paper.bib", "paper.md"),
    "pyproject.toml",
    *("assets", "conda", "docs", "examples", "scene_templates", "sumo3dviz_pt", "tests", "tools"),
}
"""All names at the top; whoever adds one says so here."""

LINK = re.compile(r"\]\(([^)\s]+)\)")


def project() -> dict[str, Any]:
    return tomllib.loads(text_of(ROOT / "pyproject.toml"))["project"]


def test_nothing_lies_about_at_the_top() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("no git repository here")
    words = ["git", "-C", str(ROOT), "ls-tree", "--name-only", "-z", "HEAD"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    names = [name for name in done.stdout.split("\0") if name]
    assert set(names) == TOP


# The index ---------------------------------------------------------------------------------


def built() -> Any:
    """The metadata that wheel and sdist hold."""
    core = package("hatchling.metadata.core")
    plugins = package("hatchling.plugin.manager")
    return core.ProjectMetadata(str(ROOT), plugins.PluginManager()).core


def test_links_on_an_index_lead_to_files_of_this_version() -> None:
    description, base = built().readme, project()["urls"]["Repository"]
    targets = LINK.findall(description)
    assert len(targets) == len(LINK.findall(text_of(ROOT / "README.md"))) > 40
    assert all(target.startswith("https://") for target in targets)
    found = re.findall(rf"(!?)\[[^\[\]]*\]\({base}/(raw|blob)/v([\d.]+)/([^)#]+)", description)
    assert len(found) > 40
    for picture, kind, version, place in found:
        assert kind == ("raw" if picture else "blob")
        assert version == project()["version"]
        assert (ROOT / place).is_file(), place


def test_all_own_addresses_lie_below_one() -> None:
    urls = project()["urls"]
    base = urls["Repository"]
    assert set(urls) >= {"Homepage", "Repository", "Issues", "Documentation", "Changelog"}
    own = [urls[name] for name in ("Homepage", "Issues", "Documentation", "Changelog")]
    own += re.findall(r"https://github\.com/[\w./-]+", text_of(ROOT / "README.md"))
    assert all(address == base or address.startswith(f"{base}/") for address in own)
    for address in own:
        place = re.fullmatch(rf"{base}/blob/main/(.+)", address)
        assert place is None or (ROOT / place[1]).is_file(), address
        flow = re.fullmatch(rf"{base}/actions/workflows/([\w.]+)(/badge\.svg)?", address)
        assert flow is None or (ROOT / ".github" / "workflows" / flow[1]).is_file(), address


def test_classifiers_say_which_pythons() -> None:
    made = project()
    said = [
        re.fullmatch(r"Programming Language :: Python :: 3\.(\d+)", c) for c in made["classifiers"]
    ]
    minors = [int(each[1]) for each in said if each]
    assert minors == list(range(minors[0], minors[-1] + 1))
    assert made["requires-python"] == f">=3.{minors[0]}"
    assert f"python-3.{minors[0]}_to_3.{minors[-1]}-" in text_of(ROOT / "README.md")
    typed = "Typing :: Typed" in made["classifiers"]
    assert typed == (ROOT / "sumo3dviz_pt" / "py.typed").is_file() is True


# Pages for people --------------------------------------------------------------------------

PAGES = ("CODE_OF_CONDUCT", "CONTRIBUTING", "GOVERNANCE", "SECURITY", "SUPPORT")
FORMS = ROOT / ".github" / "ISSUE_TEMPLATE"


@pytest.mark.parametrize("name", [f"{page}.md" for page in PAGES])
def test_pages_for_people_are_found_and_their_links_resolve(name: str) -> None:
    assert f"]({name})" in text_of(ROOT / "README.md")
    text = text_of(ROOT / name)
    named = re.findall(r"`((?:tests|docs)/[\w/.]+)`", text)
    assert not [each for each in named if not (ROOT / each).exists()]
    for target in LINK.findall(text):
        if not target.startswith(("https://", "#", "mailto:")):
            assert (ROOT / target.partition("#")[0]).exists(), target


def test_issue_forms_ask_for_what_doctor_and_check_say() -> None:
    forms = {path.stem: yaml.safe_load(text_of(path)) for path in FORMS.glob("*.yml")}
    assert forms.pop("config")["blank_issues_enabled"] is False
    assert set(forms) == {"bug", "feature", "question"}
    for form in forms.values():
        assert form["name"] and form["description"]
        fields = [each for each in form["body"] if each["type"] != "markdown"]
        assert len({each["id"] for each in fields}) == len(fields) >= 2
        assert all(each["attributes"]["label"] for each in fields)
        assert any(each.get("validations", {}).get("required") for each in fields)
    for name in ("bug", "question"):
        text = text_of(FORMS / f"{name}.yml")
        assert "sumo3dviz-pt doctor" in text and "sumo3dviz-pt check" in text
