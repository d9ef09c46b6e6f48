# ruff: noqa
"""Applies `plan.txt` to the tree: modules are merged and moved, and everybody finds them again.

    python tools/house_plan/apply.py [ROOT] [--look]     --look only says what would come

It may be run on any state of the tree: modules that are missing are left out, unknown ones stay.
"""

from __future__ import annotations

import ast
import builtins
import io
import re
import shutil
import subprocess
import sys
import textwrap
import tokenize
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from names import Use, Uses, all_names  # noqa: E402

HERE = Path(__file__).parent
PACKAGE = "sumo3dviz_pt"
BAKERY = tuple(f"library.vehicles.{one}" for one in ("car", "heavy", "rail", "cycles", "interior"))
WIDTH = 100
said: list[str] = []


def tell(*words: object) -> None:
    said.append(" ".join(map(str, words)))


# ---------------------------------------------------------------------------------------- modules


@dataclass
class Imported:
    """One name that an import binds."""

    module: str  # as written; empty for `import x`
    name: str
    asname: str | None
    typing: bool = False  # within `if TYPE_CHECKING`

    @property
    def local(self) -> str:
        return self.asname or (self.name if self.module else self.name.split(".")[0])


@dataclass
class Source:
    """A module as it is."""

    id: str
    path: Path
    text: str
    tree: ast.Module
    is_package: bool
    doc: str = ""
    imports: list[Imported] = field(default_factory=list)
    body_from: int = 1  # the first line of what is not header
    remarks: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)

    @property
    def stem(self) -> str:
        return self.id.rsplit(".", 1)[-1]


def parse(path: Path, name: str, is_package: bool) -> Source:
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    one = Source(name, path, text, tree, is_package, ast.get_docstring(tree) or "")
    one.lines = text.splitlines(keepends=True)
    last = 0
    for number, node in enumerate(tree.body):
        if number == 0 and one.doc and isinstance(node, ast.Expr):
            last = node.end_lineno or 0
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            one.imports += imported(node)
        elif is_typing(node) and all(isinstance(n, ast.Import | ast.ImportFrom) for n in node.body):
            for each in node.body:
                one.imports += imported(each, typing=True)
        else:
            break
        last = node.end_lineno or 0
    one.body_from = last + 1
    begin = tree.body[0].end_lineno if one.doc else 0
    one.remarks = [line.strip() for line in one.lines[begin:last] if line.strip().startswith("#")]
    return one


def is_typing(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING" and not node.orelse
    )


def imported(node: ast.Import | ast.ImportFrom, typing: bool = False) -> list[Imported]:
    module = node.module or "" if isinstance(node, ast.ImportFrom) else ""
    if isinstance(node, ast.ImportFrom) and node.level:
        raise SystemExit(f"a relative import: {ast.unparse(node)}")
    return [Imported(module, alias.name, alias.asname, typing) for alias in node.names]


# ------------------------------------------------------------------------------------------- plan


@dataclass
class Target:
    """A module as it shall be."""

    id: str
    sources: list[str]
    says: str = ""


@dataclass
class Plan:
    targets: dict[str, Target]
    folders: list[tuple[str, str]]  # new, old
    renames: dict[tuple[str, str], str]  # (old module, name): new name


def read_plan(path: Path) -> Plan:
    targets: dict[str, Target] = {}
    folders, renames = [], {}
    new = old = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        if line.startswith("["):
            new, old = (part.strip().replace("/", ".").strip(".") for part in line[1:-1].split("<"))
            folders.append((new, old))
            continue
        if line.startswith("rename "):
            _, what, name = line.split()
            module, _, was = what.partition(":")
            renames[module.replace("/", "."), was] = name
            continue
        line, _, says = line.partition("::")
        name, _, sources = line.partition("=")
        name = ".".join(part for part in (new, name.strip().replace("/", ".")) if part)
        every = [f"{old}:{one.replace('/', '.')}" for one in sources.split()]
        targets[name] = Target(name, every, says.strip())
    return Plan(targets, folders, renames)


# ------------------------------------------------------------------------------------------- tree


