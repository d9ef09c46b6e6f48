"""The manual as tests see it: its pages, their blocks, and the commands in them."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PROGRAM = "sumo3dviz-pt"
PAGES = (
    ROOT / "README.md",
    *sorted(
        path for path in DOCS.rglob("*.md") if not path.relative_to(DOCS).parts[0].startswith("_")
    ),
)

_BLOCK = re.compile(r"^```([\w{}-]*)[^\n]*\n(.*?)^```", re.M | re.S)
_INLINE = re.compile(rf"`({PROGRAM}(?: [^`]+)?)`")
_VARIABLE = re.compile(r"\$(\w+|\{\w+\})")
_SHELL = frozenset({"sh", "console", ""})


def name_of(page: Path) -> str:
    """A page's name in a test's name."""
    return page.relative_to(ROOT).as_posix()


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def blocks(language: str, text: str) -> list[str]:
    """Fenced blocks of a language."""
    return [body for name, body in _BLOCK.findall(text) if name == language]


def commands(text: str) -> list[list[str]]:
    """Arguments of every call of our command, in shell blocks and in sentences."""
    found = []
    for name, body in _BLOCK.findall(text):
        if name in _SHELL:
            found += calls(body)
    for span in _INLINE.findall(_BLOCK.sub("", text)):
        found += calls(" ".join(span.split()))
    return found


def calls(script: str) -> list[list[str]]:
    """Arguments of every call of our command in a piece of shell; loops are unrolled.

    What a variable holds that no loop tells counts as 1.
    """
    found: list[list[str]] = []
    loops: list[tuple[str, list[str]]] = []
    for words in _simple_commands(script):
        if words[0] == "for":
            loops.append((words[1], words[3:]))
        elif words[0] == "done":
            loops.pop()
        else:
            words = words[1:] if words[0] == "do" else words
            if words and Path(words[0]).name == PROGRAM:
                found += [_filled(words[1:], values) for values in _values(loops)]
    return found


def _simple_commands(script: str) -> Iterator[list[str]]:
    """Words between the shell's own signs and ends of lines."""
    for line in script.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars=";&|<>")
        lexer.whitespace_split, lexer.commenters = True, "#"
        words: list[str] = []
        for token in [*lexer, ";"]:
            if set(token) <= set(";&|<>"):
                if words:
                    yield words
                words = []
            else:
                words.append(token)


def _values(loops: Sequence[tuple[str, list[str]]]) -> Iterator[dict[str, str]]:
    """What the variables of loops within each other hold, one round after the other."""
    if not loops:
        yield {}
        return
    (name, values), *inner = loops
    for value in values:
        for others in _values(inner):
            yield {name: value, **others}


def _filled(words: Sequence[str], values: Mapping[str, str]) -> list[str]:
    """Words with variables replaced."""
    return [
        _VARIABLE.sub(lambda found: values.get(found.group(1).strip("{}"), "1"), word)
        for word in words
    ]
