"""Says what vehicles are drawn as whose type no file defines, in one sentence."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from sumo3dviz_pt.model.scenario import TypeGuess

logger = logging.getLogger(__name__)

_NAMED = 6
"""Largest number of types that a note names."""


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
    ordered = sorted(guesses, key=lambda each: (bool(each.vclass), -each.count))
    parts = [_in_words(each) for each in ordered[:_NAMED]]
    more = len(ordered) - len(parts)
    parts += [f"and {more} more"] if more else []
    return f"no file defines these vehicle types: {'; '.join(parts)}. {remedy}"


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


def _in_words(guess: TypeGuess) -> str:
    """Return what the vehicles of one type are drawn as."""
    count = f"{guess.count} vehicle{'' if guess.count == 1 else 's'}"
    if not guess.type_id:
        return f"{count} without a type, drawn as {guess.vclass} because of their ids"
    if not guess.vclass:
        return f"{guess.type_id!r} of {count}, drawn as a car because nothing tells what it is"
    return f"{guess.type_id!r} of {count}, drawn as {guess.vclass} because {guess.why}"


def _quoted(text: str) -> str:
    """Return a key as YAML."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