class House:
    """The package, and where everything goes."""

    def __init__(self, root: Path) -> None:
        self.root, self.package = root, root / PACKAGE
        self.plan = read_plan(HERE / "plan.txt")
        self.old: dict[str, Source] = {}
        for path in sorted(self.package.rglob("*.py")):
            parts = list(path.relative_to(self.package).with_suffix("").parts)
            is_package = parts[-1] == "__init__"
            name = ".".join(parts[:-1] if is_package else parts)
            self.old[name] = parse(path, name, is_package)
        self.new_of: dict[str, str] = {}
        self.targets: dict[str, Target] = {}
        self._place()

    def _place(self) -> None:
        moved = dict(map(reversed, self.plan.folders))  # old folder: new folder
        for target in self.plan.targets.values():
            target.sources = [self._found(one) for one in target.sources]
            there = [one for one in target.sources if one in self.old]
            for one in target.sources:
                if one not in self.old:
                    tell("missing:", one, "for", target.id)
            if there:
                self.targets[target.id] = Target(target.id, there, target.says)
                for one in there:
                    if one in self.new_of:
                        raise SystemExit(f"{one} is planned twice")
                    self.new_of[one] = target.id
        planned_folders = set(moved)
        for name, one in self.old.items():
            if name in self.new_of or one.is_package:
                continue
            folder = name.rpartition(".")[0]
            goes = moved.get(folder, folder)
            new = ".".join(part for part in (goes, one.stem) if part)
            if new in self.targets:
                new = name
            if new != name:
                tell("unknown, moved with its folder:", name, "->", new)
            elif folder in planned_folders and folder and not name.startswith("library.vehicles"):
                tell("stays:", name)
            self.new_of[name] = new
            self.targets[new] = Target(new, [name])
        self._place_packages(moved)

    def _found(self, named: str) -> str:
        """The module that a plan means: below the section's folder, or from the root."""
        folder, _, name = named.partition(":")
        below = ".".join(part for part in (folder, name) if part)
        return name.strip(".") if name.strip(".") in self.old and below not in self.old else below

    def _place_packages(self, moved: dict[str, str]) -> None:
        used = {""}
        for name in self.targets:
            parts = name.split(".")[:-1]
            used |= {".".join(parts[:n]) for n in range(1, len(parts) + 1)}
        self.inits: dict[str, list[str]] = {one: [] for one in used}
        for name, one in self.old.items():
            if not one.is_package:
                continue
            goes = moved.get(name, name)
            if goes not in used:
                goes = self._nearest(name, used)
                if len(one.tree.body) > 1:
                    tell("an __init__ with code has no folder any more:", name)
                else:
                    self.new_of[name] = goes
                    continue
            self.new_of[name] = goes
            self.inits[goes].append(name)
        for goes, olds in self.inits.items():
            own = [one for one in olds if one == goes] or olds
            bodies = [one for one in olds if len(self.old[one].tree.body) > 1]
            if len(bodies) > 1 or (bodies and bodies[0] not in own[:1] + bodies):
                tell("two __init__ with code:", goes, olds)
            keep = bodies[:1] or own[:1]
            self.targets[goes] = Target(goes, keep)
            for one in keep:
                self.new_of[one] = goes

    def _nearest(self, name: str, used: set[str]) -> str:
        """Where most of a folder's modules went."""
        inside = [new for old, new in self.new_of.items() if old.startswith(name + ".")]
        if len(set(inside)) == 1:
            return inside[0]
        folders = Counter(new.rpartition(".")[0] for new in inside)
        return folders.most_common(1)[0][0] if folders else name

    def path_of(self, new: str) -> Path:
        place = self.package.joinpath(*new.split(".")) if new else self.package
        return place / "__init__.py" if new in self.inits else place.with_suffix(".py")

    # ------------------------------------------------------------------------------ resolving

    def ours(self, module: str) -> str | None:
        """The old module that a dotted name of ours means."""
        if module == PACKAGE:
            return ""
        if module.startswith(PACKAGE + "."):
            return module[len(PACKAGE) + 1 :]
        return None

    def target_of(self, one: Imported) -> tuple[str, str | None] | None:
        """The old module that an import reads, and the name in it; None for a module itself."""
        if not one.module:
            own = self.ours(one.name)
            return None if own is None else (own, None)
        own = self.ours(one.module)
        if own is None:
            return None
        inner = f"{own}.{one.name}".strip(".")
        if inner in self.old and not self._binds(own, one.name):
            return inner, None
        return own, one.name

    def _binds(self, module: str, name: str) -> bool:
        """Whether a package's __init__ binds a name that a module of it also has."""
        source = self.old.get(module)
        if source is None or name not in top_names(source):
            return False
        package = f"{PACKAGE}.{module}".rstrip(".")
        itself = any(
            one.local == name and (one.module, one.name) == (package, name)
            for one in source.imports
        )
        return not itself


def top_names(source: Source) -> set[str]:
    if not hasattr(source, "_top"):
        from names import bound_by

        source._top = bound_by(source.tree.body)  # type: ignore[attr-defined]
    return source._top  # type: ignore[attr-defined]


def defined(source: Source) -> dict[str, list[ast.stmt]]:
    """Names that the body binds, with the statements that bind them."""
    from names import bound_by

    found: dict[str, list[ast.stmt]] = defaultdict(list)
    for node in source.tree.body:
        if node.lineno >= source.body_from:
            for name in bound_by([node]):
                found[name].append(node)
    return found


# ------------------------------------------------------------------------------------------ names


def ordered(house: House, target: Target) -> list[Source]:
    """Sources such that each comes after those that it imports at its top."""
    sources = [house.old[one] for one in target.sources]
    ids = {one.id for one in sources}
    needs = {
        one.id: {t[0] for i in one.imports if not i.typing and (t := house.target_of(i))}
        & ids - {one.id}
        for one in sources
    }
    done: list[Source] = []
    while len(done) < len(sources):
        names = {one.id for one in done}
        for one in sources:
            if one.id not in names and needs[one.id] <= names:
                done.append(one)
                break
        else:
            raise SystemExit(f"{target.id}: its sources import each other: {needs}")
    return done


def with_stem(name: str, stem: str) -> str:
    """A name that also says of which module it was."""
    bare = name.lstrip("_")
    lead = name[: len(name) - len(bare)]
    if bare.isupper():
        return f"{lead}{stem.upper()}_{bare}"
    if bare[:1].isupper():
        return lead + "".join(part.capitalize() for part in stem.split("_")) + bare
    if lead:
        return f"{lead}{stem}_{bare}"
    return f"{bare}_{stem}"


class Renaming:
    """What names of old modules are called in the new ones: `names[old module][name]`."""

    def __init__(self, house: House) -> None:
        self.house = house
        self.names: dict[str, dict[str, str]] = defaultdict(dict)
        self.dropped: dict[str, set[str]] = defaultdict(set)  # said before by another source
        self.order: dict[str, list[Source]] = {}
        for target in house.targets.values():
            self.order[target.id] = ordered(house, target)
            if len(target.sources) > 1:
                self._settle(target)
        for (module, name), new in house.plan.renames.items():
            if module in house.old:
                self.names[module][name] = new

    def _settle(self, target: Target) -> None:
        sources = self.order[target.id]
        leaf = target.id.rsplit(".", 1)[-1]
        defs = {one.id: defined(one) for one in sources}
        binders: dict[str, list[Source]] = defaultdict(list)
        for one in sources:
            for name in defs[one.id]:
                binders[name].append(one)
        every = {one.id: all_names(one.tree) for one in sources}
        for name, ones in binders.items():
            if name == "_":  # what nobody calls by name
                continue
            ones = [one for one in ones if (one.id, name) not in self.house.plan.renames]
            if not ones:
                continue
            clash = len(ones) > 1
            captured = (
                hasattr(builtins, name)
                and not name.startswith("_")
                and any(name in every[one.id] for one in sources if one not in ones)
            )
            if clash and self._same(name, ones, defs):
                for one in ones[1:]:
                    self.dropped[one.id].add(name)
                continue
            if not clash and not captured:
                continue
            for one in ones:
                if one.stem == leaf and not captured:
                    continue
                stem = one.stem
                if sum(other.stem == stem for other in ones) > 1 or stem in ("build",):
                    stem = (
                        "_".join(one.id.split(".")[-2:])
                        if stem != "build"
                        else one.id.split(".")[-2]
                    )
                new = with_stem(name, stem)
                while any(new in names for names in every.values()):
                    new += "_"
                self.names[one.id][name] = new
                if not name.startswith("_"):
                    tell(f"public clash in {target.id}: {one.id}:{name} -> {new}")

    def _same(self, name: str, ones: list[Source], defs) -> bool:
        """Whether sources bind a name to the same thing, said in the same words."""
        shapes = set()
        for one in ones:
            nodes = defs[one.id][name]
            if len(nodes) != 1:
                return False
            node = nodes[0]
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                if not all(isinstance(each, ast.Name) for each in targets):
                    return False
            elif not isinstance(node, ast.FunctionDef):
                return False
            if isinstance(node, ast.FunctionDef):
                node = ast.parse(ast.unparse(node)).body[0]
                if ast.get_docstring(node) and len(node.body) > 1:
                    node.body = node.body[1:]
            own = set(defs[one.id]) - {name}
            others = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)} & own
            if any(len([o for o in ones if other in defs[o.id]]) and True for other in others):
                # What it says depends on other names of its module.
                shapes.add((ast.dump(node), one.id))
            else:
                shapes.add((ast.dump(node), ""))
        return len(shapes) == 1


