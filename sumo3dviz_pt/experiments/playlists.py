"""Playlists: who sees which trials, in which order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.designs.latin import balanced_orders
from sumo3dviz_pt.experiments.shuffles import permutation, shuffled
from sumo3dviz_pt.experiments.trials import Trial

Order = Literal["latin", "random", "as_written"]

MOST_PLAYLISTS = 10_000
"""Most playlists of a study."""

MOST_BALANCED = 1000
"""Most trials of a block whose orders are balanced: the square has as many rows, or twice."""

MOST_SHOWN = 2_000_000
"""Most trials that all playlists show together."""


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
        parts: Into how many groups each block's trials are shared out, at random.
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
        mixed = shuffled(own, seed, "parts", name)
        found |= {f"{name}.{part + 1}": mixed[part::parts] for part in range(parts)}
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
