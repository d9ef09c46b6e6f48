"""Writes the manual's reference pages from the code: python tools/make_reference.py

The scene file's keys come from the pydantic models, the commands from the parser, the
presets and assets from the catalogue. A test says when a page is out of date.
"""

from __future__ import annotations

import argparse
import datetime as dt
import re
import sys
import types
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from sumo3dviz_pt import catalog, cli
from sumo3dviz_pt.job import settings, study
from sumo3dviz_pt.job.settings import bounds
from sumo3dviz_pt.job.values import all_models, models_in

DOCS = Path(__file__).resolve().parents[1] / "docs"
MADE = "<!-- Made by tools/make_reference.py; change the code, not this page. -->\n"

SIMPLE = {
    bool: "true, false",
    int: "integer",
    float: "number",
    str: "text",
    Path: "file",
    Fraction: "number or ratio",
    dt.date: "date",
    dt.time: "time of day",
}
SIGNS = {"gt": "> ", "ge": "≥ ", "lt": "< ", "le": "≤ "}
UNIT = re.compile(r" *\[(m|s|deg|px)\]")


# The scene file ---------------------------------------------------------------------------


def scene_file() -> str:
    """The page about the scene file."""
    models = list(dict.fromkeys(all_models(settings.Job)))
    sections = [_section(model) for model in models if model is not settings.Job]
    return "\n".join(
        [
            MADE,
            "# Scene file",
            "",
            "A scene file is YAML with the meaning of YAML 1.2: `12:30` is a time and `on` is a "
            "word. Unknown and repeated keys are errors. Paths are relative to the scene file. "
            "What a file leaves out comes from its `template`, then from the defaults below. "
            "On the command line, `--set key.path=value` wins over the file.",
            "",
            "`sumo3dviz-pt schema -o scene.schema.json` writes the same as JSON schema, with all "
            "names. `init` puts it beside the scene file, with a line by which editors find it "
            "(`# yaml-language-server: $schema=scene.schema.json`; VS Code with its YAML "
            "extension, Neovim, Emacs, JetBrains): they complete keys and names, show meanings and "
            "mark mistakes.",
            "",
            "## The keys",
            "",
            *_table(settings.Job),
            "",
            *sections,
            "## Quality presets",
            "",
            "Files in `scene_templates/quality`, with these keys:",
            "",
            *_table(settings.Quality),
            "",
        ]
    )


def _section(model: type[BaseModel]) -> str:
    """One model's heading, sentence and table."""
    words = (model.__doc__ or "").strip().splitlines()[0]
    return "\n".join([f"## {_title(model)}", "", words, "", *_table(model), ""])


def _title(model: type[BaseModel]) -> str:
    """A model's name in words: `SunSettings` is "Sun"."""
    name = re.sub(r"Settings$", "", model.__name__)
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).capitalize()


def _table(model: type[BaseModel]) -> Iterator[str]:
    """A table of a model's keys."""
    yield "| key | type | default | unit, range | meaning |"
    yield "|---|---|---|---|---|"
    for name, field in model.model_fields.items():
        unit = UNIT.findall(field.description or "")
        limits = ", ".join([*unit[:1], *_limits(field)])
        meaning = UNIT.sub("", field.description or "").removeprefix("; ")
        meaning = meaning or _first_line(field.annotation)
        cells = [f"`{field.alias or name}`", _type(field.annotation), _default(field), limits]
        yield "| " + " | ".join([*cells, meaning.replace("|", "\\|")]) + " |"


def _first_line(annotation: Any) -> str:
    """What a nested model says about itself."""
    models = models_in(annotation)
    text = (models[0].__doc__ or "").strip().splitlines()[0] if models else ""
    return text[:1].lower() + text[1:].rstrip(".")


def _type(annotation: Any) -> str:
    """An annotation in words."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        title = _title(annotation)
        return f"[{title}](#{title.lower().replace(' ', '-')})"
    if annotation in SIMPLE:
        return SIMPLE[annotation]
    if annotation == study.Patch:
        return "[keys of the scene file](scene_file.md)"
    return COMPOUND[get_origin(annotation)](get_args(annotation))


def _list_type(parts: tuple[Any, ...]) -> str:
    """A tuple's type in words."""
    if parts[-1] is Ellipsis:
        return f"list of {_type(parts[0])}"
    return (
        f"list of {len(parts)} {_type(parts[0]).replace('list of', 'lists of').removesuffix('s')}s"
    )


