"""Measures the shape of the package: how wide the house is for one owner.

    python tools/house.py [ROOT] --name before -o docs/_bench

adds a column to `house.json` and writes `house.md` of all columns. ROOT is a checkout; without it,
the one that this file stands in.

What is counted: files and folders; lines by kind, where a header is a module's docstring and the
imports at its head; the import graph of modules at run time, without what stands below
`if TYPE_CHECKING`; class names that mean several things; number literals, but for -1 to 2; clones,
which are runs of equal lines of code in two places.
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import statistics
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

PACKAGE = "sumo3dviz_pt"
FULL = 18  # files in a folder
SCRAP, HALL = 150, 600  # lines of a module
CLONE = 7  # lines that make a clone
PLAIN_NUMBERS = {-1, 0, 1, 2}
Graph = Mapping[str, set[str]]


@dataclass(frozen=True, slots=True)
class Module:
    """A module of the package.

    Attributes:
        name: Its dotted name without the package's.
        path: Where it lies, below the package.
        text: What it says.
        tree: What that means.
    """

    name: str
    path: Path
    text: str
    tree: ast.Module


def read_modules(package: Path) -> dict[str, Module]:
    """Return a package's modules by name, folders by the name of theirs."""
    modules = {}
    for path in sorted(package.rglob("*.py")):
        inner = path.relative_to(package)
        parts = list(inner.with_suffix("").parts)
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        text = path.read_text(encoding="utf-8")
        modules[name] = Module(name, inner, text, ast.parse(text))
    return modules


def lines_by_kind(module: Module) -> Counter[str]:
    """Count a module's lines: header, docstring, comment, blank, code; each line is of one kind."""
    kinds = dict.fromkeys(range(1, module.text.count("\n") + 1), "code")
    for number, line in enumerate(module.text.splitlines(), start=1):
        if not line.strip():
            kinds[number] = "blank"
        elif line.lstrip().startswith("#"):
            kinds[number] = "comment"
    for first, last in _texts(module.tree):
        kinds.update(dict.fromkeys(range(first, last + 1), "docstring"))
    end = 0
    for node in module.tree.body:
        if not (
            _is_text(node) or isinstance(node, ast.Import | ast.ImportFrom) or _is_typing(node)
        ):
            break
        end = node.end_lineno or end
    kinds.update({line: "header" for line in range(1, end + 1) if kinds[line] != "blank"})
    return Counter(kinds.values())


def _is_text(node: ast.AST) -> bool:
    """Return whether a statement is only a text."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _texts(tree: ast.Module) -> Iterator[tuple[int, int]]:
    """Yield the first and last lines of docstrings, also of those below values."""
    for node in ast.walk(tree):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Expr) and _is_text(child):
                yield child.lineno, child.end_lineno or child.lineno


def _is_typing(node: ast.AST) -> bool:
    """Return whether a statement is `if TYPE_CHECKING`."""
    return isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")


def imports_of(module: Module, names: Mapping[str, Module], *, late: bool) -> set[str]:
    """Return which modules of the package a module imports at run time.

    Args:
        module: The module.
        names: All modules.
        late: Also those that it imports within functions.
    """
    found: set[str] = set()
    for node in _running(module.tree, late=late):
        dotted = (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [f"{node.module}.{alias.name}" for alias in node.names]
        )
        for each in dotted:
            parts = each.split(".")[1:] if each.split(".")[0] == PACKAGE else []
            while parts and ".".join(parts) not in names:
                parts.pop()
            if parts:
                found.add(".".join(parts))
    return found - {module.name}


def _running(tree: ast.AST, *, late: bool) -> Iterator[ast.Import | ast.ImportFrom]:
    """Yield the imports that run."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif _is_typing(node) or (
            isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not late
        ):
            continue
        else:
            yield from _running(node, late=late)


def circles(graph: Graph) -> list[list[str]]:
    """Return groups of modules that import each other, by whatever way."""
    reached = {one: _reached(one, graph) for one in graph}
    groups = {
        tuple(sorted(other for other in reached[one] if one in reached[other]))
        for one in graph
        if one in reached[one]
    }
    return sorted(map(list, groups))


def _reached(one: str, graph: Graph) -> set[str]:
    """Return all modules that importing one brings along."""
    found: set[str] = set()
    waiting = list(graph[one])
    while waiting:
        other = waiting.pop()
        if other not in found:
            found.add(other)
            waiting += graph[other]
    return found


def longest_chain(graph: Graph) -> list[str]:
    """Return the longest chain of imports; of a graph with circles, one that repeats no module."""
    known: dict[str, list[str]] = {}

    def chain(one: str, above: frozenset[str]) -> list[str]:
        if one not in known:
            below = [chain(other, above | {one}) for other in graph[one] if other not in above]
            known[one] = [one, *max(below, key=len, default=[])]
        return known[one]

    return max((chain(one, frozenset()) for one in sorted(graph)), key=len)


def class_names(modules: Mapping[str, Module]) -> dict[str, int]:
    """Return names of classes that several classes have, with how many."""
    names = Counter(
        node.name
        for module in modules.values()
        for node in ast.walk(module.tree)
        if isinstance(node, ast.ClassDef)
    )
    return {name: count for name, count in names.most_common() if count > 1}


