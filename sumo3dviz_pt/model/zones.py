"""Time zones as people write them."""

from __future__ import annotations

import datetime as dt
import difflib
import re
import zoneinfo

SOLAR = "solar"
"""Mean solar time of the place: the sun stands highest within 16 minutes of noon."""

_FIXED = re.compile(r"([+-])(\d{1,2})(?::?([0-5]\d))?")


def zone_named(name: str) -> dt.tzinfo:
    """Return a time zone.

    Args:
        name: A name of the IANA time zones, such as `Europe/Berlin`, or an offset from UTC, such
            as `+02:00`.

    Raises:
        ValueError: If there is none of that name; the message suggests one.
    """
    fixed = _FIXED.fullmatch(name)
    if fixed is not None:
        sign = -1 if fixed[1] == "-" else 1
        ahead = dt.timedelta(hours=int(fixed[2]), minutes=int(fixed[3] or 0))
        if ahead > dt.timedelta(hours=14):
            raise ValueError(f"no clock is further than 14 hours from UTC, not {name}")
        return dt.timezone(sign * ahead)
    try:
        return zoneinfo.ZoneInfo(name)
    except (zoneinfo.ZoneInfoNotFoundError, ValueError, OSError):
        known = sorted(zoneinfo.available_timezones())
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    hint = f"did you mean {near[0]!r}?" if near else "write it like Europe/Berlin or +02:00"
    raise ValueError(f"no time zone is called {name!r}; {hint}")
