# ruff: noqa
"""The import rules of the new house, written into pyproject.toml."""

from __future__ import annotations

import re
from pathlib import Path

P = "sumo3dviz_pt"
ROOMS = ("studies", "farm", "recording", "proposals", "report", "viewer", "cli", "api")
STAGES = ("sumo", "motion", "world", "cast", "render", "image", "video", "overlays")
PURE = ("studies.designs", "studies.tools")

NEW = """
[[tool.importlinter.contracts]]
name = "pipeline stands below the rooms on top of it"
type = "forbidden"
source_modules = ["{P}.pipeline"]
forbidden_modules = [
{forbidden}
]
ignore_imports = [
    # Contact sheets are written by what writes reports' pictures; motion is drawn by what draws it.
    "{P}.pipeline.catalogue -> {P}.report.plots",
    "{P}.pipeline.motion.checks -> {P}.report.motion",
    "{P}.pipeline.motion.drawing -> {P}.report.machine",
    "{P}.pipeline.motion.drawing -> {P}.report.motion",
]

[[tool.importlinter.contracts]]
name = "Rooms on top of pipeline do not import each other"
type = "independence"
modules = [
    "{P}.recording", "{P}.proposals", "{P}.report", "{P}.viewer",
]
ignore_imports = [
    # A recorder hands its scene to the Python API, which opens viewers and stimulus reports.
    "{P}.recording.recorder -> {P}.api",
]

[[tool.importlinter.contracts]]
name = "studies know no farm"
type = "forbidden"
source_modules = ["{P}.studies"]
forbidden_modules = ["{P}.farm", "{P}.recording", "{P}.proposals", "{P}.report", "{P}.viewer"]
ignore_imports = [
    "{P}.pipeline.catalogue -> {P}.report.plots",
]
"""


def listed(names: tuple[str, ...], indent: str = "    ") -> str:
    return "\n".join(f'{indent}"{P}.{name}",' for name in names)


def rewrite(root: Path) -> None:
    """Write them."""
    path = root / "pyproject.toml"
    text = path.read_text(encoding="utf-8")
    begin = text.index("[tool.importlinter]")
    head, rules = text[:begin], text[begin:]
    blocks = re.split(r"(?m)^(?=\[\[tool\.importlinter\.contracts\]\]$)", rules)
    out = []
    for block in blocks:
        if 'name = "Stages never import each other"' in block:
            block = re.sub(rf'\n *"{P}\.(experiments|studies)",', "", block)
        elif 'name = "experiments know no scene' in block:
            block = (
                '[[tool.importlinter.contracts]]\n'
                'name = "Designs and files of tools know no scene and no settings"\n'
                'type = "forbidden"\n'
                "source_modules = [\n" + listed(PURE) + "\n]\n"
                "forbidden_modules = [\n"
                + listed((*STAGES, "job", "shot", "installation", "pipeline", *ROOMS[1:]))
                + "\n"
                + listed(tuple(f"studies.{one}" for one in ("certificate", "measured", "file", "stimuli", "plan", "run")))
                + "\n]\n\n"
            )
        else:
            block = re.sub(rf'"{P}\.(experiments|studies)"(?=[,\s\]])', f'"{P}.studies"', block)
            block = re.sub(rf'"{P}\.study"', f'"{P}.studies"', block)
            block = block.replace(f'"{P}.frame_layers"', "").replace(f'"{P}.recorder"', "")
            if f'"{P}.pipeline"' in block and "forbidden_modules" in block:
                block = _with_rooms(block)
            if 'name = "Only pipeline knows the stages"' in block:
                source, forbidden = block.split("forbidden_modules", 1)
                source = re.sub(rf' "{P}\.studies",', "", source)
                forbidden = forbidden.replace(
                    f'"{P}.studies"', ", ".join(f'"{P}.{one}"' for one in PURE)
                )
                block = source + "forbidden_modules" + forbidden
        out.append(block)
    rules = "".join(out).rstrip("\n") + "\n"
    text = head + rules + NEW.format(P=P, forbidden=listed(ROOMS))
    path.write_text(text, encoding="utf-8")


def _with_rooms(block: str) -> str:
    """Whoever may not import pipeline may not import what stands on it."""
    source, forbidden = block.split("forbidden_modules", 1)
    for room in ("farm", "recording", "proposals"):
        name = f'"{P}.{room}"'
        if name not in forbidden:
            forbidden = forbidden.replace(f'"{P}.pipeline"', f'"{P}.pipeline", {name}', 1)
    parts = forbidden.split(f'"{P}.studies"')
    if len(parts) > 2:
        forbidden = f'"{P}.studies"'.join(parts[:2]) + "".join(
            re.sub(r"^,", "", part.lstrip(" ")) if True else part for part in parts[2:]
        )
    return source + "forbidden_modules" + forbidden
