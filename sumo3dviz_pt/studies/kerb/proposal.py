"""Proposes a study of gap acceptance: a camera at a kerb, a pair's gaps, what is left out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from glob import escape
from typing import Any

import numpy as np
import yaml

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.surroundings import TrafficSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.pipeline.changed_traffic import in_the_way
from sumo3dviz_pt.studies.kerb.pairs import KerbPair, KerbPassage
from sumo3dviz_pt.studies.kerb.place import Kerb

GAPS: Mapping[str, float] = {"short": 3.0, "medium": 5.0, "long": 7.0}
"""Levels that are proposed [s]: what few people take, and what most do."""

_EYE = 1.6
"""Height of the eyes above the road [m]."""

_FOV = 75.0
"""Opening angle of the lens [deg]."""

_MARGIN = 8.0
"""How far within the edge of the picture the farthest place of a vehicle lies [deg]."""

_FAR = 6.0
"""How long before it arrives a vehicle is looked at [s]."""

_BEFORE, _AFTER = 2.0, 1.5
"""How long the film runs before the first one comes, and after the last one [s]."""

_TRIES = 12
"""How many pairs are tried for a proposal."""


@dataclass(frozen=True, slots=True, eq=False)
class KerbProposal:
    """A study of one pair.

    Attributes:
        pair: The two vehicles.
        gaps: By the level's name [s]; those at which no vehicle drives through another.
        leave_out: Ids of vehicles that would pass, too, or stand in the way.
        clip: First and last time of the films [s].
        position: Of the camera, (3,) [m].
        look_at: (3,) [m].
    """

    pair: KerbPair
    gaps: Mapping[str, float]
    leave_out: tuple[str, ...]
    clip: tuple[float, float]
    position: Floats
    look_at: Floats


def proposal(
    job: Job,
    scenario: Scenario,
    kerb: Kerb,
    came: Sequence[KerbPassage],
    pairs: Sequence[KerbPair],
) -> KerbProposal | None:
    """Return a study of the first pair that can have several gaps; None if there is none.

    Args:
        job: The scene file.
        scenario: All of it, as recorded.
        kerb: The place.
        came: Passages in all of the log.
        pairs: To choose from, the best first.
    """
    for pair in pairs[:_TRIES]:
        gaps, leave_out = _possible(job, scenario, came, pair)
        if len(gaps) > 1:
            clip = _clip(pair, max(gaps.values()))
            position = np.append(kerb.position, kerb.height + _EYE)
            look_at = _look_at(kerb, pair, scenario.network.location)
            return KerbProposal(pair, gaps, leave_out, clip, position, look_at)
    return None


def _clip(pair: KerbPair, longest: float) -> tuple[float, float]:
    """Return first and last time of films whose longest gap is so long [s]."""
    begin = math.floor(pair.first.arrives - _BEFORE)
    return max(begin, 0), math.ceil(pair.first.leaves + longest + _AFTER)


def _possible(
    job: Job, scenario: Scenario, came: Sequence[KerbPassage], pair: KerbPair
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the gaps that a pair can have, and the vehicles to leave out for them."""
    own = {pair.first.id, pair.then.id}
    gaps: dict[str, float] = {}
    begin, end = _clip(pair, max(GAPS.values()))
    # No other vehicle is to pass in the film, on whichever lane and from whichever side: it would
    # end a gap, offer one more, or come from behind people's backs.
    passing = (each.id for each in came if each.leaves >= begin and each.arrives <= end)
    leave_out = dict.fromkeys((*pair.leave_out, *passing))
    for name, gap in sorted(GAPS.items(), key=lambda item: item[1]):
        others = [each for each in leave_out if each not in own]
        edited = _edited(job, pair, gap, others)
        try:
            blocking = in_the_way(edited, scenario, begin=begin, end=end)
        except ConfigError:  # the second one does not come by so much earlier or later
            continue
        if own & {*blocking}:
            continue
        leave_out |= dict.fromkeys(blocking)
        gaps[name] = gap
    return gaps, tuple(each for each in leave_out if each not in own)