def number_literals(module: Module) -> int:
    """Count numbers that stand in the code, but for the plainest."""
    return sum(
        isinstance(node, ast.Constant)
        and isinstance(node.value, int | float | complex)
        and not isinstance(node.value, bool)
        and node.value not in PLAIN_NUMBERS
        for node in ast.walk(module.tree)
    )


def clones(modules: Mapping[str, Module]) -> int:
    """Count runs of equal lines of code, longer than six, that stand in two places."""
    seen: dict[tuple[str, ...], list[tuple[str, int]]] = defaultdict(list)
    for module in modules.values():
        lines = _code(module)
        for first in range(len(lines) - CLONE + 1):
            seen[tuple(lines[first : first + CLONE])].append((module.name, first))
    pairs = {(one, other) for places in seen.values() for one, other in pairwise(places)}
    return sum(((a[0], a[1] - 1), (b[0], b[1] - 1)) not in pairs for a, b in pairs)


def _code(module: Module) -> list[str]:
    """Return a module's lines of code after its header, without texts, comments and spaces."""
    texts = {line for a, b in _texts(module.tree) for line in range(a, b + 1)}
    imports = {
        line
        for node in _running(module.tree, late=True)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    lines: dict[int, list[str]] = defaultdict(list)
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    for token in tokenize.generate_tokens(io.StringIO(module.text).readline):
        if token.type not in skipped and token.start[0] not in texts | imports:
            lines[token.start[0]].append(token.string)
    return [" ".join(words) for _, words in sorted(lines.items())]


def figures(root: Path) -> dict[str, float | int | str]:
    """Measure a checkout's package."""
    modules = read_modules(root / PACKAGE)
    lines = {name: module.text.count("\n") for name, module in modules.items()}
    kinds = sum((lines_by_kind(module) for module in modules.values()), Counter[str]())
    folders = Counter(module.path.parent.as_posix() for module in modules.values())
    own = {n: length for n, length in lines.items() if modules[n].path.name != "__init__.py"}
    top = {name: imports_of(module, modules, late=False) for name, module in modules.items()}
    late = {name: imports_of(module, modules, late=True) for name, module in modules.items()}
    names = class_names(modules)
    in_circles = circles(late)
    return {
        "files": len(modules),
        "files without folders' own": len(own),
        "lines": sum(lines.values()),
        **{
            f"lines: {kind}": kinds[kind]
            for kind in ("code", "docstring", "comment", "header", "blank")
        },
        "lines of a module: median": statistics.median(own.values()),
        "lines of a module: longest": max(own.values()),
        f"modules below {SCRAP} lines": sum(length < SCRAP for length in own.values()),
        f"modules above {HALL} lines": sum(length > HALL for length in own.values()),
        "folders": len(folders),
        f"folders above {FULL} files": sum(count > FULL for count in folders.values()),
        "fullest folder": "{} ({})".format(*folders.most_common(1)[0]),
        "files in pipeline/": sum(n.split(".")[0] == "pipeline" for n in modules),
        "lines in pipeline/": sum(c for n, c in lines.items() if n.split(".")[0] == "pipeline"),
        "longest chain of imports": len(longest_chain(top)),
        "circles": len(circles(top)),
        "circles with late imports": len(in_circles),
        "modules in circles": sum(map(len, in_circles)),
        "class names used twice or more": len(names),
        "files called build.py": sum(m.path.name == "build.py" for m in modules.values()),
        "number literals": sum(map(number_literals, modules.values())),
        "clones": clones(modules),
        "lines of tests": sum(
            path.read_text(encoding="utf-8").count("\n") for path in (root / "tests").rglob("*.py")
        ),
    }


def page(columns: Mapping[str, Mapping[str, object]]) -> str:
    """Return the table of all columns."""
    rows = list(dict.fromkeys(key for column in columns.values() for key in column))
    lines = [
        f"| | {' | '.join(columns)} |",
        "|---|" + "--:|" * len(columns),
    ]
    for row in rows:
        values = [str(column.get(row, "")) for column in columns.values()]
        lines.append(f"| {row} | {' | '.join(values)} |")
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and write where that is asked for."""
    parser = argparse.ArgumentParser(description="Measures the shape of the package.")
    parser.add_argument("root", type=Path, nargs="?", default=Path(__file__).resolve().parents[1])
    parser.add_argument("--name", default="now", help="what the column is called")
    parser.add_argument("-o", "--output", type=Path, help="the folder of house.json and house.md")
    options = parser.parse_args(arguments)
    measured = figures(options.root)
    columns: dict[str, Mapping[str, object]] = {}
    if options.output is not None:
        stored = options.output / "house.json"
        if stored.exists():
            columns = json.loads(stored.read_text(encoding="utf-8"))
        columns[options.name] = measured
        stored.write_text(json.dumps(columns, indent=1) + "\n", encoding="utf-8")
        (options.output / "house.md").write_text(page(columns), encoding="utf-8")
    print(page(columns or {options.name: measured}))


if __name__ == "__main__":
    main()
