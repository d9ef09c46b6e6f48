"""Join the rows of a road user that goes on as another vType.

TraCI's `setType` gives a vehicle another type while it drives. It is one road user all the same,
and keeps the type, and so the look, that it began with. An id that comes back elsewhere, or after
a gap, with another type is another road user.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import FASTEST, GAP_FACTOR
from sumo3dviz_pt.sumo.traces import RowsOfUsers, in_order, table_of

_BEYOND = 8.0
"""A step longer than speed x time by more than this leads to another place [m]."""


class _Last(NamedTuple):
    """The last row of an id: as a row of the log, its type, and the type that it goes under."""

    row: Floats
    type_id: str
    under: str


@dataclass(slots=True)
class TypeChanges:
    """Gives rows to the first type of their road user, block by block.

    Attributes:
        last: Last rows of ids by kind and id.
        first: The first change, in words; empty if there was none.
        users: Kinds and ids that changed.
    """

    last: dict[tuple[str, str], _Last] = field(default_factory=dict)
    first: str = ""
    users: set[tuple[str, str]] = field(default_factory=set)

    def join(self, rows: RowsOfUsers, *, step: float) -> None:
        """Move rows to the keys of the types that their road users began with.

        Args:
            rows: Packed rows of road users; they follow those of earlier calls.
            step: Median time between steps of the log [s].
        """
        types: dict[tuple[str, str], list[str]] = {}
        for (kind, name, type_id), buffer in rows.items():
            # A log that breaks off may name somebody and give no complete row.
            if len(buffer):
                types.setdefault((kind, name), []).append(type_id)
        for user, own in types.items():
            last = self.last.get(user)
            if len(own) == 1 and (last is None or last.type_id == last.under == own[0]):
                self.last[user] = _Last(table_of(rows[*user, own[0]])[-1].copy(), own[0], own[0])
                continue
            tables = {each: in_order(table_of(rows[*user, each])) for each in own}
            self._share(user, tables, rows, step=step)

    def _share(
        self,
        user: tuple[str, str],
        tables: Mapping[str, Floats],
        rows: RowsOfUsers,
        *,
        step: float,
    ) -> None:
        """Share the rows of an id out to the road users that it is; arguments as above."""
        table = np.concatenate(list(tables.values()))
        types = np.repeat(list(tables), [len(each) for each in tables.values()])
        order = np.argsort(table[:, 0], kind="stable")
        table, types = table[order], types[order]
        # Two rows of one id at one time are two road users.
        if not (np.diff(table[:, 0]) > 0.0).all():
            return
        last = self.last.get(user)
        under = []
        for row, type_id in zip(table, types.tolist(), strict=True):
            if last is None:
                own = type_id
            elif last.type_id == type_id or _goes_on(last.row, row, step=step):
                own = last.under
                self._note(user, last.type_id, type_id, time=float(row[0]))
            else:
                own = type_id
            last = _Last(row.copy(), type_id, own)
            under.append(own)
        if last is not None:
            self.last[user] = last
        # Keys stay where they are: road users come in the order of the log.
        for each in dict.fromkeys(under):
            own_rows = table[np.array(under) == each]
            rows[*user, each] = array("d", own_rows.ravel())
        for each in set(tables).difference(under):
            del rows[*user, each]

    def _note(self, user: tuple[str, str], before: str, after: str, *, time: float) -> None:
        """Remember that a road user goes on as another type at a time [s]."""
        if before != after:
            self.users.add(user)
            name, told = f"{user[0]} `{cut(user[1])}`", f"from `{cut(before)}` to `{cut(after)}`"
            self.first = self.first or f"{name}, {told} at {time:.12g} s"

    @property
    def text(self) -> str:
        """One sentence about who changed; empty if nobody did."""
        if not self.users:
            return ""
        who = (
            "a road user changes"
            if len(self.users) == 1
            else f"{len(self.users)} road users change"
        )
        return (
            f"{who} the vType while driving (first: {self.first}); the first type counts all along;"
            " where the look must change, write another id from then on"
        )


def _goes_on(before: Floats, row: Floats, *, step: float) -> bool:
    """Whether a row can be the next of the road user of the row before it.

    Args:
        before: Row of the log, (10,).
        row: A later one.
        step: Median time between steps of the log [s].
    """
    time = row[0] - before[0]
    speed = np.fmax(abs(before[5]), abs(row[5]))
    speed = speed if np.isfinite(speed) else FASTEST
    way = float(np.hypot(*(row[1:3] - before[1:3])))
    return bool(0.0 < time <= GAP_FACTOR * step and way <= speed * time + _BEYOND)


def changed_types(rows: RowsOfUsers, *, step: float) -> str:
    """Join the rows of all road users of a log; say who changed, or nothing.

    Args:
        rows: Packed rows of road users.
        step: Median time between steps of the log [s].
    """
    changes = TypeChanges()
    changes.join(rows, step=step)
    return changes.text