# ------------------------------------------------------------------------------------------ edits


class Edits:
    """Replacements in a text, by line and byte column as `ast` counts them."""

    def __init__(self, text: str) -> None:
        self.lines = [line.encode() for line in text.splitlines(keepends=True)]
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line))
        self.bytes = b"".join(self.lines)
        self.edits: dict[tuple[int, int], str] = {}

    def at(self, line: int, column: int) -> int:
        return self.starts[line - 1] + column

    def replace(self, start: int, end: int, new: str) -> None:
        self.edits[start, end] = new

    def applied(self, begin: int = 0, end: int | None = None) -> str:
        end = len(self.bytes) if end is None else end
        parts, here = [], begin
        last = begin
        for (start, stop), new in sorted(self.edits.items()):
            if start < begin or stop > end:
                continue
            if start < last:
                continue  # within what was replaced as a whole
            parts += [self.bytes[here:start], new.encode()]
            here = last = stop
        parts.append(self.bytes[here:end])
        return b"".join(parts).decode()


def token_at(edits: Edits, use: Use) -> tuple[int, int] | None:
    """Where a use's name stands."""
    node, name = use.node, use.name.encode()
    start = edits.at(node.lineno, node.col_offset)
    if isinstance(node, ast.Name):
        if edits.bytes[start : start + len(name)] == name:
            return start, start + len(name)
        return None
    head = edits.bytes[start : edits.at(node.end_lineno, node.end_col_offset)]
    for found in re.finditer(rb"(?<![\w.])" + name + rb"(?!\w)", head):
        return start + found.start(), start + found.end()
    return None


# -------------------------------------------------------------------------------------- rewriting


