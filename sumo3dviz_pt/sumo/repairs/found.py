"""Collect what is odd in a network, and say all of it in one note."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from sumo3dviz_pt.errors import cut

logger = logging.getLogger(__name__)


class Oddity(Enum):
    """What is odd, for one object and for several, and what is done about it."""

    SHORT = ("lane shorter than 10 cm", "lanes shorter than 10 cm", "left as given")
    NARROW = ("lane narrower than 10 cm", "lanes narrower than 10 cm", "left as given")
    NO_WIDTH = ("lane without a width", "lanes without a width", "drawn 3.2 m wide")
    NO_LENGTH = (
        "lane without a length above 0",
        "lanes without a length above 0",
        "measured along the shape",
    )
    NO_SHAPE = ("lane without a shape", "lanes without a shape", "drawn straight from end to end")
    REVERSING = (
        "lane that doubles back on itself",
        "lanes that double back on themselves",
        "drawn as given",
    )
    NO_LANE = ("edge without lanes", "edges without lanes", "left out")
    NO_PLACE = ("junction without a place", "junctions without a place", "put into its shape")
    NO_OUTLINE = (
        "junction without an outline",
        "junctions without an outline",
        "drawn by the lanes alone",
    )
    CROSSED_JUNCTION = (
        "junction whose outline crosses itself",
        "junctions whose outlines cross themselves",
        "all that the lines enclose is drawn",
    )
    CROSSED_AREA = (
        "walking area whose outline crosses itself",
        "walking areas whose outlines cross themselves",
        "all that the lines enclose is drawn",
    )
    NO_AREA = (
        "walking area of fewer than 3 points",
        "walking areas of fewer than 3 points",
        "not drawn",
    )


@dataclass(slots=True)
class Oddities:
    """What is odd in a network: how often, and where first."""

    counts: dict[Oddity, int] = field(default_factory=dict)
    firsts: dict[Oddity, str] = field(default_factory=dict)

    def add(self, oddity: Oddity, own: str) -> None:
        """Count one more object by its id."""
        self.counts[oddity] = self.counts.get(oddity, 0) + 1
        self.firsts.setdefault(oddity, own)

    @property
    def sentence(self) -> str:
        """All of it in one sentence; empty where nothing is odd."""
        parts = []
        for oddity in Oddity:
            count = self.counts.get(oddity, 0)
            if count:
                one, many, done = oddity.value
                what = one if count == 1 else many
                parts.append(f"{count} {what}, {done} (first: `{cut(self.firsts[oddity])}`)")
        return "the network has " + "; ".join(parts) if parts else ""

    def say(self, file: Path) -> None:
        """Note it, if there is anything to note.

        Args:
            file: The network's file.
        """
        if self.counts:
            once = {"once": f"oddities of {file}"}
            logger.warning("%s: %s", file, self.sentence, extra=once)
