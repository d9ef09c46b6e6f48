"""Turns a design table into trials, whatever its form."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.experiments.tables.cells import Row, Table
from sumo3dviz_pt.experiments.tables.columns import called, cell, column, find_column, listed, same
from sumo3dviz_pt.experiments.tables.forms import FORMS, TableForm, TableRequest
from sumo3dviz_pt.experiments.tables.levels import FactorColumns, has_effects_codes
from sumo3dviz_pt.experiments.trials import Levels, Profile, Trial


@dataclass(frozen=True, slots=True)
class _Seen:
    """One alternative as a table tells it; `profile` None offers to choose nothing."""

    block: str
    task: str
    alternative: str
    profile: Profile | None
    line: int


def trials_in(table: Table, levels: Levels, request: TableRequest) -> tuple[Trial, ...]:
    """Return the trials of a design, in the order of the table.

    Args:
        table: As it was read.
        levels: Of each factor.
        request: How the table is to be read.

    Raises:
        ConfigError: If the request names factors or levels that are not there.
        InputError: If the table is not what the request says; names line and column.
    """
    form = FORMS[request.form]
    _check(request, levels, form)
    read = _wide if form.wide else _long
    seen = list(read(table, levels, request, form))
    _check_repeats(table, seen)
    trials = _gathered(seen)
    _check_alternatives(table, seen, trials)
    return _with_shared(trials, form.shared)


# Rows by alternative -----------------------------------------------------------------------


def _long(table: Table, levels: Levels, request: TableRequest, form: TableForm) -> Iterator[_Seen]:
    """Yield alternatives of a table that has a row for each."""
    columns = {factor: [request.columns.get(factor, (factor,))] for factor in levels}
    factors = [own[0] for own in _all_columns(table, levels, request, form, columns).values()]
    task = _role(table, request.task, form.task, form.optional, "the task")
    other = _role(table, request.alternative, form.alternative, form.optional, "the alternative")
    block = _role(table, request.block, form.block, form.optional, "the block")
    for nth, row in enumerate(table.rows, start=1):
        if form.joint:
            named, choice = _joint(table, row, 0 if task is None else task, form.joint)
        else:
            named = str(nth) if task is None else cell(table, row, task)
            choice = "" if other is None else cell(table, row, other)
        none = _is_none(table, row, factors, request, form)
        profile = None if none else tuple(part.level(table, row) for part in factors)
        group = "1" if block is None else cell(table, row, block)
        yield _Seen(group, named, choice or str(nth), profile, row.line)


def _joint(table: Table, row: Row, place: int, pattern: str) -> tuple[str, str]:
    """Return task and alternative from one cell, such as set1.alt2."""
    found = re.fullmatch(pattern, row.cells[place])
    if found is None:
        raise InputError(
            f"{cut(row.cells[place])!r} should be called like set1.alt1; write the table with its"
            " row names",
            file=table.file,
            line=row.line,
            element=called(table, place),
        )
    return found[1], found[2] or "none"


def _is_none(
    table: Table,
    row: Row,
    factors: list[FactorColumns],
    request: TableRequest,
    form: TableForm,
) -> bool:
    """Return whether a row offers to choose nothing."""
    if _says_none(table, row, request, form):
        return True
    cells = [row.cells[place] for part in factors for place in part.places]
    return form.numbered and all(same(text, "0") for text in cells)


def _says_none(table: Table, row: Row, request: TableRequest, form: TableForm) -> bool:
    """Return whether some column says that a row offers to choose nothing."""
    for name, value in request.none.items():
        if same(row.cells[column(table, name, "the choice of nothing")], value):
            return True
    for name, value in form.none.items() if not request.none else ():
        place = find_column(table, name)
        if place is not None and same(row.cells[place], value):
            return True
    return False


# Rows by task ------------------------------------------------------------------------------


def _wide(table: Table, levels: Levels, request: TableRequest, form: TableForm) -> Iterator[_Seen]:
    """Yield alternatives of a table that has a row for each task."""
    patterns = {
        factor: request.columns.get(factor, (form.wide.replace("{name}", factor),))
        for factor in levels
    }
    words = request.alternatives or _alternatives(table, patterns)
    columns = {
        factor: [tuple(each.replace("{alt}", word) for each in names) for word in words]
        for factor, names in patterns.items()
    }
    found = _all_columns(table, levels, request, form, columns)
    factors = {word: [own[n] for own in found.values()] for n, word in enumerate(words)}
    task = _role(table, request.task, form.task, form.optional, "the task")
    block = _role(table, request.block, form.block, form.optional, "the block")
    for nth, row in enumerate(table.rows, start=1):
        named = str(nth) if task is None else cell(table, row, task)
        group = "1" if block is None else cell(table, row, block)
        for word, parts in factors.items():
            profile = tuple(part.level(table, row) for part in parts)
            yield _Seen(group, named, word, profile, row.line)
        for name, value in request.none.items():
            if same(row.cells[column(table, name, "the choice of nothing")], value):
                yield _Seen(group, named, f"none by {name}", None, row.line)


def _alternatives(table: Table, patterns: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Return the words that stand for {alt} in the header."""
    pattern = next(iter(patterns.values()))[0]
    if "{alt}" not in pattern:
        raise ConfigError(
            f"in a wide table a factor's column holds {{alt}}, such as {{alt}}_x; {pattern!r} does"
            " not",
            key="design.columns",
        )
    head, _, tail = pattern.partition("{alt}")
    form = re.compile(f"{re.escape(head)}(.+){re.escape(tail)}")
    found = [match[1] for name in table.header if (match := form.fullmatch(name))]
    if not found:
        example = pattern.replace("{alt}", "alt1")
        raise InputError(
            f"no column is called like {pattern!r}, such as {example!r}; there are"
            f" {listed(table.header)}",
            file=table.file,
        )
    return tuple(found)


