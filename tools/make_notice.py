"""Writes NOTICE: what pip installs beside this package, under which licences.

    python tools/make_notice.py

It follows pyproject.toml's dependencies and extras through the metadata of what is installed here,
for Linux, macOS and Windows and for every Python that pyproject.toml names. What metadata do not
say stands in tools/release/notice.yaml. All extras have to be installed: pip install -e ".[dev]".
"""

from __future__ import annotations

import re
import textwrap
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from itertools import product
from pathlib import Path
from typing import Any

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
NOTICE = ROOT / "NOTICE"
SAID = ROOT / "tools" / "release" / "notice.yaml"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
DEVELOPERS = ("test", "docs", "dev")
"""Extras of those who work on the code."""

_SYSTEMS = (
    {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix"},
    {"sys_platform": "darwin", "platform_system": "Darwin", "os_name": "posix"},
    {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt"},
)
_PYTHONS = [
    found[1]
    for line in PROJECT["classifiers"]
    if (found := re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", line))
]
_SPDX = {
    "3-Clause BSD License": "BSD-3-Clause",
    "Apache 2.0": "Apache-2.0",
    "Apache Software License": "Apache-2.0",
    "BSD 2-Clause License": "BSD-2-Clause",
    "ISC License (ISCL)": "ISC",
    "ISC license": "ISC",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}
"""Names of licences in metadata that are no SPDX expressions."""

_HEAD = """\
sumo3dviz_pt
Copyright (c) 2026, The sumo3dviz_pt developers
Licensed under the BSD 3-Clause License (see LICENSE).

All meshes, textures, skies and example scenarios in this distribution were made by
the code of this project and carry the same licence.

The tone curve `neutral` follows the Khronos PBR Neutral specification. SUMO's file
formats are read by code of our own; no code of Eclipse SUMO (EPL-2.0) is contained or
needed.

None of the following is part of this distribution. pip installs it beside it, and each
stays under its own licence. This list is made by tools/make_notice.py.
"""


def reached(requirements: Iterable[str]) -> dict[str, bool]:
    """Return the packages that requirements lead to, and whether each is installed here."""
    found: dict[str, bool] = {}
    waiting, seen = [Requirement(text) for text in requirements], set[tuple[str, str]]()
    while waiting:
        one = waiting.pop()
        name = canonicalize_name(one.name)
        key = (name, ",".join(sorted(one.extras)))
        if key in seen:
            continue
        seen.add(key)
        if name == canonicalize_name(PROJECT["name"]):
            texts = [text for extra in one.extras for text in extra_of(extra)]
            waiting += map(Requirement, texts)
            continue
        found[name] = installed(name)
        waiting += needs(name, one.extras) if found[name] else ()
    return found


def extra_of(name: str) -> list[str]:
    """Return the requirements of one of our extras."""
    texts: list[str] = PROJECT["optional-dependencies"][name]
    return texts


def needs(name: str, extras: Iterable[str]) -> Iterator[Requirement]:
    """Yield what an installed package requires on any system and any of our Pythons."""
    for text in metadata.requires(name) or []:
        one = Requirement(text)
        places = product(_SYSTEMS, _PYTHONS, ["", *extras])
        if one.marker is None or any(
            one.marker.evaluate(
                {**system, "python_version": python, "python_full_version": f"{python}.0"}
                | {"extra": extra}
            )
            for system, python, extra in places
        ):
            yield one


def installed(name: str) -> bool:
    """Return whether there are metadata of a package here."""
    try:
        metadata.distribution(name)
    except metadata.PackageNotFoundError:
        return False
    return True


def licence_of(name: str, said: Mapping[str, Any]) -> str:
    """Return the licence of a package, as an SPDX expression where its metadata allow it.

    Raises:
        SystemExit: If nobody says it.
    """
    known = {**said["elsewhere"], **said["licences"]}.get(name)
    if known:
        return str(known)
    if not installed(name):
        raise SystemExit(f"{name} is not installed: pip install -e .[dev], or name it in {SAID}")
    expression, text = _field(name, "License-Expression"), _field(name, "License")
    classes = re.findall(r"^License :: .*?([^:]+)$", _field(name, "Classifier"), re.M)
    short = text if len(text) < 40 and text != "UNKNOWN" else ""
    licence = expression or short or " AND ".join(one.strip() for one in classes)
    if licence in {"", "OSI Approved"}:
        raise SystemExit(f"metadata of {name} name no licence: write it into {SAID}")
    if licence in {"BSD", "BSD License"}:
        return _clauses(name, text + _files(name))
    return _SPDX.get(licence, licence)


def _field(name: str, field: str) -> str:
    """Return what the metadata of a package say, by line."""
    return "\n".join(metadata.metadata(name).get_all(field) or []).strip()


def _clauses(name: str, text: str) -> str:
    """Return which BSD licence a text is: the one of three clauses forbids use of names."""
    if "Redistribution" not in text:
        raise SystemExit(f"{name} is under a BSD licence, but which? Write it into {SAID}")
    three = re.search(r"\bname|\bnames", text.split("Redistribution", 1)[1].split("WARRANT")[0])
    return "BSD-3-Clause" if three else "BSD-2-Clause"


def _files(name: str) -> str:
    """Return the text of a package's own licence files."""
    paths = [
        Path(str(path.locate()))
        for path in metadata.files(name) or []
        if re.search(r"dist-info/.*(licen[sc]e|copying)", str(path), re.I)
    ]
    return "\n".join(path.read_text("utf-8", errors="replace") for path in paths if path.is_file())


def groups() -> Iterator[tuple[str, list[str]]]:
    """Yield headings and the packages below, each where it comes first."""
    extras = PROJECT["optional-dependencies"]
    wanted = [("Always:", PROJECT["dependencies"])]
    wanted += [(f"With the extra {one}:", extras[one]) for one in extras if one not in DEVELOPERS]
    wanted.append(("To work on the code:", [text for one in DEVELOPERS for text in extras[one]]))
    known = set[str]()
    for title, requirements in wanted:
        names = sorted(set(reached(requirements)) - known)
        known.update(names)
        yield title, names


def written() -> str:
    """Return the text of NOTICE."""
    said = yaml.safe_load(SAID.read_text("utf-8"))
    parts = [_HEAD]
    for title, names in groups():
        by_licence: dict[str, list[str]] = {}
        for name in names:
            by_licence.setdefault(licence_of(name, said), []).append(name)
        lines = [
            _wrapped(f"{licence}: {', '.join(by_licence[licence])}", "* ")
            for licence in sorted(by_licence)
        ]
        parts.append("\n".join([title, *lines]) + "\n")
    brought = [_wrapped(f"{name}: {text}", "* ") for name, text in said["bring"].items()]
    parts.append("\n".join(["What some of them bring along:", *brought]) + "\n")
    system = [_wrapped(f"{name}: {text}", "* ") for name, text in said["systems"].items()]
    parts.append("\n".join(["Of the system, not by pip:", *system]) + "\n")
    return "\n".join(parts)


def named(text: str) -> set[str]:
    """Return the packages that a NOTICE names under a licence."""
    lists = re.split(r"^What some of them", text.removeprefix(_HEAD), flags=re.M)[0]
    items = re.findall(r"^\* [^:]+:((?:.|\n  )*)", lists, re.M)
    return {name.strip() for item in items for name in item.split(",")}


def _wrapped(text: str, mark: str) -> str:
    return textwrap.fill(
        text,
        88,
        initial_indent=mark,
        subsequent_indent="  ",
        break_on_hyphens=False,
        break_long_words=False,
    )


if __name__ == "__main__":
    NOTICE.write_text(written(), "utf-8")
    print(f"{NOTICE}: {len(named(NOTICE.read_text('utf-8')))} packages")