def _any_of(parts: tuple[Any, ...]) -> str:
    """A union's type in words; null shows as the default."""
    return ", ".join(_type(part) for part in parts if part is not type(None))


COMPOUND: dict[Any, Callable[[tuple[Any, ...]], str]] = {
    Annotated: lambda parts: _type(parts[0]),
    Literal: lambda parts: ", ".join(f"`{word}`" for word in parts),
    Union: _any_of,
    types.UnionType: _any_of,
    tuple: _list_type,
    dict: lambda parts: f"{_type(parts[1])}, by name",
}


def _limits(field: FieldInfo) -> list[str]:
    """What a value must keep to, from both sides."""
    return [
        f"{SIGNS[bound.kind]}{bound.value}" for bound in bounds(field.annotation, field.metadata)
    ]


def _default(field: FieldInfo) -> str:
    """A default as it would stand in YAML."""
    if field.is_required():
        return "(required)"
    value = field.get_default(call_default_factory=True)
    if isinstance(value, BaseModel) or value is PydanticUndefined:
        return ""
    if value is None or isinstance(value, bool):
        return f"`{str(value).lower().replace('none', 'null')}`"
    if isinstance(value, tuple | list):
        return f"`[{', '.join(map(str, value))}]`"
    return f"`{value}`" if value != "" else ""


# The study file ---------------------------------------------------------------------------


def study_file() -> str:
    """The page about the study file."""
    own = [model for model in all_models(study.StudySettings) if model is not settings.ShotSettings]
    sections = [_section(model) for model in dict.fromkeys(own[1:])]
    text = "\n".join(
        [
            MADE,
            "# Study file",
            "",
            "A study file says what varies in a scene, by which design, and what comes out; "
            "[Studies](studies.md) explains it. It is YAML as the [scene file](scene_file.md) is. "
            "Paths in it are relative to the study file; those in levels and in `common` are "
            "relative to the scene file, whose keys these hold.",
            "",
            "`sumo3dviz-pt schema --study -o study.schema.json` writes the same as JSON schema, "
            "for editors.",
            "",
            "## The keys",
            "",
            *_table(study.StudySettings),
            "",
            *sections,
        ]
    )
    return text.replace("(#shot)", "(scene_file.md#shot)")


# The command line -------------------------------------------------------------------------


SHARED = ("help", "verbosity")
"""What every command takes."""


def command_line() -> str:
    """The page about the commands."""
    parser = cli.build_parser()  # the manual describes the very parser that runs
    commands = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    helps = {action.dest: action.help for action in commands._choices_actions}
    common = _common_rows(commands.choices)
    lines = [
        MADE,
        "# Command line",
        "",
        "Exit codes: 0 done; 2 wrong input or configuration, said in one sentence; 1 failed "
        "while working, finished frames are kept; 130 interrupted.",
        "",
        "Before or after any command, `-v` says more about what is done, and `-q` says nothing but "
        "errors and results. `--help` of a command lists the names that it takes.",
        "",
        "## Options of many commands",
        "",
        "Each command names which of these it takes.",
        "",
        *HEAD,
        *common.values(),
        "",
    ]
    for name, sub in commands.choices.items():
        lines += _command(f"## {name}", helps.get(name) or "", sub, common=common)
        for word, own in sub.words.items():
            lines += _command(f"### {name} {word}", own.description or "", own, common=common)
    return "\n".join(lines)


HEAD = ("| argument | default | meaning |", "|---|---|---|")


