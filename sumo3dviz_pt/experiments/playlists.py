"""Playlists: who sees which trials, in which order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.designs.latin import balanced_orders
from sumo3dviz_pt.experiments.designs.parts import shared_out
from sumo3dviz_pt.experiments.shuffles import permutation, shuffled
from sumo3dviz_pt.experiments.trials import Trial

Order = Literal["latin", "random", "as_written"]

MOST_PLAYLISTS = 10_000
"""Most playlists of a study."""

MOST_BALANCED = 1000
"""Most trials of a block whose orders are balanced: the square has as many rows, or twice."""

MOST_SHOWN = 2_000_000
"""Most trials that all playlists show together."""


TURNED = "~"
"""Stands between a task's name and by how many places its films were turned."""


@dataclass(frozen=True, slots=True)
class Playlist:
    """What one participant, or one group of them, sees.

    Attributes:
        name: From "1" on.
        block: Of its trials; with several parts, the block and the part, such as "1.2".
        trials: In order; a trial may come again.
    """

    name: str
    block: str
    trials: tuple[Trial, ...]


def build_playlists(
    trials: Sequence[Trial],
    *,
    order: Order,
    count: int | None,
    parts: int,
    repeat: int,
    seed: int,
) -> tuple[Playlist, ...]:
    """Return playlists in which orders are counterbalanced.

    Args:
        trials: Of all blocks.
        order: `latin` shows every trial at every position, and after every other, equally often;
            `random` shuffles each playlist; `as_written` keeps the design's order.
        count: How many; None is what the order needs.
        parts: Into how many groups each block's trials are shared out, as evenly as can be.
        repeat: How often each trial is shown; all of them once before any again.
        seed: The study's.

    Raises:
        ConfigError: If there are fewer playlists than groups, fewer trials than parts, or too many.
    """
    groups = _groups(trials, parts, seed)
    _check_balanced(groups, order)
    turns = _turns(groups, order, count)
    _check_shown(sum(repeat * len(groups[block]) for block, _ in turns))
    orders = {
        block: _Orders(order, tuple(own), block=block, seed=seed) for block, own in groups.items()
    }
    return tuple(
        Playlist(str(number), block, orders[block].rounds(turn, repeat))
        for number, (block, turn) in enumerate(turns, start=1)
    )


def with_even_places(
    playlists: Sequence[Playlist], *, count: int | None, seed: int
) -> tuple[Playlist, ...]:
    """Return playlists in which every film of a task stands at every place equally often.

    Each order comes as often as a task has films. Half of a playlist's tasks of two films are
    turned, and in its twin the other half; so no place goes with a position, a level or a person.

    Args:
        playlists: In which tasks are as the design has them.
        count: How many are wanted; None is all.
        seed: The study's.

    Raises:
        ConfigError: If these are too many.
    """
    times = most_placed([trial for playlist in playlists for trial in playlist.trials])
    wanted = len(playlists) * times if count is None else count
    if wanted > MOST_PLAYLISTS:
        raise ConfigError(
            f"balanced places need {wanted:,} playlists, and at most {MOST_PLAYLISTS:,} are made;"
            " say how many",
            key="playlists.count",
        )
    found: list[Playlist] = []
    for playlist in playlists:
        own = list(dict.fromkeys(playlist.trials))
        mixed = permutation(len(own), seed, "places", playlist.name)
        steps = {own[n]: place for place, n in enumerate(mixed)}
        for turn in range(times):
            trials = tuple(_turned(trial, steps[trial] + turn) for trial in playlist.trials)
            found.append(Playlist(str(len(found) + 1), playlist.block, trials))
    return tuple(found[:wanted])


def most_placed(trials: Sequence[Trial]) -> int:
    """Return the most films that a trial has side by side; to choose nothing stays last."""
    return max(sum(profile is not None for profile in trial.alternatives) for trial in trials)


def _turned(trial: Trial, steps: int) -> Trial:
    """Return a trial whose films have changed places; it has a name of its own.

    Args:
        trial: As the design has it.
        steps: By how many places each film moves to the front, round and round.
    """
    films = [profile for profile in trial.alternatives if profile is not None]
    steps %= len(films)
    if not steps:
        return trial
    moved = iter([*films[steps:], *films[:steps]])
    places = tuple(None if each is None else next(moved) for each in trial.alternatives)
    return Trial(trial.block, f"{trial.task}{TURNED}{steps}", places)