class Rewriter:
    """Rewrites one file for the new house: its imports, and the names that it uses."""

    def __init__(self, house: House, renaming: Renaming, source: Source, own: str | None) -> None:
        self.house, self.renaming, self.source, self.own = house, renaming, source, own
        self.edits = Edits(source.text)
        self.locals: dict[str, str] = {}  # what names of the module's top become
        self.modules: dict[str, str] = {}  # local names of modules of ours: old module
        self.inner: dict[str, str] = {}  # those of modules that are now this one
        self.late_self: set[str] = set()
        self.emptied: set[int] = set()  # statements that nothing is left of

    def new_name(self, module: str, name: str) -> str:
        return self.renaming.names.get(module, {}).get(name, name)

    def rewrite_uses(self) -> None:
        """Rename what is used, once `locals`, `modules` and `inner` are known."""
        collector = Uses(frozenset(self.late_self))
        uses = collector.of(self.source.tree)
        lost: dict[int, tuple[ast.JoinedStr, dict[str, str]]] = {}
        for use in uses:
            new = self.locals.get(use.name)
            if use.attribute is not None and use.name in self.modules | self.inner:
                self._attribute(use, new)
                continue
            if use.attribute is None and use.name in self.inner:
                tell(
                    "a module used as a value:",
                    self.source.id,
                    use.name,
                    getattr(use.node, "lineno", 0),
                )
            if new is None or new == use.name:
                continue
            if any(new in scope for scope in use.scopes):
                tell(f"CAPTURED: {self.source.id}:{use.node.lineno} {use.name} -> {new}")
            place = token_at(self.edits, use)
            if place is None:
                if use.joined is None:
                    tell("NOT FOUND:", self.source.id, use.node.lineno, use.name)
                else:
                    lost.setdefault(id(use.joined), (use.joined, {}))[1][use.name] = new
                continue
            self.edits.replace(*place, new)
        for joined, names in lost.values():
            self._in_joined(joined, names)
        for constant in collector.texts:
            self._in_text(constant)
        self._patched()

    def _attribute(self, use: Use, new: str | None) -> None:
        attribute = use.attribute
        place = token_at(self.edits, use)
        if place is None:
            tell(
                "NOT FOUND in an f-string:",
                self.source.id,
                use.node.lineno,
                use.name,
                attribute.attr,
            )
            return
        end = self.edits.at(attribute.end_lineno, attribute.end_col_offset)
        begin = end - len(attribute.attr.encode())
        if use.name in self.inner:
            name = self.new_name(self.inner[use.name], attribute.attr)
            if any(name in scope for scope in use.scopes):
                tell(f"CAPTURED: {self.source.id}:{use.node.lineno} {use.name}.{attribute.attr}")
            self.edits.replace(place[0], end, name)
            return
        name = self.new_name(self.modules[use.name], attribute.attr)
        if new and new != use.name:
            if any(new in scope for scope in use.scopes):
                tell(f"CAPTURED: {self.source.id}:{use.node.lineno} {use.name} -> {new}")
            self.edits.replace(*place, new)
        if name != attribute.attr:
            self.edits.replace(begin, end, name)

    def _in_joined(self, joined: ast.JoinedStr, names: dict[str, str]) -> None:
        start = self.edits.at(joined.lineno, joined.col_offset)
        end = self.edits.at(joined.end_lineno, joined.end_col_offset)
        text = self.edits.bytes[start:end].decode()

        def inside(found: re.Match[str]) -> str:
            part = found.group()
            for name, new in names.items():
                part = re.sub(rf"(?<![\w.\"']){name}(?![\w\"'])", new, part)
            return part

        self.edits.replace(start, end, re.sub(r"\{[^{}]*\}", inside, text))

    def _in_text(self, constant: ast.Constant) -> None:
        start = self.edits.at(constant.lineno, constant.col_offset)
        end = self.edits.at(constant.end_lineno, constant.end_col_offset)
        text = self.edits.bytes[start:end].decode()
        new = text
        for name, other in self.locals.items():
            if name != other:
                new = re.sub(rf"(?<![\w.]){name}(?!\w)", other, new)
        if new != text:
            self.edits.replace(start, end, new)

    def _patched(self) -> None:
        """Rename what tests patch: `monkeypatch.setattr(module, "_name", ...)`."""
        for node in ast.walk(self.source.tree):
            if not isinstance(node, ast.Call) or len(node.args) < 2:
                continue
            first, second = node.args[:2]
            if not (isinstance(second, ast.Constant) and isinstance(second.value, str)):
                continue
            if not (isinstance(first, ast.Name) and first.id in self.modules):
                continue
            name = self.new_name(self.modules[first.id], second.value)
            if name != second.value:
                start = self.edits.at(second.lineno, second.col_offset)
                end = self.edits.at(second.end_lineno, second.end_col_offset)
                self.edits.replace(start, end, f'"{name}"')

    # ---------------------------------------------------------------------- imports in place

    def rewrite_imports(self, header_too: bool, head: Head | None = None) -> None:
        """Rewrite import statements where they stand.

        Args:
            header_too: Also those at the module's head, which merged modules write anew.
            head: The merged module's head.
        """
        for node in ast.walk(self.source.tree):
            if not isinstance(node, ast.Import | ast.ImportFrom):
                continue
            if not header_too and node.lineno < self.source.body_from:
                continue
            self._statement(node, head)
        for block in self.source.tree.body:
            if is_typing(block) and {id(n) for n in block.body} <= self.emptied:
                self.edits.edits = {
                    place: new
                    for place, new in self.edits.edits.items()
                    if not self.edits.starts[block.lineno - 1]
                    <= place[0]
                    < self.edits.starts[block.end_lineno]
                }
                self.edits.replace(
                    self.edits.starts[block.lineno - 1], self.edits.starts[block.end_lineno], ""
                )

    def _statement(self, node: ast.Import | ast.ImportFrom, head) -> None:
        ones = imported(node)
        if all(self.house.target_of(one) is None for one in ones):
            return
        lines: list[str] = []
        by_module: dict[str, list[str]] = defaultdict(list)
        in_typing = any(is_typing(each) and node in each.body for each in self.source.tree.body)
        at_top = node in self.source.tree.body or in_typing
        for one in ones:
            found = self.house.target_of(one)
            if found is None:
                lines.append(written(one.module, one.name, one.asname))
                continue
            old, name = found
            if old not in self.house.new_of:
                tell("unknown import:", self.source.id, one.module, one.name)
                lines.append(written(one.module, one.name, one.asname))
                continue
            new = self.house.new_of[old]
            if name is None:
                self._module(one, old, new, lines, at_top)
                continue
            fresh = self.new_name(old, name)
            if new == self.own:
                continue  # it is this module's own now
            if (
                head is not None
                and one.local == fresh
                and head.has(one.local, (new, fresh), in_typing)
            ):
                continue  # the head has it
            alias = one.asname
            if alias is None and fresh != one.local:
                if at_top and self.own is None and fresh not in all_names(self.source.tree):
                    self.locals[one.local] = fresh
                else:
                    alias = one.local
            if alias == fresh and one.asname != one.name:
                alias = None
            by_module[new].append(fresh if alias is None else f"{fresh} as {alias}")
        for new, names in by_module.items():
            lines.append(f"from {dotted(new)} import {', '.join(dict.fromkeys(names))}")
        self._put(node, lines)

    def _module(self, one: Imported, old: str, new: str, lines: list[str], at_top: bool) -> None:
        if new == self.own:
            tell("a module imports itself late:", self.source.id, old)
            return
        if not one.module and one.asname is None:
            if old != new:
                lines.append(f"import {dotted(new)}")
                tell("`import a.b` is used by its whole name:", self.source.id, one.name)
            else:
                lines.append(f"import {one.name}")
            return
        local = one.local
        parent, _, leaf = new.rpartition(".")
        self.modules[local] = old
        alias = one.asname
        if alias is None and leaf != local:
            if at_top and may_use(self.house, self.source, leaf, new):
                self.locals[local] = leaf
            else:
                alias = local
        text = written(dotted(parent), leaf, alias)
        if new == "":
            text = written(one.module, one.name, one.asname)
        if text not in lines:
            lines.append(text)

    def _put(self, node: ast.stmt, lines: list[str]) -> None:
        start = self.edits.at(node.lineno, node.col_offset)
        end = self.edits.at(node.end_lineno, node.end_col_offset)
        indent = " " * node.col_offset
        if not lines:
            self.emptied.add(id(node))
            parent = next(
                (
                    block
                    for block in ast.walk(self.source.tree)
                    for part in ("body", "orelse", "finalbody")
                    if isinstance(getattr(block, part, None), list)
                    and getattr(block, part) == [node]
                ),
                None,
            )
            if parent is not None:
                lines = ["pass"]
            else:  # with its line
                start -= node.col_offset
                if self.edits.bytes[end : end + 1] == b"\n":
                    end += 1
                self.edits.replace(start, end, "")
                return
        self.edits.replace(start, end, ("\n" + indent).join(lines))


