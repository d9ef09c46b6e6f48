"""Says what vehicles are drawn as whose type no file defines, in one sentence."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from sumo3dviz_pt.model.scenario import TypeGuess

logger = logging.getLogger(__name__)

_NAMED = 3
"""Largest number of types that a note names for each vClass."""

_UNTOLD = "cars because nothing tells what they are"


def note_guesses(guesses: Sequence[TypeGuess], *, log: Path) -> None:
    """Say once a run what vehicles are drawn as whose type no file defines.

    Args:
        guesses: The types, and what is known of them.
        log: The vehicle log; each log has its own note.
    """
    if guesses:
        remedy = "Name their files in scenario.vehicle_types, or their classes in vehicles.types"
        text = guesses_in_words(guesses, remedy=remedy)
        logger.warning("%s: %s", log, text, extra={"once": f"types of {log}"})


def guesses_in_words(guesses: Sequence[TypeGuess], *, remedy: str) -> str:
    """Return one sentence on types that no file defines; empty where there are none.

    Args:
        guesses: The types, and what is known of them.
        remedy: What to do, as a clause that begins with a verb.
    """
    if not guesses:
        return ""
    # Types that nothing tells come first, as their pictures are likeliest to be wrong.
    groups: dict[tuple[bool, str, str], list[TypeGuess]] = {}
    for each in sorted(guesses, key=lambda each: (bool(each.vclass), -each.count)):
        groups.setdefault((bool(each.type_id), each.vclass, each.why), []).append(each)
    parts = [_in_words(group) for group in groups.values()]
    return f"no file defines the types of these vehicles: {'; '.join(parts)}. {remedy}"


def guess_notes(guesses: Sequence[TypeGuess]) -> list[str]:
    """Return the note of a proposal on types that no file defines, if there are some."""
    remedy = "Name files that define them by --additional, or correct vehicles.types"
    text = guesses_in_words(guesses, remedy=remedy)
    return [text] if text else []


def type_lines(guesses: Sequence[TypeGuess]) -> list[str]:
    """Return the lines of a scene file's section `vehicles` that keep what was guessed."""
    told = [each for each in guesses if each.vclass and each.type_id]
    if not told:
        return []
    lines = [f"    {_quoted(each.type_id)}: {each.vclass}  # {each.why}" for each in told]
    return ["vehicles:", "  types:  # no file defines these; correct what is wrong", *lines]


def _in_words(group: Sequence[TypeGuess]) -> str:
    """Return what the vehicles of types of one class are drawn as."""
    first = group[0]
    count = sum(each.count for each in group)
    told = f"vClass {first.vclass} because {first.why}" if first.vclass else _UNTOLD
    if not first.type_id:
        return f"{count} without a type drawn as {told}"
    names = ", ".join(repr(each.type_id) for each in group[:_NAMED])
    more = f" and {len(group) - _NAMED} more" if len(group) > _NAMED else ""
    return f"{names}{more} ({count} of them) drawn as {told}"


def _quoted(text: str) -> str:
    """Return a key as YAML."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
