"""Turns a design table into trials, whatever its form.

A form says which columns the tools that write such tables have. A row says of each factor a level's
name, number, value or codes.

References:
    cbcTools 0.7 (R): `cbc_design()` has profileID, respID, qID, altID, obsID, and profileID 0 with
    no_choice 1 where nothing can be chosen, https://jhelvy.github.io/cbcTools/
    idefix 1.1 (R): rows are called set1.alt1, columns are dummy or effects codes (Var12 is the
    second level of Var1); doi:10.18637/jss.v096.i03
    spdesign 0.0.5 (R): a row for each task with alt1_x1, alt2_x1 and block,
    https://spdesign.edsandorf.me/
    ChoiceMetrics (2018): Ngene 1.2 user manual: Choice situation, alt1.x1, alt2.x1, Block
    Sawtooth Software, Lighthouse Studio: Importing/Exporting CBC Designs: version (0 is fixed),
    task, concept, then the number of each attribute's level, 0 in a concept that is none
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.studies.designs.cells import (
    Table,
    TableRow,
    called,
    cell,
    column,
    find_column,
    listed,
    number,
    same,
)
from sumo3dviz_pt.studies.designs.trials import Levels, Profile, Trial


@dataclass(frozen=True, slots=True)
class TableForm:
    """How a tool writes designs.

    Attributes:
        task: Column of the choice task.
        alternative: Column of the alternative; the task's where `joint` reads both from it.
        block: Column of the block, version or respondent; "" where there is none.
        optional: Whether those columns may be missing; without tasks each row is a trial.
        joint: Pattern of cells that hold both task and alternative.
        wide: What a factor's columns are called in a row for each task; "" for rows by alternative.
        numbered: Whether cells are the numbers of levels, from 1.
        none: Column and value that mark a row as the choice of nothing, where the column exists.
        shared: Block whose tasks all other blocks have, too.
    """

    task: str
    alternative: str = ""
    block: str = ""
    optional: bool = False
    joint: str = ""
    wide: str = ""
    numbered: bool = False
    none: Mapping[str, str] = field(default_factory=dict)
    shared: str | None = None


FORMS: Mapping[str, TableForm] = MappingProxyType(
    {
        "long": TableForm("task", "alternative", "block", optional=True),
        "wide": TableForm("task", block="block", optional=True, wide="{alt}_{name}"),
        "cbctools": TableForm("qID", "altID", "respID", none={"profileID": "0", "no_choice": "1"}),
        "idefix": TableForm("", joint=r"set(\d+)\.(?:alt(\d+)|no\.choice)"),
        "spdesign": TableForm("", block="block", optional=True, wide="{alt}_{name}"),
        "ngene": TableForm("Choice situation", block="Block", optional=True, wide="{alt}.{name}"),
        "sawtooth": TableForm("Task", "Concept", "Version", numbered=True, shared="0"),
    }
)
"""Forms by the names that study files give them."""


@dataclass(frozen=True, slots=True)
class TableRequest:
    """How a table is to be read.

    Attributes:
        form: A name from `FORMS`.
        columns: One column by factor, or the columns of its codes; its own name if left out.
        codes: Levels by what cells hold, by factor.
        alternatives: Of a wide table; empty looks for them in the header.
        task, alternative, block: Columns instead of the form's.
        none: Column and value of rows that offer to choose nothing; instead of the form's.
        coding: `dummy` or `effects` by factor, where several columns hold codes and do not tell.
    """

    form: str = "long"
    columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    codes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    alternatives: tuple[str, ...] = ()
    task: str | None = None
    alternative: str | None = None
    block: str | None = None
    none: Mapping[str, str] = field(default_factory=dict)
    coding: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FactorColumns:
    """Where a factor stands in a table.

    Attributes:
        factor: Its name.
        levels: Names of its levels.
        codes: Levels by what cells hold.
        places: Of its column, or of all columns of its codes.
        numbered: Whether cells are the numbers of levels, from 1.
        effects: Whether several columns hold effects codes, and not dummy codes.
    """

    factor: str
    levels: Sequence[str]
    codes: Mapping[str, str]
    places: tuple[int, ...]
    numbered: bool = False
    effects: bool = False

    def level(self, table: Table, row: TableRow) -> str:
        """Return the level of a row.

        Raises:
            InputError: If it is none.
        """
        if len(self.places) == 1:
            return self._named(table, row)
        return self._coded(table, row)

    def _named(self, table: Table, row: TableRow) -> str:
        """Return the level that a single cell names."""
        place = self.places[0]
        text = cell(table, row, place)
        for code, level in self.codes.items():
            if same(text, code):
                return level
        if self.numbered:
            at = number(text)
            if at is not None and at.is_integer() and 1 <= at <= len(self.levels):
                return self.levels[int(at) - 1]
            known = f"; levels are numbered from 1 to {len(self.levels)}"
        else:
            for level in self.levels:
                if same(text, level):
                    return level
            known = did_you_mean(text, self.levels)
        raise InputError(
            f"{cut(text)!r} is no level of {self.factor}{known} (design.codes says what others"
            " mean)",
            file=table.file,
            line=row.line,
            element=called(table, place),
        )

    def _coded(self, table: Table, row: TableRow) -> str:
        """Return the level that dummy or effects codes give.

        In dummy codes (0, 1) the first level has no column and is all zeros; in effects codes
        (-1, 0, 1) the last level has none and is all -1.
        """
        codes = tuple(number(cell(table, row, place)) for place in self.places)
        last = len(self.levels) - 1
        if codes == (-1 if self.effects else 0,) * last:
            return self.levels[last if self.effects else 0]
        if set(codes) <= {0, 1} and codes.count(1) == 1:
            return self.levels[codes.index(1) + (0 if self.effects else 1)]
        text = ", ".join(row.cells[place] for place in self.places)
        raise InputError(
            f"{cut(text)} are no {'effects' if self.effects else 'dummy'} codes of {self.factor}"
            f" (design.coding says which they are)",
            file=table.file,
            line=row.line,
            element=called(table, self.places[0]),
        )


def has_effects_codes(table: Table, factor: str, places: Sequence[tuple[int, ...]]) -> bool:
    """Return whether columns hold effects codes, and not dummy codes.

    A row of nothing but -1 is the last level in effects codes, one of nothing but 0 the first in
    dummy codes. Where a table has neither, its names tell: R counts the columns of dummy codes from
    2 on, as the first level has none, and those of effects codes from 1 on.

    Args:
        table: The table.
        factor: The factor's name.
        places: Of its columns; several times in a row for each task.

    Raises:
        InputError: If nothing tells, or a table has both.
    """
    kinds = {
        tuple(number(row.cells[place]) for place in own) for row in table.rows for own in places
    }
    minus, zero = ((value,) * len(places[0]) in kinds for value in (-1, 0))
    if minus != zero:
        return minus
    names = [table.header[place] for place in places[0]]
    shared = next((n for n, signs in enumerate(zip(*names, strict=False)) if len({*signs}) > 1), 0)
    ends = [name[shared:] for name in names]
    for first in (1, 2):
        if not minus and ends == [str(first + n) for n in range(len(ends))]:
            return first == 1
    why = "rows of -1 and rows of 0" if minus else "neither rows of -1 nor rows of 0"
    raise InputError(
        f"the columns of {factor} hold {why}, so they may be dummy or effects codes; say which:"
        f" design.coding: {{{factor}: dummy}}, or effects",
        file=table.file,
    )


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


def _joint(table: Table, row: TableRow, place: int, pattern: str) -> tuple[str, str]:
    """Return task and alternative from one cell, such as set1.alt2."""
    match = re.fullmatch(pattern, row.cells[place])
    if match is None:
        raise InputError(
            f"{cut(row.cells[place])!r} should be called like set1.alt1; write the table with its"
            " row names",
            file=table.file,
            line=row.line,
            element=called(table, place),
        )
    return match[1], match[2] or "none"


def _is_none(
    table: Table,
    row: TableRow,
    factors: list[FactorColumns],
    request: TableRequest,
    form: TableForm,
) -> bool:
    """Return whether a row offers to choose nothing."""
    if _says_none(table, row, request, form):
        return True
    cells = [row.cells[place] for part in factors for place in part.places]
    return form.numbered and all(same(text, "0") for text in cells)


def _says_none(table: Table, row: TableRow, request: TableRequest, form: TableForm) -> bool:
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
    coded = _all_columns(table, levels, request, form, columns)
    factors = {word: [own[n] for own in coded.values()] for n, word in enumerate(words)}
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
    names = [match[1] for name in table.header if (match := form.fullmatch(name))]
    if not names:
        example = pattern.replace("{alt}", "alt1")
        raise InputError(
            f"no column is called like {pattern!r}, such as {example!r}; there are"
            f" {listed(table.header)}",
            file=table.file,
        )
    return tuple(names)


# Columns -----------------------------------------------------------------------------------


def _role(table: Table, wanted: str | None, name: str, optional: bool, what: str) -> int | None:
    """Return the column of a task, alternative or block; None where there is none."""
    if wanted is not None:
        return column(table, wanted, what)
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
    by_factor = {}
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
        by_factor[factor] = [
            FactorColumns(factor, levels[factor], codes, each, form.numbered, effects)
            for each in places
        ]
    return by_factor


# Checks ------------------------------------------------------------------------------------


def _check(request: TableRequest, levels: Levels, form: TableForm) -> None:
    """Refuse a request that does not fit the factors."""
    requested = {"columns": request.columns, "codes": request.codes, "coding": request.coding}
    for key, named in requested.items():
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
