# ruff: noqa
"""The import rules of the new house, written into pyproject.toml."""

from __future__ import annotations

import tomllib
from pathlib import Path

P = "sumo3dviz_pt"
ROOMS = ("studies", "farm", "recording", "proposals", "report", "viewer", "cli", "api")
STAGES = ("sumo", "motion", "world", "cast", "render", "image", "video", "overlays")
PURE = [f"{P}.studies.designs", f"{P}.studies.tools"]
MOTION = [
    # Contact sheets are written by what writes reports' pictures; motion is drawn by what draws it.
    f"{P}.pipeline.catalogue -> {P}.report.plots",
    f"{P}.pipeline.motion.checks -> {P}.report.motion",
    f"{P}.pipeline.motion.drawing -> {P}.report.machine",
    f"{P}.pipeline.motion.drawing -> {P}.report.motion",
]


def rewrite(root: Path) -> None:
    """Write them."""
    path = root / "pyproject.toml"
    text = path.read_text(encoding="utf-8")
    begin = text.index("[tool.importlinter]")
    linter = tomllib.loads(text)["tool"]["importlinter"]
    contracts = [changed(one) for one in linter.pop("contracts")]
    contracts += [
        {
            "name": "pipeline stands below the rooms on top of it",
            "type": "forbidden",
            "source_modules": [f"{P}.pipeline"],
            "forbidden_modules": [f"{P}.{one}" for one in ROOMS],
            "ignore_imports": MOTION,
        },
        {
            "name": "Rooms on top of pipeline do not import each other",
            "type": "independence",
            "modules": [f"{P}.{one}" for one in ("recording", "proposals", "report", "viewer")],
            "ignore_imports": [f"{P}.recording.recorder -> {P}.api"],
        },
        {
            "name": "studies know no other room",
            "type": "forbidden",
            "source_modules": [f"{P}.studies"],
            "forbidden_modules": [f"{P}.{one}" for one in ROOMS[1:]],
            "ignore_imports": MOTION,
        },
    ]
    out = ["[tool.importlinter]", *(f"{key} = {value(each)}" for key, each in linter.items()), ""]
    for one in contracts:
        out += [
            "[[tool.importlinter.contracts]]",
            *(f"{key} = {value(each)}" for key, each in one.items()),
            "",
        ]
    path.write_text(text[:begin] + "\n".join(out).rstrip("\n") + "\n", encoding="utf-8")


def changed(one: dict) -> dict:
    """A contract with the rooms of today."""
    if one["name"].startswith("experiments"):
        one["name"] = "Designs and files of tools know no scene and no settings"
        one["source_modules"] = PURE
        inner = ("certificate", "measured", "file", "stimuli", "plan", "run")
        one["forbidden_modules"] = [
            *(
                f"{P}.{each}"
                for each in (*STAGES, "job", "shot", "installation", "pipeline", *ROOMS[1:])
            ),
            *(f"{P}.studies.{each}" for each in inner),
        ]
        return one
    outer = one["name"] == "Only pipeline knows the stages"
    for key in ("modules", "source_modules", "forbidden_modules"):
        names = []
        for name in one.get(key, ()):
            last = name.removeprefix(P + ".")
            if last == "experiments":
                names += PURE if outer else [] if key == "modules" else [f"{P}.studies"]
            elif last == "study":
                names += [] if outer else [f"{P}.studies"]
            elif last == "pipeline" and key == "forbidden_modules":
                names += [name, *(f"{P}.{each}" for each in ROOMS[:4])]
            elif last not in ("frame_layers", "recorder"):
                names.append(name)
        if key in one:
            one[key] = list(dict.fromkeys(names))
    return one


def value(each: object) -> str:
    """A value as TOML, lists in lines of a hundred characters."""
    if isinstance(each, bool):
        return str(each).lower()
    if not isinstance(each, list):
        return f'"{each}"'
    words = [f'"{word}"' for word in each]
    if len(", ".join(words)) < 60:
        return f"[{', '.join(words)}]"
    lines, line = [], "   "
    for word in words:
        if len(line) + len(word) + 2 > 100:
            lines.append(line)
            line = "   "
        line += f" {word},"
    return "[\n" + "\n".join([*lines, line]) + "\n]"
