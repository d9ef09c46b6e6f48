# ruff: noqa
"""Which names of a module mean something at its top, wherever they are used."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field

FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


@dataclass
class Use:
    """A name that a module's top binds (or a builtin)."""

    name: str
    node: ast.AST
    scopes: tuple[frozenset[str], ...]
    attribute: ast.Attribute | None = None
    joined: ast.JoinedStr | None = None


def bound_by(statements: list[ast.stmt], skip: frozenset[str] = frozenset()) -> set[str]:
    """Names that statements bind in their own scope."""
    names: set[str] = set()
    outside: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
            return
        if isinstance(node, ast.Lambda):
            return
        if isinstance(node, COMPREHENSIONS):
            for part in ast.walk(node):
                if isinstance(part, ast.NamedExpr):
                    names.add(part.target.id)
            return
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store | ast.Del):
            names.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names.update((alias.asname or alias.name).split(".")[0] for alias in node.names)
        elif isinstance(node, ast.Global | ast.Nonlocal):
            outside.update(node.names)
        elif isinstance(node, ast.ExceptHandler) and node.name:
            names.add(node.name)
        elif isinstance(node, ast.MatchAs | ast.MatchStar) and node.name:
            names.add(node.name)
        elif isinstance(node, ast.MatchMapping) and node.rest:
            names.add(node.rest)
        for child in ast.iter_child_nodes(node):
            visit(child)

    for statement in statements:
        visit(statement)
    return names - outside - skip


def _arguments(node: ast.arguments) -> set[str]:
    every = [*node.posonlyargs, *node.args, *node.kwonlyargs]
    every += [one for one in (node.vararg, node.kwarg) if one]
    return {one.arg for one in every}


@dataclass
class Uses:
    """Collects uses of a module's own names."""

    skip: frozenset[str] = frozenset()  # late imports of what is now in the same module
    found: list[Use] = field(default_factory=list)
    texts: list[ast.Constant] = field(default_factory=list)  # annotations written as text

    def of(self, tree: ast.Module) -> list[Use]:
        for statement in tree.body:
            self._visit(statement, (), None, None)
        return self.found

    def _many(self, nodes, scopes, joined) -> None:
        for node in nodes:
            if node is not None:
                self._visit(node, scopes, None, joined)

    def _annotation(self, node, scopes) -> None:
        if node is None:
            return
        for part in ast.walk(node):
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                self.texts.append(part)
        self._visit(node, scopes, None, None)

    def _visit(self, node, scopes, attribute, joined) -> None:
        if isinstance(node, ast.Name):
            if not any(node.id in scope for scope in scopes):
                self.found.append(Use(node.id, node, scopes, attribute, joined))
            return
        if isinstance(node, ast.Attribute):
            self._visit(node.value, scopes, node, joined)
            return
        if isinstance(node, ast.JoinedStr):
            joined = joined or node
        if isinstance(node, ast.Global):
            for name in node.names:
                self.found.append(Use(name, node, scopes))
            return
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            if not any(node.name in scope for scope in scopes):
                self.found.append(Use(node.name, node, scopes))
            arguments = node.args
            self._many(
                [*node.decorator_list, *arguments.defaults, *arguments.kw_defaults], scopes, joined
            )
            every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
            every += [one for one in (arguments.vararg, arguments.kwarg) if one]
            for one in every:
                self._annotation(one.annotation, scopes)
            self._annotation(node.returns, scopes)
            outer = tuple(s for s in scopes if not isinstance(s, _Class))
            own = frozenset(_arguments(arguments) | bound_by(node.body, self.skip))
            self._many(node.body, (*outer, own), joined)
            return
        if isinstance(node, ast.Lambda):
            self._many([*node.args.defaults, *node.args.kw_defaults], scopes, joined)
            outer = tuple(s for s in scopes if not isinstance(s, _Class))
            self._visit(node.body, (*outer, frozenset(_arguments(node.args))), None, joined)
            return
        if isinstance(node, ast.ClassDef):
            if not any(node.name in scope for scope in scopes):
                self.found.append(Use(node.name, node, scopes))
            self._many([*node.decorator_list, *node.bases], scopes, joined)
            self._many([word.value for word in node.keywords], scopes, joined)
            own = _Class(bound_by(node.body, self.skip))
            self._many(node.body, (*scopes, own), joined)
            return
        if isinstance(node, COMPREHENSIONS):
            targets: set[str] = set()
            for each in node.generators:
                targets |= bound_by([ast.Expr(each.target)])
            self._visit(node.generators[0].iter, scopes, None, joined)
            outer = tuple(s for s in scopes if not isinstance(s, _Class))
            inner = (*outer, frozenset(targets))
            for number, each in enumerate(node.generators):
                self._visit(each.target, inner, None, joined)
                if number:
                    self._visit(each.iter, inner, None, joined)
                self._many(each.ifs, inner, joined)
            parts = [node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt]
            self._many(parts, inner, joined)
            return
        if isinstance(node, ast.AnnAssign):
            self._visit(node.target, scopes, None, joined)
            self._annotation(node.annotation, scopes)
            if node.value is not None:
                self._visit(node.value, scopes, None, joined)
            return
        for child in ast.iter_child_nodes(node):
            self._visit(child, scopes, None, joined)


class _Class(frozenset):
    """Names that a class binds: functions in it do not see them."""


def all_names(tree: ast.AST, imports: bool = True) -> set[str]:
    """Every name that occurs anywhere, but attributes."""
    return set(_names(tree, imports))


def _names(tree: ast.AST, imports: bool) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.alias) and imports:
            yield (node.asname or node.name).split(".")[0]
        elif isinstance(node, ast.ExceptHandler) and node.name:
            yield node.name