def _edited(job: Job, pair: KerbPair, gap: float, others: Sequence[str]) -> Job:
    """Return the scene file with the pair's gap, and others left out."""
    ride = {"behind": pair.first.id, "gap": f"{gap:g} s", "at": round(pair.first.leaves, 2)}
    ride["moves"] = "self"
    before = job.traffic or TrafficSettings()
    wanted = {
        "rides": {pair.then.id: ride},
        "leave_out": [*before.leave_out, *map(escape, others)],
        "share": before.share,
    }
    return job.model_copy(update={"traffic": TrafficSettings.model_validate(wanted)})


def _look_at(kerb: Kerb, pair: KerbPair, location: Location) -> Floats:
    """Return where a camera looks that sees both vehicles from afar until they are there, (3,) [m].

    From where they come it is turned towards the way across, as far as the lens allows.
    """
    times = [pair.then.arrives - away for away in (_FAR, 5.0, 4.0, 3.0, 2.0)]
    poses = [pose for time in times if (pose := pair.then.ride.at(time)) is not None]
    if not poses:
        return np.append(kerb.across[1], kerb.height + 1.2)
    far = location.outside(poses[0].position)[:2] - kerb.position
    over = kerb.across[1] - kerb.across[0]
    turn = _angle(over) - _angle(far)
    turn = (turn + math.pi) % (2.0 * math.pi) - math.pi
    most = math.radians(_FOV / 2.0 - _MARGIN)
    aim = _angle(far) + math.copysign(min(abs(turn), most), turn)
    level = kerb.position + 20.0 * np.array([math.cos(aim), math.sin(aim)])
    return np.append(level, kerb.height + 1.2)


def _angle(vector: Floats) -> float:
    """Return an angle from east, counter-clockwise [rad]."""
    return math.atan2(float(vector[1]), float(vector[0]))


# As a study file ----------------------------------------------------------------------------


def as_study(made: KerbProposal, scene: str) -> str:
    """Return a proposal as a study file.

    Args:
        made: The proposal.
        scene: The scene file, as the study file is to name it.
    """
    begin, end = made.clip
    pair = made.pair
    lines = [
        f"# {pair.first.id}, then {pair.then.id}: {pair.gap:.2f} s apart in the log.",
        *(f"# Note: {note}." for note in pair.notes() if note),
        f"scene: {_word(scene)}",
        f"clip: {{camera: kerb, from: {begin:g}, to: {end:g}}}",
        "common:",
        "  quality: study",
        "  cameras.kerb:",
        "    mode: eulerian",
        f"    position: {_numbers(made.position)}   # eyes {_EYE:g} m above the road",
        f"    look_at: {_numbers(made.look_at)}   # to where they come from",
        f"    lens: {{fov: {_FOV:g}}}",
    ]
    if made.leave_out:
        names = ", ".join(_word(escape(each)) for each in made.leave_out)
        lines += [
            "  # These vehicles would pass in the films, too, or stand in the way.",
            f"  traffic.leave_out: [{names}]",
        ]
    lines += ["factors:", "  gap:", "    about: gap between two vehicles", "    levels:"]
    for name, gap in made.gaps.items():
        ride = (
            f"{{behind: {_word(pair.first.id)}, gap: {gap:g} s, at: {pair.first.leaves:.2f},"
            " moves: self}"
        )
        lines.append(f"      {name}:")
        lines.append(f"        traffic: {{rides: {{{_word(pair.then.id)}: {ride}}}}}")
    return "\n".join([*lines, *_QUESTION, ""])


_QUESTION = (
    "question:",
    "  during:",
    "    keys: [space]",
    "    button: I would cross",
    "    text: Press when you would begin to cross.",
    "    only: true               # nothing is asked after a film",
)


def _numbers(values: Floats) -> str:
    """Return numbers as YAML has them."""
    return f"[{', '.join(f'{value:.2f}' for value in values)}]"


def _word(text: str) -> str:
    """Return text as YAML has it, in quotes where it would be something else."""
    plain: Any = yaml.safe_dump(
        [text], default_flow_style=True, width=1_000_000, allow_unicode=True
    )
    return str(plain).strip()[1:-1]