def uneven_groups(playlists: Sequence[Playlist]) -> list[str]:
    """Return the groups in which trials do not stand at all positions equally often.

    A trial whose films have changed places is the same.
    """
    found: dict[str, Counter[tuple[int, str]]] = {}
    for playlist in playlists:
        tasks = [trial.task.rpartition(TURNED)[0] or trial.task for trial in playlist.trials]
        found.setdefault(playlist.block, Counter()).update(enumerate(tasks))
    groups = []
    for block, times in found.items():
        positions, there = ({*each} for each in zip(*times, strict=True))
        if len(times) != len(positions) * len(there) or len({*times.values()}) > 1:
            groups.append(block)
    return groups


_Groups = dict[str, list[Trial]]
"""Trials by the name of who sees them."""


def _turns(groups: _Groups, order: Order, count: int | None) -> list[tuple[str, int]]:
    """Return for each playlist its group, and how many playlists that group had before."""
    if count is None:
        needed = {block: _needed(order, len(own)) for block, own in groups.items()}
        if sum(needed.values()) > MOST_PLAYLISTS:
            raise ConfigError(
                f"the order needs {sum(needed.values()):,} playlists, and at most"
                f" {MOST_PLAYLISTS:,} are made; say how many",
                key="playlists.count",
            )
        return [(block, turn) for block, turns in needed.items() for turn in range(turns)]
    if count < len(groups):
        raise ConfigError(
            f"the design has {len(groups)} blocks, and each needs a playlist, not {count} in all",
            key="playlists.count",
        )
    names = list(groups)
    return [(names[n % len(names)], n // len(names)) for n in range(count)]


def _check_balanced(groups: _Groups, order: Order) -> None:
    """Refuse squares that no study could show."""
    block, most = max(((name, len(own)) for name, own in groups.items()), key=lambda each: each[1])
    if order == "latin" and most > MOST_BALANCED:
        raise ConfigError(
            f"block {block} has {most:,} trials, and orders of at most {MOST_BALANCED:,} are"
            " balanced; share them out by playlists.parts, or write order: random and count",
            key="playlists.order",
        )


def _check_shown(count: int) -> None:
    """Refuse more trials than any study shows."""
    if count > MOST_SHOWN:
        raise ConfigError(
            f"all playlists together show {count:,} trials, and at most {MOST_SHOWN:,} are"
            " written; write a smaller playlists.count or repeat, or more parts",
            key="playlists.count",
        )


def _needed(order: Order, count: int) -> int:
    """Return how many playlists an order of some trials takes."""
    if order == "as_written":
        return 1
    return len(balanced_orders(count)) if order == "latin" else count


def _groups(trials: Sequence[Trial], parts: int, seed: int) -> _Groups:
    """Return the trials of each block, shared out into parts."""
    blocks: _Groups = {}
    for trial in trials:
        blocks.setdefault(trial.block, []).append(trial)
    if parts == 1:
        return blocks
    found: _Groups = {}
    for name, own in blocks.items():
        if len(own) < parts:
            raise ConfigError(
                f"block {name} has {len(own)} trials, fewer than parts ({parts})",
                key="playlists.parts",
            )
        some = shared_out(own, parts, seed=seed, block=name)
        found |= {f"{name}.{number}": part for number, part in enumerate(some, start=1)}
    return found


class _Orders:
    """The orders in which one group's trials are shown."""

    def __init__(self, order: Order, own: tuple[Trial, ...], *, block: str, seed: int) -> None:
        self._order, self._own, self._block, self._seed = order, own, block, seed
        # Which trial is which in the square is left to chance.
        self._names = permutation(len(own), seed, "square", block)
        self._square = balanced_orders(len(own)) if order == "latin" else []

    def rounds(self, turn: int, repeat: int) -> tuple[Trial, ...]:
        """Return all trials of a playlist, each as often as it is repeated."""
        return tuple(trial for again in range(repeat) for trial in self._round(turn, again))

    def _round(self, turn: int, again: int) -> Sequence[Trial]:
        """Return all trials once."""
        if self._order == "as_written":
            return self._own
        if self._order == "random":
            words = ("playlist", self._block, str(turn), str(again))
            return shuffled(self._own, self._seed, *words)
        row = self._square[(turn + again) % len(self._square)]
        return [self._own[self._names[place]] for place in row]