def may_use(house: House, source: Source, name: str, new: str) -> bool:
    """Whether a file may call a module of ours by a name that it had for nothing else."""
    if name in all_names(source.tree, imports=False):
        every = [n for n in ast.walk(source.tree) if isinstance(n, ast.Import | ast.ImportFrom)]
        known = {one.local for node in every for one in imported(node)}
        stored = {
            n.id
            for n in ast.walk(source.tree)
            if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)
        } | {n.arg for n in ast.walk(source.tree) if isinstance(n, ast.arg)}
        if name not in known or name in stored:
            return False
    for node in ast.walk(source.tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            for one in imported(node):
                if one.local == name:
                    found = house.target_of(one)
                    if found is None or found[1] is not None or house.new_of.get(found[0]) != new:
                        return False
    return True


def dotted(new: str) -> str:
    return f"{PACKAGE}.{new}" if new else PACKAGE


def written(module: str, name: str, asname: str | None) -> str:
    tail = f" as {asname}" if asname else ""
    return f"from {module} import {name}{tail}" if module else f"import {name}{tail}"


# ---------------------------------------------------------------------------------------- merging


def merged(house: House, renaming: Renaming, words: Words, target: Target) -> str:
    """The text of a new module."""
    sources = renaming.order[target.id]
    rewriters = [Rewriter(house, renaming, one, target.id) for one in sources]
    taken: dict[str, tuple] = {}  # local name: what it is
    for one in sources:
        for each in late_head(one):
            found = house.target_of(each)
            if found is None:
                taken.setdefault(each.local, (each.module, each.name))
            elif found[1] is not None and found[0] in house.new_of:
                fresh = renaming.names.get(found[0], {}).get(found[1], found[1])
                taken.setdefault(each.local, (house.new_of[found[0]], fresh))
        for name in defined(one):
            if name in {each.local for each in late_head(one)}:
                continue
            taken[renaming.names.get(one.id, {}).get(name, name)] = ("own",)
    head = Head()
    for one, rewriter in zip(sources, rewriters, strict=True):
        names = renaming.names.get(one.id, {})
        rewriter.locals.update({n: names.get(n, n) for n in defined(one)})
        for each in one.imports:
            head_import(house, renaming, target, one, rewriter, each, taken, head)
    bodies = []
    for one, rewriter in zip(sources, rewriters, strict=True):
        late_of_own(house, renaming, target, one, rewriter)
        rewriter.rewrite_imports(header_too=False, head=head)
        rewriter.rewrite_uses()
        drop_twice(renaming, one, rewriter)
        words.rewrite(rewriter.edits, one.text, one.body_from, one.path)
        begin = rewriter.edits.starts[one.body_from - 1]
        bodies.append(rewriter.edits.applied(begin).strip("\n"))
        if one.remarks and len(sources) > 1:
            tell("comments among imports:", one.id, one.remarks)
    doc = words.in_text(docstring(target, sources))
    head_text = head.text()
    parts = [doc, head_text] if head_text else [doc]
    return (
        "\n\n".join(part for part in parts if part)
        + "\n\n\n"
        + "\n\n\n".join(b for b in bodies if b)
        + "\n"
    )


def late_head(one: Source) -> list[Imported]:
    """Imports at a module's top that stand below its head, as after a `try`."""
    found = []
    for node in one.tree.body:
        if node.lineno >= one.body_from:
            parts = [node, *(node.body if isinstance(node, ast.If | ast.Try) else [])]
            for part in parts:
                if isinstance(part, ast.Import | ast.ImportFrom):
                    found += imported(part)
    return found


class Head:
    """Imports of a merged module."""

    def __init__(self) -> None:
        self.lines: dict[bool, list[str]] = {False: [], True: []}
        self.bound: dict[bool, dict[str, tuple]] = {False: {}, True: {}}

    def has(self, local: str, what: tuple, typing: bool) -> bool:
        return what in (
            self.bound[False].get(local),
            self.bound[True].get(local) if typing else None,
        )

    def add(self, line: str, typing: bool) -> None:
        if line not in self.lines[typing]:
            self.lines[typing].append(line)

    def text(self) -> str:
        plain = [one for one in self.lines[False] if "__future__" not in one]
        future = [one for one in self.lines[False] if "__future__" in one]
        inner = [one for one in self.lines[True] if one not in plain]
        text = "\n".join([*future, "", *plain])
        if inner:
            text += "\n\nif TYPE_CHECKING:\n" + "\n".join(f"    {one}" for one in inner)
        return text.strip("\n")


def head_import(house, renaming, target, one, rewriter, each, taken, head) -> None:
    """Take an import of a source over into the merged head."""
    found = house.target_of(each)
    if found is None:
        key, local = (each.module, each.name), each.local
        final = free_name(local, key, taken, one, rewriter, each.module)
        alias = each.asname if final == local else final
        if alias == each.name and each.asname is None:
            alias = None
        head.add(written(each.module, each.name, alias), each.typing)
        rewriter.locals[local] = final
        return
    old, name = found
    if old not in house.new_of:
        tell("unknown import:", one.id, each.module, each.name)
        head.add(written(each.module, each.name, each.asname), each.typing)
        return
    new = house.new_of[old]
    if name is None:
        if new == target.id:
            rewriter.inner[each.local] = old
            return
        parent, _, leaf = new.rpartition(".")
        wanted = each.asname or leaf
        if wanted != each.local and not may_use(house, one, wanted, new):
            wanted = each.local
        rewriter.modules[each.local] = old
        final = free_name(wanted, (new, None), taken, one, rewriter, parent)
        again = each.asname is not None and each.asname == each.name  # an explicit re-export
        head.add(
            written(dotted(parent), leaf, None if final == leaf and not again else final),
            each.typing,
        )
        rewriter.locals[each.local] = final
        if final != each.local:
            renaming.names[one.id].setdefault(each.local, final)
        return
    fresh = renaming.names.get(old, {}).get(name, name)
    if new == target.id:
        if each.asname is None or each.asname != each.name:
            rewriter.locals[each.local] = fresh
        return
    wanted = each.asname or fresh
    if each.asname is None and fresh != name and fresh in all_names(one.tree):
        wanted = name
    final = free_name(wanted, (new, fresh), taken, one, rewriter, old)
    again = each.asname is not None and each.asname == each.name  # an explicit re-export
    alias = final if final != fresh or again else None
    head.add(written(dotted(new), fresh, alias), each.typing)
    head.bound[each.typing][final] = (new, fresh)
    rewriter.locals[each.local] = final
    if final != each.local:
        renaming.names[one.id].setdefault(each.local, final)


def free_name(wanted, key, taken, one, rewriter, module) -> str:
    """A local name that means one thing in the merged module."""
    if taken.setdefault(wanted, key) == key:
        return wanted
    names = all_names(one.tree)
    stem = module.rsplit(".", 1)[-1] or "other"
    for new in (
        with_stem(wanted, stem),
        with_stem(wanted, one.stem),
        with_stem(wanted, f"{stem}_{one.stem}"),
    ):
        if new not in names and taken.setdefault(new, key) == key:
            tell(f"import renamed in {one.id}: {wanted} -> {new}")
            return new
    raise SystemExit(f"no name for {wanted} in {one.id}")


def late_of_own(house, renaming, target, one, rewriter) -> None:
    """Late imports of what is now in the same module: the names are global."""
    for node in ast.walk(one.tree):
        if isinstance(node, ast.Import | ast.ImportFrom) and node.lineno >= one.body_from:
            for each in imported(node):
                found = house.target_of(each)
                if found is None or house.new_of.get(found[0]) != target.id:
                    continue
                if found[1] is None:
                    rewriter.inner[each.local] = found[0]
                    rewriter.late_self.add(each.local)
                    continue
                fresh = renaming.names.get(found[0], {}).get(found[1], found[1])
                before = rewriter.locals.get(each.local)
                if before is not None and before != fresh:
                    tell("CLASH of a late import:", one.id, each.local, before, fresh)
                rewriter.locals[each.local] = fresh
                rewriter.late_self.add(each.local)


def drop_twice(renaming: Renaming, one: Source, rewriter: Rewriter) -> None:
    """Leave out definitions that an earlier source has in the same words."""
    body = one.tree.body
    for number, node in enumerate(body):
        names = {n for n, nodes in defined(one).items() if node in nodes}
        if not names or not names <= renaming.dropped.get(one.id, set()):
            continue
        last = node
        if number + 1 < len(body):
            after = body[number + 1]
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                last = after
        first = min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])
        while first > one.body_from and one.lines[first - 2].startswith("#"):
            first -= 1
        rewriter.edits.edits = {
            place: new
            for place, new in rewriter.edits.edits.items()
            if not rewriter.edits.starts[first - 1]
            <= place[0]
            < rewriter.edits.starts[last.end_lineno]
        }
        rewriter.edits.replace(
            rewriter.edits.starts[first - 1], rewriter.edits.starts[last.end_lineno], ""
        )


