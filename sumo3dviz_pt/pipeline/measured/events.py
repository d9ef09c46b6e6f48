"""When traffic lights change and brake lamps begin to shine, by a film's account."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sumo3dviz_pt.pipeline.accounts.road_users import brake_onsets

Row = dict[str, str | int | float]


def event_rows(account: Mapping[str, Any]) -> Iterator[Row]:
    """Yield a row for each change of a traffic light and each onset of brake lamps, by frames.

    What the first frame shows has begun before and is none.

    Args:
        account: The film's.
    """
    times = [float(frame["time"]) for frame in account["frames"]]
    found = [
        (int(change["frame"]), "signal", str(change["tls"]), str(change["state"]))
        for change in account["signal_changes"]
        if change["frame"] > 0
    ]
    for key, user in account["road_users"].items():
        found += [(number, "brake", key, "on") for number in brake_onsets(user["lamps"])]
    for number, kind, who, state in sorted(found):
        yield {"frame": number, "time": times[number], "kind": kind, "id": who, "state": state}
