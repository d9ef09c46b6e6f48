"""NOTICE names all that pip installs beside this package, and nothing else."""

from __future__ import annotations

import make_notice
import pytest
import yaml
from manual import text_of
from needed import lacking

SAID = yaml.safe_load(text_of(make_notice.SAID))
TEXT = text_of(make_notice.NOTICE)
REQUIRED = [
    *make_notice.PROJECT["dependencies"],
    *(text for texts in make_notice.PROJECT["optional-dependencies"].values() for text in texts),
]


def test_what_pip_installs_is_named() -> None:
    missing = set(make_notice.reached(REQUIRED)) - make_notice.named(TEXT)
    assert not missing, f"python tools/make_notice.py: {sorted(missing)}"


def test_no_name_is_gone() -> None:
    reached = make_notice.reached(REQUIRED)
    unknown = {name for name, here in reached.items() if not here} - set(SAID["elsewhere"])
    if unknown:
        lacking(f"not installed, so what they need is unknown: {sorted(unknown)}")
    assert make_notice.named(TEXT) <= set(reached) | set(SAID["elsewhere"])


@pytest.mark.parametrize("name", sorted(SAID["bring"]))
def test_what_packages_bring_along_is_said(name: str) -> None:
    assert name in make_notice.named(TEXT)
    said = " ".join(TEXT.split("What some of them bring along:")[1].split())
    assert f"* {name}: {' '.join(SAID['bring'][name].split())}" in said


def test_requirements_are_followed_on_all_systems() -> None:
    """tqdm asks for colorama on Windows alone; an extra that nobody asked for stays away."""
    reached = make_notice.reached(["tqdm>=4"])
    assert set(reached) == {"tqdm", "colorama"}
    assert "pandas" not in reached


def test_unknown_licences_stop_the_tool() -> None:
    empty = {"licences": {}, "elsewhere": {}}
    assert make_notice.licence_of("pydantic", empty) == "MIT"
    with pytest.raises(SystemExit, match="no-such-package is not installed"):
        make_notice.licence_of("no-such-package", empty)
    with pytest.raises(SystemExit, match="metadata of openexr name no licence"):
        make_notice.licence_of("openexr", empty)