def docstring(target: Target, sources: list[Source]) -> str:
    """One docstring: what the module makes, what each part says, references at the end."""
    if len(sources) == 1 and not target.says:
        return header_doc(sources[0].doc) if sources[0].doc else ""
    paragraphs: list[str] = []
    summaries: list[str] = []
    references: list[str] = []
    if not sources:
        tell("a new folder without words:", target.id)
        return ""
    first = target.says or sources[-1].doc.split("\n\n")[0].replace("\n", " ")
    main = None if target.says else sources[-1]
    for one in ([main] if main else []) + [s for s in sources if s is not main]:
        summary, _, rest = one.doc.partition("\n\n")
        rest, listed = without_references(rest)
        references += [line for line in listed if line not in references]
        summary = " ".join(summary.split())
        if one is main or summary == first:
            if rest.strip():
                paragraphs.append(rest.strip("\n"))
            continue
        if said_already(summary, first):
            summary = ""
        if rest.strip():
            begin, gap, more = rest.strip("\n").partition("\n\n")
            if is_prose(begin):
                paragraphs.append(fill(f"{summary} {' '.join(begin.split())}".strip()) + gap + more)
            elif summary:
                paragraphs.append(fill(summary) + "\n\n" + rest.strip("\n"))
            else:
                paragraphs.append(rest.strip("\n"))
        elif summary:
            summaries.append(summary)
    if summaries:
        paragraphs.insert(0, fill(" ".join(summaries)))
    text = "\n\n".join([first, *paragraphs])
    if references:
        text += "\n\nReferences:\n" + "\n".join(references)
    return header_doc(text)


def said_already(summary: str, first: str) -> bool:
    """Whether a first line says (nearly) what another one says."""
    words = {w.rstrip("s") for w in re.findall(r"[a-z]{4,}", summary.lower())} - LITTLE
    known = {w.rstrip("s") for w in re.findall(r"[a-z]{4,}", first.lower())}
    return len(words & known) >= 0.7 * len(words)


LITTLE = {
    "what",
    "that",
    "which",
    "where",
    "they",
    "with",
    "from",
    "thi",
    "have",
    "are",
    "them",
    "when",
}


def is_prose(paragraph: str) -> bool:
    lines = paragraph.split("\n")
    return all(
        line and not line.startswith((" ", "-", "*", "|", "`", ">")) for line in lines
    ) and not (len(lines) > 0 and lines[0].rstrip().endswith(":") and len(lines[0]) < 30)


def fill(text: str) -> str:
    return textwrap.fill(text, WIDTH - 1, break_long_words=False, break_on_hyphens=False)


def without_references(text: str) -> tuple[str, list[str]]:
    found = re.search(r"(?m)^References:\n((?:[ \t]+.*\n?|\n)+)", text)
    if not found:
        return text, []
    return text[: found.start()] + text[found.end() :], found.group(1).rstrip("\n").split("\n")


def header_doc(text: str) -> str:
    first, _, rest = text.partition("\n")
    if len(first) > WIDTH - 6 and not rest:
        tell("a long first line:", first)
    raw = "r" if "\\" in text else ""
    if not rest.strip():
        return f'{raw}"""{text.strip()}"""'
    return f'{raw}"""{text.strip()}\n"""'


# ------------------------------------------------------------------------------------------ words


class Words:
    """Names of modules and files in texts: strings, comments, manuals, configurations."""

    def __init__(self, house: House, renaming: Renaming, tests: dict[str, str]) -> None:
        self.house, self.renaming, self.tests = house, renaming, tests
        self.files = {}
        for old, one in house.old.items():
            was = one.path.relative_to(house.package).as_posix()
            self.files[was] = house.path_of(house.new_of[old]).relative_to(house.package).as_posix()
        self.folders: dict[str, str] = {}
        for old, one in house.old.items():
            if one.is_package and old and not (house.new_of[old] == old and old in house.inits):
                new = house.new_of[old]
                self.folders[old.replace(".", "/")] = new.replace(".", "/") + (
                    "/" if new in house.inits else ".py"
                )
        self.folders |= FOLDERS

    def in_text(self, text: str) -> str:
        text = re.sub(rf"\b{PACKAGE}((?:\.[A-Za-z_]\w*)+)", self._dotted, text)
        return re.sub(r"(?<![\w./-])(?:[\w{},-]+/)+(?:\w+\.py(?!\w))?", self._path, text)

    def _dotted(self, found: re.Match[str]) -> str:
        parts = found.group(1)[1:].split(".")
        for number in range(len(parts), 0, -1):
            old = ".".join(parts[:number])
            if old in self.house.new_of:
                rest = parts[number:]
                if rest:
                    rest[0] = self.renaming.names.get(old, {}).get(rest[0], rest[0])
                return ".".join([dotted(self.house.new_of[old]), *rest])
        return found.group()

    def _path(self, found: re.Match[str]) -> str:
        text = found.group()
        lead = ""
        if text.startswith("tests/"):
            return self.tests.get(text, text)
        if text.startswith(PACKAGE + "/"):
            lead, text = PACKAGE + "/", text[len(PACKAGE) + 1 :]
        if text in self.files:
            return lead + self.files[text]
        if text.endswith("/"):
            for folder, new in sorted(self.folders.items(), key=lambda each: -len(each[0])):
                if text.rstrip("/") == folder:
                    return lead + new
                if text.startswith(folder + "/") and new.endswith("/"):
                    return lead + new + text[len(folder) + 1 :]
        return lead + text

    def rewrite(self, edits: Edits, text: str, begin: int, path: Path) -> None:
        """Rewrite strings and comments of Python, but where names were renamed."""
        done = sorted(edits.edits)
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type not in (tokenize.STRING, tokenize.COMMENT) or token.start[0] < begin:
                continue
            new = self.in_text(token.string)
            if new == token.string:
                continue
            line = edits.lines[token.start[0] - 1].decode()
            start = edits.at(token.start[0], len(line[: token.start[1]].encode()))
            end = start + len(token.string.encode())
            if any(start <= a < end for a, _ in done):
                tell("a string with two changes:", path, token.start[0])
                continue
            edits.replace(start, end, new)