# Columns -----------------------------------------------------------------------------------


def _role(table: Table, asked: str | None, name: str, optional: bool, what: str) -> int | None:
    """Return the column of a task, alternative or block; None where there is none."""
    if asked is not None:
        return column(table, asked, what)
    if not name:
        return None
    return find_column(table, name) if optional else column(table, name, what)


def _all_columns(
    table: Table,
    levels: Levels,
    request: TableRequest,
    form: TableForm,
    columns: Mapping[str, list[tuple[str, ...]]],
) -> dict[str, list[FactorColumns]]:
    """Return where factors stand, each once for each alternative that has columns of its own."""
    found = {}
    for factor, several in columns.items():
        places = [
            tuple(column(table, name, f"the factor {factor}") for name in names)
            for names in several
        ]
        effects = request.coding.get(factor) == "effects"
        if len(places[0]) > 1 and factor not in request.coding:
            own = [row for row in table.rows if not _says_none(table, row, request, form)]
            effects = has_effects_codes(replace(table, rows=tuple(own)), factor, places)
        codes = request.codes.get(factor, {})
        found[factor] = [
            FactorColumns(factor, levels[factor], codes, each, form.numbered, effects)
            for each in places
        ]
    return found


# Checks ------------------------------------------------------------------------------------


def _check(request: TableRequest, levels: Levels, form: TableForm) -> None:
    """Refuse a request that does not fit the factors."""
    asked = {"columns": request.columns, "codes": request.codes, "coding": request.coding}
    for key, named in asked.items():
        for factor in named:
            if factor not in levels:
                hint = did_you_mean(factor, levels)
                raise ConfigError(
                    f"no factor is called {factor!r}{hint}", key=f"design.{key}.{factor}"
                )
    _check_codes(request, levels)
    for factor, names in request.columns.items():
        most = len(levels[factor]) - 1
        if len(names) not in (1, most):
            raise ConfigError(
                f"{most + 1} levels take one column, or {most} of codes, not {len(names)}",
                key=f"design.columns.{factor}",
            )
    if request.alternatives and not form.wide:
        raise ConfigError("only wide tables take alternatives", key="design.alternatives")


def _check_codes(request: TableRequest, levels: Levels) -> None:
    """Refuse codes of levels that there are not."""
    for factor, codes in request.codes.items():
        for code, level in codes.items():
            if level not in levels[factor]:
                hint = did_you_mean(level, levels[factor])
                raise ConfigError(
                    f"{factor} has no level {level!r}{hint}", key=f"design.codes.{factor}.{code}"
                )


def _check_repeats(table: Table, seen: list[_Seen]) -> None:
    """Refuse alternatives that stand twice."""
    lines: dict[tuple[str, str, str], _Seen] = {}
    for each in seen:
        before = lines.setdefault((each.block, each.task, each.alternative), each)
        if before is not each:
            what = f"task {each.task} of block {each.block} has alternative {each.alternative}"
            same_row = " with the same levels" if before.profile == each.profile else ""
            raise InputError(
                f"{what} a second time{same_row}, first in line {before.line}",
                file=table.file,
                line=each.line,
            )


def _gathered(seen: list[_Seen]) -> tuple[Trial, ...]:
    """Return trials from their alternatives."""
    together: dict[tuple[str, str], list[Profile | None]] = {}
    for each in seen:
        together.setdefault((each.block, each.task), []).append(each.profile)
    return tuple(
        Trial(block, task, tuple(profiles)) for (block, task), profiles in together.items()
    )


def _check_alternatives(table: Table, seen: list[_Seen], trials: tuple[Trial, ...]) -> None:
    """Refuse tasks that lack alternatives, or show nothing."""
    most = max(len(trial.alternatives) for trial in trials)
    for trial in trials:
        wrong = ""
        if not any(trial.alternatives):
            wrong = "shows nothing"
        elif len(trial.alternatives) != most:
            count = len(trial.alternatives)
            wrong = f"has {count} alternatives and others have {most}; is a row missing?"
        if wrong:
            first = next(e for e in seen if (e.block, e.task) == (trial.block, trial.task))
            raise InputError(
                f"task {trial.task} of block {trial.block} {wrong}",
                file=table.file,
                line=first.line,
            )


def _with_shared(trials: tuple[Trial, ...], shared: str | None) -> tuple[Trial, ...]:
    """Return trials in which the shared block's have gone into all others."""
    fixed = [trial for trial in trials if trial.block == shared]
    blocks = dict.fromkeys(trial.block for trial in trials if trial.block != shared)
    if not fixed or not blocks:
        return trials
    return tuple(
        trial
        for block in blocks
        for trial in (
            *(replace(each, block=block, task=f"fixed{each.task}") for each in fixed),
            *(each for each in trials if each.block == block),
        )
    )
