"""Passes SUMO's warnings on as notes: each kind once, with a count where there are many."""

from __future__ import annotations

import logging
import re

log = logging.getLogger(__name__)

_HEAD = "Warning: "
_NAMES = re.compile(r"'[^']*'|\d+(?:\.\d+)?")
_OF_INSTALLATION = "Environment variable SUMO_HOME is not set"
"""What says nothing of the simulation: SUMO does not check XML against its schemes then."""

_KINDS = 12
"""Kinds of warnings that are told; a broken simulation has hundreds."""


def pass_on(said: str) -> None:
    """Log the warnings among what SUMO has printed.

    Args:
        said: All of it.
    """
    kinds: dict[str, list[str]] = {}
    for text in _warnings(said):
        kinds.setdefault(_NAMES.sub("", text), []).append(text)
    for same in list(kinds.values())[:_KINDS]:
        many = len(same) - 1
        more = f" ({many} more of this kind)" if many else ""
        log.warning("SUMO warns: %s%s", same[0], more)
    rest = sum(len(same) for same in list(kinds.values())[_KINDS:])
    if rest:
        log.warning("SUMO warns of more: %d times, of %d kinds", rest, len(kinds) - _KINDS)


def _warnings(said: str) -> list[str]:
    """Return the warnings; one that goes on in an indented line is one."""
    found: list[str] = []
    for line in said.splitlines():
        if line.startswith(_HEAD):
            found.append(line.removeprefix(_HEAD).strip())
        elif found and line[:1].isspace() and line.strip():
            found[-1] += f" {line.strip()}"
    return [text for text in found if not text.startswith(_OF_INSTALLATION)]