FOLDERS = {  # what texts mean by a folder that several modules have taken the place of
    "world/sky": "world/sky.py",
    "world/weather": "world/weather.py",
    "shot/falling": "shot/falling.py",
    "render/materials": "render/textures.py",
    "pipeline/layers": "pipeline/films/layers.py",
    "pipeline/progress": "pipeline/costs.py",
    "pipeline/accounts": "pipeline/accounts.py",
    "pipeline/overlays": "pipeline/films/overlays.py",
    "pipeline/stills": "pipeline/live.py",
    "motion/lanes": "motion/lanes.py",
    "sumo/repairs": "sumo/repairs.py",
    "sumo/guesses": "sumo/guesses.py",
    "sumo/places": "sumo/places.py",
    "sumo/logs": "sumo/reader.py",
    "image/accumulation": "image/average.py",
    "report/motion": "report/motion.py",
    "library/materials": "library/materials.py",
    "library/skies": "library/pictures.py",
    "experiments": "studies/",
}
SENTENCES = {  # of CONTRIBUTING.md, after the names in it were rewritten
    "what it holds in `pipeline/films/layers.py`, its file in `pipeline/films/layers.py` and": "what it holds and its file in `pipeline/films/layers.py`, and in",
    "`shot/crowd.py`, `shot/crowd.py`": "`shot/crowd.py`",
    "`render/falling/`, `shot/falling.py`, `world/weather.py`": "`render/falling/`, `shot/falling.py`, `world/weather.py`",
    "`world/weather.py` makes it from the settings. `world/weather.py` says": "`world/weather.py` makes it from the settings, and says",
    "`render/kernel/deposits.py` calls what is wet and `render/kernel/deposits.py`; a layer of ice would be a\n   module beside that.": "`render/kernel/deposits.py` says what is wet and where snow lies; a layer of ice would be a\n   part of that.",
    "`studies/designs/`, `studies/designs/tables.py` (a row)": "`studies/designs/`; a form is a row in its `tables.py`",
    "`farm/`; an engine is a module in `farm/engines.py` and its entry": "`farm/`; an engine is a few functions in `farm/engines.py` and its entry",
    "`pipeline/` alone knows all of these stages; `cli`, `api`,\n`report` and `viewer` go through it.": "`pipeline/` knows all of these stages; the rooms `studies`, `farm`, `recording`,\n`proposals`, `report` and `viewer` stand on it, and `cli` and `api` on top of all.",
}

PATCHES = [  # (new module, text, what it becomes): what no rule knows
    (
        "pipeline.provenance",
        '"cli", "experiments", "overlays", "report", "video", "viewer"',
        '"cli", "farm", "overlays", "proposals", "recording", "report", "studies", "video", "viewer"',
    ),
]

DEEP = re.compile(r"(Path\(__file__\)(?:\.resolve\(\))?\.parents\[)(\d+)\]")


def with_depth(text: str, before: Path, after: Path) -> str:
    """Count a file's folders anew where it looks for the root."""
    more = len(after.parts) - len(before.parts)
    return (
        DEEP.sub(lambda found: f"{found.group(1)}{int(found.group(2)) + more}]", text)
        if more
        else text
    )


# ------------------------------------------------------------------------------------------ tests


def tests_of(house: House) -> dict[str, str]:
    """Where unit tests go: beside the mirror of what they test."""
    unit = house.root / "tests" / "unit"
    places: dict[str, str] = {}
    taken: set[str] = set()
    for path in sorted(unit.rglob("*")):
        if not path.is_file() or "__pycache__" in path.parts:
            continue
        inner = path.relative_to(unit)
        folder = ".".join(inner.parts[:-1])
        new = test_folder(house, folder, path.stem.removeprefix("test_"))
        place = "/".join([*(new.split(".") if new else []), path.name])
        if place in taken and place != inner.as_posix():
            tail = folder.split(".")[-1]
            place = place.replace("test_", f"test_{tail}_", 1)
            tell("a test of the same name:", inner.as_posix(), "->", place)
        taken.add(place)
        places[f"tests/unit/{inner.as_posix()}"] = f"tests/unit/{place}"
    return places


def test_folder(house: House, folder: str, subject: str) -> str:
    if folder not in house.old or not house.old[folder].is_package:
        return folder
    own = f"{folder}.{subject}" if folder else subject
    if own in house.new_of and not house.old[own].is_package:
        new = house.new_of[own]
        return new.rpartition(".")[0]
    goes = house.new_of[folder]
    return goes if goes in house.inits else goes.rpartition(".")[0]


# ------------------------------------------------------------------------------------------- main


