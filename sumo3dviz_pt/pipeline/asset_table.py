"""Lists the library of assets."""

from __future__ import annotations

from collections.abc import Sequence

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError

_HEAD = ("family", "name", "for", "size [m]", "triangles", "kB", "licence")


def families() -> tuple[str, ...]:
    """Return all families of assets."""
    folder = catalog.data_root("assets")
    return tuple(sorted(path.name for path in folder.iterdir() if path.is_dir()))


def listing(chosen: Sequence[str]) -> list[str]:
    """Return a table of assets: family, name, what it is, triangles, size, licence.

    Args:
        chosen: Families; none stands for all.

    Raises:
        ConfigError: If there is no such family; the message suggests one.
    """
    rows: list[tuple[str, ...]] = [_HEAD]
    for family in checked(chosen):
        rows += [_row(catalog.find(family, name)) for name in catalog.names(family)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def checked(chosen: Sequence[str]) -> Sequence[str]:
    """Return the families that words mean; none stands for all.

    Raises:
        ConfigError: If there is no such family; the message suggests one.
    """
    known = families()
    for word in chosen:
        if word not in known:
            hint = catalog.did_you_mean(word, known)
            raise ConfigError(f"no family of assets is called {word!r}{hint}")
    return chosen or known


def _row(entry: catalog.Entry) -> tuple[str, ...]:
    """Return one line of the table."""
    meta = entry.meta
    sides = [meta[key] for key in ("length", "width", "height") if key in meta]
    levels = [sum(meta.get(level, {}).values()) for level in ("full", "parts", "far")]
    served = meta.get("vclass", "")
    return (
        entry.family,
        entry.name,
        served if isinstance(served, str) else ", ".join(served) or "a unit",
        " x ".join(f"{float(side):.2f}" for side in sides),
        " / ".join(f"{count:,}" for count in levels if count),
        f"{sum(path.stat().st_size for path in entry.folder.iterdir()) / 1e3:.0f}",
        str(meta["licence"]),
    )
