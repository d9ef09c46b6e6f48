"""Note damaged files of SUMO that a search would otherwise pass over."""

from __future__ import annotations

import logging
import re
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo.stream import chunks, read_elements

logger = logging.getLogger(__name__)

_WHAT = {
    # Root element: what such a file holds.
    "net": "a network",
    "fcd-export": "a vehicle log",
    "tlsStates": "a signal log",
    "routes": "vehicle types",
    "additional": "objects or vehicle types",
    "additionals": "objects or vehicle types",
    "add": "objects or vehicle types",
    "shapes": "objects",
    "vTypes": "vehicle types",
    "configuration": "a configuration",
    "sumoConfiguration": "a configuration",
}
_NAMES = frozenset({"net", "add", "rou", "fcd", "poly", "sumocfg"})
"""Parts of file names by which SUMO's files are known."""

_COMMENTS = re.compile(rb"<!--.*?-->", re.DOTALL)
_FIRST_TAG = re.compile(rb"<([A-Za-z][\w.-]*)")


def note_damage(file: Path) -> None:
    """Say that a file of SUMO is left out because it is damaged; nothing of other files.

    Args:
        file: A file whose root element cannot be read.
    """
    try:
        head = next(chunks(file), b"")
    except InputError as error:
        # What it held cannot be told any more, unless by its name.
        if _NAMES & set(file.name.split(".")):
            _note(file, f"{error}; the file is left out")
        return
    found = _FIRST_TAG.search(_COMMENTS.sub(b"", head))
    what = _WHAT.get(found[1].decode("ascii", errors="replace")) if found else None
    if what is None:
        return
    try:
        for _ in read_elements(file, root=(), what="a file of SUMO"):
            pass
    except InputError as error:
        _note(file, f"{error}; it seems to hold {what} and is left out")


def _note(file: Path, text: str) -> None:
    """Say it once a run."""
    logger.warning("%s", text, extra={"once": f"damage of {file}"})