def main() -> None:
    arguments = [one for one in sys.argv[1:] if not one.startswith("--")]
    root = Path(arguments[0] if arguments else ".").resolve()
    house = House(root)
    renaming = Renaming(house)
    tests = tests_of(house)
    words = Words(house, renaming, tests)
    if "--circles" in sys.argv:
        look(house)
        return
    # Twice: the first time settles what imports are called in merged modules.
    for _ in range(2):
        before = len(said)
        texts = {t.id: merged(house, renaming, words, t) for t in house.targets.values()}
    del before
    for target, before, after in PATCHES:
        if before not in texts.get(target, ""):
            tell("a patch finds nothing:", target, before)
        texts[target] = texts.get(target, "").replace(before, after)
    look(house)
    if "--look" not in sys.argv:
        others = rewrite_others(house, renaming, words, tests)
        write(house, texts, others, tests)
    for line in dict.fromkeys(said):
        print(line)


def rewrite_others(house, renaming, words, tests) -> dict[str, str]:
    """Texts of all other files that speak of modules."""
    listed = subprocess.run(
        ["git", "-C", str(house.root), "ls-files", "-co", "--exclude-standard"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split("\n")
    texts: dict[str, str] = {}
    for name in listed:
        path = house.root / name
        if not name or not path.is_file() or name.startswith(("tools/house_plan/", "assets/")):
            continue
        if name.startswith(PACKAGE + "/") and name.endswith(".py"):
            continue
        if path.suffix not in {
            ".py",
            ".md",
            ".toml",
            ".yaml",
            ".yml",
            ".txt",
            ".js",
            ".html",
            ".ipynb",
            "",
        }:
            continue
        if name == "CHANGELOG.md":
            continue
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        if path.suffix == ".py" and PACKAGE in text:
            one = parse(path, name, False)
            one.body_from = 1
            rewriter = Rewriter(house, renaming, one, None)
            rewriter.rewrite_imports(header_too=True)
            rewriter.rewrite_uses()
            words.rewrite(rewriter.edits, text, 1, path)
            new = rewriter.edits.applied()
        elif path.suffix == ".py":
            one = parse(path, name, False)
            edits = Edits(text)
            words.rewrite(edits, text, 1, path)
            new = edits.applied()
        elif name == "pyproject.toml":
            continue
        else:
            new = words.in_text(text)
        if name == "CONTRIBUTING.md":
            for before, after in SENTENCES.items():
                new = new.replace(before, after)
        if name in tests:
            new = with_depth(new, Path(name), Path(tests[name]))
        if new != text:
            texts[name] = new
    return texts


def write(
    house: House, texts: dict[str, str], others: dict[str, str], tests: dict[str, str]
) -> None:
    root = house.root
    for name, text in others.items():
        (root / name).write_text(text, encoding="utf-8")
    moves = dict(tests)
    folders = {old: new for new, old in house.plan.folders if old != new and old}
    for path in sorted(house.package.rglob("*")):
        if path.is_file() and path.suffix != ".py" and "__pycache__" not in path.parts:
            inner = path.relative_to(house.package).as_posix()
            for old, new in sorted(folders.items(), key=lambda each: -len(each[0])):
                was = old.replace(".", "/") + "/"
                if inner.startswith(was):
                    moves[f"{PACKAGE}/{inner}"] = (
                        f"{PACKAGE}/{new.replace('.', '/')}/{inner[len(was) :]}"
                    )
                    break
    pending = {a: (root / a).read_bytes() for a, b in moves.items() if a != b}
    for name in pending:
        (root / name).unlink()
    for name, content in pending.items():
        place = root / moves[name]
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
    for one in house.old.values():
        one.path.unlink()
    for target in house.targets.values():
        path = house.path_of(target.id)
        path.parent.mkdir(parents=True, exist_ok=True)
        text = texts[target.id]
        if len(target.sources) == 1:
            text = with_depth(text, house.old[target.sources[0]].path, path)
        else:
            for one in target.sources:
                if DEEP.search(house.old[one].text):
                    text = with_depth(text, house.old[one].path, path)
                    break
        path.write_text(text, encoding="utf-8")
    for top in (house.package, root / "tests" / "unit"):
        for folder in sorted(top.rglob("*"), reverse=True):
            if folder.is_dir() and folder.name == "__pycache__":
                shutil.rmtree(folder)
        for folder in sorted(top.rglob("*"), reverse=True):
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()
    import pyproject_rules

    pyproject_rules.rewrite(root)


def look(house: House) -> None:
    """Say how large the house will be, and which circles it will have."""
    bakery = [one for one in house.targets if one.startswith(BAKERY)]
    print(
        "modules:", len(house.old), "->", len(house.targets), "of them the bakery's:", len(bakery)
    )
    folders = Counter(
        t if t in house.inits else t.rpartition(".")[0] for t in house.targets if t not in bakery
    )
    print("fullest folders:", folders.most_common(6))
    for late in (False, True):
        edges: dict[str, set[str]] = defaultdict(set)
        why: dict[tuple[str, str], set[str]] = defaultdict(set)
        for one in house.old.values():
            own = house.new_of[one.id]
            for node in ast.walk(one.tree):
                if not isinstance(node, ast.Import | ast.ImportFrom):
                    continue
                head = node in one.tree.body
                typing = any(is_typing(n) and node in n.body for n in one.tree.body)
                if typing or (not head and not late):
                    continue
                for each in imported(node):
                    found = house.target_of(each)
                    if found and found[0] in house.new_of and house.new_of[found[0]] != own:
                        new = house.new_of[found[0]]
                        if new:
                            edges[own].add(new)
                            why[own, new].add(
                                f"{one.stem}{'' if head else '(late)'}>{found[0].rsplit('.', 1)[-1]}"
                            )
        for circle in circles(edges):
            print("CIRCLE" + (" (late)" if late else ""), sorted(circle))
            for a in sorted(circle):
                for b in sorted(edges[a] & circle):
                    print("   ", a, "->", b, ":", " ".join(sorted(why[a, b])))


def circles(edges: dict[str, set[str]]) -> list[set[str]]:
    """Strongly connected parts of more than one module (Tarjan's algorithm)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[set[str]] = []
    sys.setrecursionlimit(10000)

    def visit(one: str) -> None:
        index[one] = low[one] = len(index)
        stack.append(one)
        for other in edges.get(one, ()):
            if other not in index:
                visit(other)
                low[one] = min(low[one], low[other])
            elif other in stack:
                low[one] = min(low[one], index[other])
        if low[one] == index[one]:
            part = set()
            while True:
                other = stack.pop()
                part.add(other)
                if other == one:
                    break
            if len(part) > 1:
                found.append(part)

    for one in list(edges):
        if one not in index:
            visit(one)
    return found


if __name__ == "__main__":
    main()
