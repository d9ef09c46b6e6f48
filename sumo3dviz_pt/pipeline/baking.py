"""The library of assets: what it holds, and how its files are made again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.news import Doing, announce

_HEAD = ("family", "name", "for", "size [m]", "triangles", "kB", "licence")

Bake = Callable[[Path], tuple[Path, ...]]
"""Makes the files of an asset's folder again."""


def families() -> tuple[str, ...]:
    """All families of assets."""
    folder = catalog.data_root("assets")
    return tuple(sorted(path.name for path in folder.iterdir() if path.is_dir()))


def listing(chosen: Sequence[str]) -> list[str]:
    """A table of assets: family, name, what it is, triangles, size, licence.

    Args:
        chosen: Families; none stands for all.

    Raises:
        ConfigError: If there is no such family; the message suggests one.
    """
    rows: list[tuple[str, ...]] = [_HEAD]
    for family in _families(chosen):
        rows += [_row(catalog.find(family, name)) for name in catalog.names(family)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def build(chosen: Sequence[str], *, into: Path | None = None) -> None:
    """Make the files of assets again; wholes that are coupled from others have none.

    Args:
        chosen: Families, or `family/name`; none stands for all.
        into: A folder that gets a copy of the assets to build; None builds in place.

    Raises:
        ConfigError: If a family or an asset is unknown.
        OSError: If files cannot be written.
    """
    known = [entry for entry in _entries(chosen) if entry.family in _bakers()]
    entries = [entry for entry in known if "units" not in entry.meta]
    for number, entry in enumerate(entries):
        folder = entry.folder
        if into is not None:
            folder = into / entry.family / entry.name
            for path in catalog.recipe_files(entry):
                _copied(path, into / entry.family / path.parent.name)
        announce(Doing.BAKE, number, len(entries), what=f"{entry.family}/{entry.name}")
        _bakers()[entry.family](folder)


def _copied(path: Path, folder: Path) -> None:
    """A recipe where its asset is to be built."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / path.name).write_bytes(path.read_bytes())


def _entries(chosen: Sequence[str]) -> list[catalog.Entry]:
    """The assets that words mean."""
    found = []
    for word in chosen or families():
        family, _, name = word.partition("/")
        _families([family])
        names = [name] if name else catalog.names(family)
        found += [catalog.find(family, each) for each in names]
    return found


def _families(chosen: Sequence[str]) -> Sequence[str]:
    """The families that words mean."""
    known = families()
    for word in chosen:
        if word not in known:
            raise ConfigError(f"no family of assets is called {word!r}{_hint(word, known)}")
    return chosen or known


def _hint(word: str, known: Sequence[str]) -> str:
    """What could have been meant."""
    return catalog.did_you_mean(word, known)


def _row(entry: catalog.Entry) -> tuple[str, ...]:
    """One line of the table."""
    meta = entry.meta
    sides = [meta[key] for key in ("length", "width", "height") if key in meta]
    levels = [sum(row["triangles"] for row in meta.get(level, ())) for level in ("parts", "far")]
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


def _bakers() -> Mapping[str, Bake]:
    """How the files of each family are made; people are modelled when a scene needs them."""
    from sumo3dviz_pt.image.exr import write_exr
    from sumo3dviz_pt.image.png import write_png
    from sumo3dviz_pt.library.skies.bake import CLOUD_LOSS, bake_clouds
    from sumo3dviz_pt.library.surfaces.bake import bake_surface
    from sumo3dviz_pt.library.vehicles.bake import bake_folder

    def store(path: Path, radiance: Image) -> None:
        write_exr(path, {"radiance": radiance}, lossy=CLOUD_LOSS)

    return {
        "vehicles": bake_folder,
        "surfaces": lambda folder: bake_surface(folder, encode=write_png),
        "skies": lambda folder: (bake_clouds(folder, encode=store),),
    }
