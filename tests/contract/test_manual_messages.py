"""Messages that the manual quotes are said by the program."""

from __future__ import annotations

import ast
import re
from functools import cache

import pytest
from manual import PAGES, ROOT, name_of, text_of

_HOLE = "\0"
_SENTENCES = re.compile(r'\*\*("[^*]+)\*\*')
"""Bold sentences that begin with a quotation."""

_OTHERS = ("error while loading ",)
"""How messages of other programs begin."""


@cache
def spoken() -> str:
    """All words of the package's texts, with a hole where a value is filled in."""
    found = []
    for path in (ROOT / "sumo3dviz_pt").rglob("*.py"):
        for node in ast.walk(ast.parse(text_of(path))):
            if isinstance(node, ast.JoinedStr):
                parts = [p.value if isinstance(p, ast.Constant) else _HOLE for p in node.values]
                found.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return "\n".join(" ".join(text.split()) for text in found)


def quoted(text: str) -> list[str]:
    """Pieces of quoted messages between dots and semicolons, of three words and more."""
    messages = [m for bold in _SENTENCES.findall(text) for m in re.findall(r'"([^"]+)"', bold)]
    pieces = [
        piece.strip(" ;,.") for message in messages for piece in re.split(r"\.\.\.|;", message)
    ]
    return [piece for piece in pieces if len(piece.split()) > 2 and piece[:20] not in _OTHERS]


@pytest.mark.parametrize("page", [page for page in PAGES if quoted(text_of(page))], ids=name_of)
def test_quoted_messages_are_those_of_the_program(page) -> None:
    for piece in quoted(text_of(page)):
        words = [rf"(?:{re.escape(word)}|\S*{_HOLE}\S*)" for word in piece.split()]
        assert piece in spoken() or re.search(" ".join(words), spoken()), piece


def test_there_are_quoted_messages() -> None:
    assert sum(len(quoted(text_of(page))) for page in PAGES) > 20