def _actions(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """What a command takes of its own."""
    return [action for action in parser._actions if action.dest not in SHARED]


def _common_rows(parsers: Mapping[str, Any]) -> dict[str, str]:
    """Rows of options that three commands or more take just so, by the option."""
    all_parsers = [p for sub in parsers.values() for p in (sub, *sub.words.values())]
    actions = [action for parser in all_parsers for action in _actions(parser)]
    rows = Counter(_argument(action) for action in actions if action.option_strings)
    return {
        action.option_strings[-1]: _argument(action)
        for action in actions
        if rows[_argument(action)] >= 3
    }


def _command(
    head: str, about: str, parser: argparse.ArgumentParser, *, common: Mapping[str, str]
) -> list[str]:
    """A command, or a word of one, with all that it takes."""
    rows = [_argument(action) for action in _actions(parser)]
    own = [row for row in rows if row not in common.values()]
    names = [f"`{name}`" for name, row in common.items() if row in rows]
    table = [*HEAD, *own, ""] if own else []
    more = [f"Also {', '.join(names)}.", ""] if names else []
    return [head, "", f"{about[:1].upper()}{about[1:]}.", "", *table, *more]


def _argument(action: argparse.Action) -> str:
    """One row about an argument."""
    value = action.metavar or action.dest.upper()
    takes = "" if action.nargs == 0 or not action.option_strings else f" {value}"
    name = ", ".join(action.option_strings) or str(value)
    default = action.default
    shown = "" if default in (None, False, argparse.SUPPRESS) or default == [] else f"`{default}`"
    if action.required and action.nargs != "*":
        shown = "(required)"
    if isinstance(default, tuple) and default:
        shown = f"`{'x'.join(map(str, default))}`"
    meaning = re.sub(r" *\[[^\]]*\]$", "", action.help or "") if shown else action.help or ""
    return f"| `{name}{takes}` | {shown} | {meaning} |"


# The catalogue ----------------------------------------------------------------------------


SHOWN_ELSEWHERE = {"scene", "sky"}
"""Kinds of presets that the page of templates shows, with pictures."""


def catalogue() -> str:
    """The page about everything that can be chosen by name."""
    lines = [
        MADE,
        "# Catalogue",
        "",
        "What a scene file can choose by name. A new folder under `assets/` or a new file under "
        "`scene_templates/` appears here by itself. Scenes and skies: [templates](templates.md).",
        "",
        "## Presets",
        "",
    ]
    root = catalog.data_root("scene_templates")
    for kind in sorted({path.name for path in root.iterdir() if path.is_dir()} - SHOWN_ELSEWHERE):
        lines += [f"### {kind}", "", "| name | content |", "|---|---|"]
        for name in catalog.template_names(kind):
            lines.append(f"| `{name}` | {_content(catalog.template(kind, name))} |")
        lines.append("")
    assets = catalog.data_root("assets")
    families = {
        path.name: [catalog.find(path.name, name) for name in catalog.names(path.name)]
        for path in sorted(assets.iterdir())
        if path.is_dir()
    }
    licences = {asset.meta.get("licence") for each in families.values() for asset in each}
    assert len(licences) == 1, "say the licence of each asset beside it"
    lines += ["## Assets", "", f"All of them have the licence {licences.pop()}.", ""]
    for family, found in families.items():
        lines += [f"### {family}", "", "| name | about, or size [m] |", "|---|---|"]
        lines += [f"| `{asset.name}` | {_about(asset.meta)} |" for asset in found]
        lines.append("")
    return "\n".join(lines)


def _content(values: Any) -> str:
    """A preset's values in one cell."""
    text = yaml.safe_dump(values, default_flow_style=True, sort_keys=False, width=1000)
    return f"`{text.strip()[1:-1]}`"


def _about(meta: Any) -> str:
    """What an asset says about itself: in words, or its size [m]."""
    if "about" in meta:
        return str(meta["about"])
    sizes = [str(meta[key]) for key in ("length", "width", "height", "scale") if key in meta]
    return " x ".join(sizes)


# ------------------------------------------------------------------------------------------

PAGES = {
    "scene_file.md": scene_file,
    "study_file.md": study_file,
    "command_line.md": command_line,
    "catalogue.md": catalogue,
}


def out_of_date() -> list[str]:
    """Pages that are not what the code says."""
    return [
        name
        for name, make in PAGES.items()
        if not (DOCS / name).is_file() or (DOCS / name).read_text(encoding="utf-8") != make()
    ]


def main() -> int:
    """Write the pages that changed."""
    for name in out_of_date():
        (DOCS / name).write_text(PAGES[name](), encoding="utf-8", newline="\n")
        print(f"wrote docs/{name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
