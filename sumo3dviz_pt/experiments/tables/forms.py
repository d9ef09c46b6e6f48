"""The forms of design tables: which columns the tools that write them have.

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

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType


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
