"""Counts the words of the manual.

    python tools/count_manual.py [--pages]

The users' part is all that the sidebar of docs/index.md holds but the entry under "For builders";
that entry and all below it are the builders' book. A word is what stands between spaces and holds
a letter. Names in `code` count, and so do generated pages and what a page includes; fenced blocks
(commands, YAML, formulas as code), comments, addresses of links and what Sphinx takes from
docstrings do not.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"
BUILDERS = "For builders"

_TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```", re.M | re.S)
_INCLUDE = re.compile(r"^```\{include\} (\S+)\n((?::.*\n)*)```", re.M)
_FENCE = re.compile(r"^( *)```.*?^\1```", re.M | re.S)
_COMMENT = re.compile(r"<!--.*?-->", re.S)
_LINK = re.compile(r"(!?\[[^\]]*\])\([^)]*\)")


def children(page: Path) -> Iterator[tuple[str, Path]]:
    """Pages that a page's sidebar lists, with the caption that they stand under."""
    for body in _TOCTREE.findall(page.read_text(encoding="utf-8")):
        caption = re.search(r"^:caption: (.*)$", body, re.M)
        for line in body.splitlines():
            if line and not line.startswith(":"):
                name = re.sub(r".*<(.*)>", r"\1", line)
                yield caption[1].strip('"') if caption else "", page.parent / f"{name}.md"


def below(page: Path) -> Iterator[Path]:
    """A page and all that its sidebar leads to."""
    yield page
    for _, child in children(page):
        yield from below(child)


def parts() -> dict[str, list[Path]]:
    """Pages of the users' part and of the builders' book."""
    index = DOCS / "index.md"
    users, builders = [index], list[Path]()
    for caption, page in children(index):
        (builders if caption == BUILDERS else users).extend(below(page))
    return {"users": users, "builders": builders}


def words(page: Path) -> int:
    """Words of a page, with what it includes."""
    text = _INCLUDE.sub(lambda found: included(page.parent / found[1], found[2]), text_of(page))
    for pattern in (_COMMENT, _FENCE):
        text = pattern.sub("", text)
    text = _LINK.sub(r"\1", text).replace("|", " ")
    return sum(bool(re.search(r"[^\W\d_]", word)) for word in text.split())


def included(file: Path, options: str) -> str:
    """What a page takes from a file."""
    text = text_of(file)
    for key, value in re.findall(r'^:(\S+): "(.*)"$', options, re.M):
        before, _, after = text.partition(value)
        text = after if key == "start-after" else before
    return text


def text_of(page: Path) -> str:
    """What a page says."""
    return page.read_text(encoding="utf-8")


def main() -> int:
    """Say how many words and pages each part has."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pages", action="store_true", help="each page by itself, too")
    asked = parser.parse_args()
    for name, pages in parts().items():
        counts = {page: words(page) for page in pages}
        if asked.pages:
            for page, count in counts.items():
                print(f"{count:6}  {page.relative_to(DOCS).as_posix()}")
        print(f"{name}: {sum(counts.values()):,} words on {len(pages)} pages")
    return 0


if __name__ == "__main__":
    sys.exit(main())
