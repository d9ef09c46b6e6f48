"""Lists the pairs of vehicles that pass a kerb, and writes a study of one of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.pipeline.reading import read_files
from sumo3dviz_pt.studies.kerb.pairs import KerbPair, KerbPassage, pairs_in, passages
from sumo3dviz_pt.studies.kerb.place import Kerb, kerb_at
from sumo3dviz_pt.studies.kerb.proposal import KerbProposal, proposal

MOST = 20
"""Most pairs that are listed for people."""


@dataclass(frozen=True, slots=True, eq=False)
class KerbReport:
    """What passes a kerb.

    Attributes:
        kerb: The place.
        passages: Of all vehicles, in order.
        pairs: The most useful first.
        proposal: A study of one of them; None if none can have several gaps.
        picked: Number of the pair that was asked for, from 1; 0 for none.
    """

    kerb: Kerb
    passages: tuple[KerbPassage, ...]
    pairs: tuple[KerbPair, ...]
    proposal: KerbProposal | None
    picked: int = 0


def at_kerb(
    job: Job,
    place: str,
    *,
    begin: float | None = None,
    end: float | None = None,
    pick: int | None = None,
) -> KerbReport:
    """Return which pairs of vehicles pass a kerb, and a study of one of them.

    Args:
        job: The scene file.
        place: As `kerb_at` has it.
        begin: First time [s]; None is the log's.
        end: Last time [s]; None is the log's.
        pick: Number of the pair to propose, from 1; None takes the best that nothing is against.

    Raises:
        ConfigError: If there is no such place or pair.
        InputError: If a file is missing or damaged.
    """
    _, scenario = read_files(job)
    kerb = kerb_at(job, scenario.network, place)
    low, high = (-math.inf if begin is None else begin), (math.inf if end is None else end)
    everybody = passages(job, scenario, kerb)
    came = [each for each in everybody if low <= each.arrives <= high]
    pairs = pairs_in(job, scenario, kerb, came=came, everybody=everybody)
    if pick is not None and not 1 <= pick <= len(pairs):
        raise ConfigError(f"there are {len(pairs)} pairs; give 1 to {len(pairs)}", key="pick")
    chosen = [pairs[pick - 1]] if pick else [pair for pair in pairs if pair.is_proposed]
    made = proposal(job, scenario, kerb, everybody, chosen)
    return KerbReport(kerb, tuple(came), tuple(pairs), made, pick or 0)


_HEAD = (
    *("no", "first", "front [s]", "rear [s]", "then", "front [s]", "gap [s]", "m/s"),
    *("from", "lane", "class", "against it"),
)


def kerb_lines(report: KerbReport) -> list[str]:
    """Return the pairs as people read them, a line each after a head, and what is proposed."""
    x, y = report.kerb.position
    where = f" ({report.kerb.words})" if report.kerb.words else ""
    come = len(report.passages)
    by = "1 vehicle comes by" if come == 1 else f"{come} vehicles come by"
    lines = [f"kerb at {x:.1f}, {y:.1f}{where}; {by}"]
    if not report.pairs:
        none = "no two of them follow each other on one lane within 30 s; choose a busier place:"
        return [*lines, f"{none} the command vehicles without --kerb lists who drives where"]
    shown = report.pairs[:MOST]
    cells = [_HEAD, *(_row(k, pair) for k, pair in enumerate(shown, start=1))]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines += ["  ".join(map(str.ljust, row, widths)).rstrip() for row in cells]
    more = len(report.pairs) - len(shown)
    return [*lines, *([f"and {more} more; --json has all"] if more else []), "", *_pick(report)]


def _pick(report: KerbReport) -> list[str]:
    """Return which pair is proposed, or why none is."""
    made = report.proposal
    if made is None:
        if report.picked:
            return [f"pair {report.picked} cannot be shown with two gaps: it would drive through"
                    " the other one, or does not come by; pick another"]  # fmt: skip
        return [_none_proposed(report.pairs)]
    number = 1 + next(k for k, pair in enumerate(report.pairs) if pair is made.pair)
    gaps = ", ".join(f"{gap:g} s" for gap in made.gaps.values())
    return [f"proposed: pair {number} with gaps of {gaps}; --pick NO takes another"]


def _none_proposed(pairs: Sequence[KerbPair]) -> str:
    """Return what is against all pairs, how often, and where it would be better."""
    both = [(pair.first, pair.then) for pair in pairs]
    reasons = (
        (sum(any(pair.braking) for pair in pairs), "brake near the kerb", "farther from junctions"),
        (
            sum(any(each.appears for each in pair) for pair in both),
            "appear in sight of it",
            "farther from where rides begin",
        ),
        (sum(any(not each.is_car for each in pair) for pair in both), "are no cars", ""),
        (sum(pair.is_proposed for pair in pairs), "cannot be shown with two gaps", ""),
    )
    counts = ", ".join(f"in {count} they {why}" for count, why, _ in reasons if count)
    places = " and ".join(where for count, _, where in reasons if count and where)
    better = f"choose a place {places}, or take one" if places else "take one"
    many = "1 pair" if len(pairs) == 1 else f"{len(pairs)} pairs"
    return f"no pair is proposed: of {many}, {counts}; {better} all the same: --pick NO"


def _row(number: int, pair: KerbPair) -> tuple[str, ...]:
    """Return a pair's cells."""
    first, then = pair.first, pair.then
    notes = pair.notes()
    remarks = "; ".join(notes[:3]) + (f"; and {len(notes) - 3} more" if len(notes) > 3 else "")
    classes = dict.fromkeys((first.vclass, then.vclass))
    return (
        str(number), first.id, f"{first.arrives:.2f}", f"{first.leaves:.2f}",
        then.id, f"{then.arrives:.2f}", f"{pair.gap:.2f}", f"{then.speed:.1f}",
        then.side, then.lane, ", ".join(classes), remarks,
    )  # fmt: skip


def kerb_dicts(report: KerbReport) -> dict[str, Any]:
    """Return all that was found, for JSON."""
    return {
        "position": _rounded(report.kerb.position),
        "across": [_rounded(end) for end in report.kerb.across],
        "pairs": [_plain(k, pair) for k, pair in enumerate(report.pairs, start=1)],
    }


def _plain(number: int, pair: KerbPair) -> dict[str, Any]:
    """Return a pair for JSON."""
    return {
        "no": number,
        "first": _passage(pair.first),
        "then": _passage(pair.then),
        "gap": round(pair.gap, 3),
        "between": [_passage(each) for each in pair.between],
        "turning": list(pair.turning),
        "braking": list(pair.braking),
        "proposed": pair.is_proposed,
    }


def _passage(each: KerbPassage) -> dict[str, Any]:
    """Return a passage for JSON."""
    return {
        "id": each.id, "type": each.kind, "class": each.vclass,
        "arrives": round(each.arrives, 3), "leaves": round(each.leaves, 3),
        "speed": round(each.speed, 3), "from": each.side, "lane": each.lane,
    }  # fmt: skip


def _rounded(values: Floats) -> list[float]:
    """Return lengths to a centimetre."""
    return [round(float(value), 2) for value in values]
