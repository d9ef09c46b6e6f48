"""Turns other tools' trajectories into SUMO's files, which everything else reads.

What is made of a table lies in the user's cache, under all that it depends on: a vehicle log as
SUMO writes it, and the types of its road users by class and size.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.atomic import Files, make_room, read_folder, write_folder
from sumo3dviz_pt.model.traffic import MadeOfTable, ScenarioFiles, TableChoices, TableColumn
from sumo3dviz_pt.sumo.formats import is_log
from sumo3dviz_pt.sumo.formats.outputs import FULL
from sumo3dviz_pt.sumo.network import network_of
from sumo3dviz_pt.sumo.stream import may_be_xml, root_of
from sumo3dviz_pt.sumo.tracks.by_lane import LANE_ROOTS, log_of_lanes
from sumo3dviz_pt.sumo.tracks.readings import Samples, samples_in
from sumo3dviz_pt.sumo.tracks.scenarios import is_scenario, scenario_samples
from sumo3dviz_pt.sumo.tracks.tables import table_in, why_no_table
from sumo3dviz_pt.sumo.tracks.users import Track, note_of_classes, tracks_of

if TYPE_CHECKING:
    from sumo3dviz_pt.sumo.tracks.lanes import Road

logger = logging.getLogger(__name__)

_MOST = 2_000_000_000
"""Size of all converted logs above which the oldest are removed [bytes]."""

_LOG, _TYPES, _NETWORK = "log.fcd.csv", "log.typ.add.xml", "ways.net.xml"
_ABOUT = "about.json"


def is_table(file: Path) -> bool:
    """Whether a file seems to be a table of trajectories that is no log of SUMO."""
    if is_log(file):
        return False
    return is_scenario(file) or table_in(file, TableChoices()) is not None


def tells_places(file: Path) -> bool:
    """Whether a file itself tells where vehicles are: a log, another output of SUMO, a table."""
    return is_log(file) or is_table(file) or _is_of_lanes(file)


def in_sumos_form(
    network: Path | None, logs: Sequence[Path], choices: TableChoices, **others: Any
) -> ScenarioFiles:
    """Return a scenario's files; tables of trajectories are turned into SUMO's logs.

    Args:
        network: The network; None where the ways that tables tell are all there is.
        logs: Vehicle logs, or tables.
        choices: How tables are to be understood.
        others: What else `ScenarioFiles` has.

    Raises:
        InputError: If a table is damaged, or there is neither network nor table.
        ConfigError: If a table lacks a column that a user names.
    """
    first: dict[Path, MadeOfTable | None] = {}
    if network is None:
        # The largest table tells the ways, and all lie on them.
        largest = max(logs, key=lambda log: log.stat().st_size)
        first[largest] = ways = converted(largest, choices, paved=True)
        if ways is None:
            raise InputError("no network (.net.xml) was found; name it by --network", file=logs[0])
        network = next(file for file in ways.files if file.name == _NETWORK)
    made = [
        first[log]
        if log in first
        else _of_lanes(log, network)
        if _is_of_lanes(log)
        else converted(log, choices, network=network)
        for log in logs
    ]
    tables = tuple(each for each in made if each is not None)
    own = tuple(file for each in tables for file in each.files if file.name == _TYPES)
    full = tuple(log for log in logs if may_be_xml(log) and root_of(log) == FULL)
    pairs = zip(logs, made, strict=True)
    return ScenarioFiles(
        network,
        tuple(log if each is None else each.files[0] for log, each in pairs),
        tables=tables,
        **{
            **others,
            "vehicle_types": (*own, *others.get("vehicle_types", ())),
            "signals": others.get("signals") or full,
        },
    )


def converted(
    file: Path, choices: TableChoices, *, network: Path | None = None, paved: bool = False
) -> MadeOfTable | None:
    """Return SUMO's files for a table of trajectories; None for a log of SUMO, or anything else.

    What was told by names and values is noted once.

    Args:
        file: Any file.
        choices: How tables are to be understood.
        network: In whose coordinates longitudes and latitudes are given.
        paved: Whether a network is made of the ways that are driven.

    Raises:
        InputError: If the table is damaged.
        ConfigError: If it lacks a column that a user names.
    """
    if not choices.columns and is_log(file):
        return None
    table = None if is_scenario(file) else table_in(file, choices)
    if table is None and not is_scenario(file):
        why = "" if is_log(file) or may_be_xml(file) else why_no_table(file, choices)
        if why:
            raise InputError(why, file=file)
        return None
    there = network if table and table.form.is_geo else None
    folder = _folder((file, *_beside(file), *([there] if there else [])), (choices, paved))
    if read_folder(folder) is None:
        location = network_of(there).location if there else None
        samples, roads = (samples_in(table, location), []) if table else scenario_samples(file)
        rate = table.form.rate if table else None
        _keep(folder, _made(samples, roads, file, rate=rate, paved=paved), file)
    about = json.loads((folder / _ABOUT).read_text(encoding="utf-8"))
    if about["notes"]:
        text = "; ".join(about["notes"])
        logger.warning("%s: %s", file, text, extra={"once": f"meaning of {file}"})
    names = (_LOG, _TYPES, *((_NETWORK,) if paved else ()))
    files = tuple(folder / name for name in names)
    return MadeOfTable(file, files, _choices(about["choices"]), not about["notes"])


def _is_of_lanes(file: Path) -> bool:
    """Whether a file is a dump of all lanes."""
    return may_be_xml(file) and root_of(file) in LANE_ROOTS


def _of_lanes(file: Path, network: Path) -> MadeOfTable:
    """Return the vehicle log for a dump of all lanes."""
    folder = _folder((file, network), "lanes")
    if read_folder(folder) is None:
        _keep(folder, {_LOG: log_of_lanes(file, network_of(network)).encode()}, file)
    return MadeOfTable(file, (folder / _LOG,), TableChoices(), told=True)


def _choices(about: Mapping[str, Any]) -> TableChoices:
    """Return what was understood, as it was kept."""
    columns = {role: TableColumn(**own) for role, own in about["columns"].items()}
    return TableChoices(**{**about, "columns": columns})


def _folder(files: Sequence[Path], question: object) -> Path:
    """Return where is kept what is made of files, whatever else it hangs on."""
    digest = hashlib.blake2b(catalog.code_digest("sumo"), digest_size=16)
    digest.update(repr(question).encode())
    for file in files:
        state = file.stat()
        digest.update(f"{file.resolve()}\n{state.st_size}\n{state.st_mtime_ns}\n".encode())
    return catalog.cache_root() / "tracks" / digest.hexdigest()


def _beside(file: Path) -> list[Path]:
    """Return the files that belong to a recording, beside its table."""
    stem, mark, _ = file.name.partition("_tracks")
    names = (f"{stem}_recordingMeta.csv", f"{stem}_tracksMeta.csv") if mark else ()
    return [path for name in names if (path := file.with_name(name)).is_file()]


def _made(
    samples: Samples, roads: Sequence[Road], file: Path, *, rate: float | None, paved: bool
) -> Files:
    """Return SUMO's files for where road users are.

    Args:
        samples: Of a table or a scenario.
        roads: Its own; none where it has none.
        file: For messages.
        rate: Frames in a second, where they are counted [Hz].
        paved: Whether a network is made, too.
    """
    tracks = tracks_of(samples)
    if not tracks:
        raise InputError("nobody in it has a time and a place; write it again", file=file)
    understood = TableChoices(
        samples.columns, samples.point, samples.downwards, rate, samples.meanings
    )
    note = note_of_classes(samples, tracks)
    files = {
        _LOG: log_text(tracks).encode(),
        _TYPES: types_text(tracks).encode(),
        _ABOUT: json.dumps(
            {"choices": asdict(understood), "notes": [*samples.notes, *note]}
        ).encode(),
    }
    if paved:
        from sumo3dviz_pt.sumo.tracks.paving import network_text

        projection = samples.location.projection
        files[_NETWORK] = network_text(tracks, roads, file=file, projection=projection).encode()
    return files


def _keep(folder: Path, files: Files, source: Path) -> None:
    """Write what was made of a file."""
    try:
        write_folder(folder, files)
        make_room(folder, _MOST)
    except OSError as error:
        raise InputError(f"cannot be converted ({error})", file=source) from error


def log_text(tracks: Sequence[Track]) -> str:
    """Return a vehicle log as SUMO writes it for names that end in `.csv`."""
    times = np.concatenate([track.times for track in tracks])
    owners = np.repeat(np.arange(len(tracks)), [len(track.times) for track in tracks])
    fronts = np.concatenate([track.fronts for track in tracks])
    angles = 90.0 - np.degrees(np.concatenate([track.headings for track in tracks]))
    speeds = np.concatenate([track.speeds for track in tracks])
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow(("time", "id", "x", "y", "z", "angle", "speed", "type", "tag"))
    for row in np.lexsort((owners, times)).tolist():
        track = tracks[owners[row]]
        x, y, z = fronts[row].tolist()
        speed = "" if np.isnan(speeds[row]) else f"{speeds[row]:.3f}"
        numbers = (f"{x:.4f}", f"{y:.4f}", f"{z:.3f}", f"{angles[row] % 360.0:.4f}", speed)
        writer.writerow((f"{times[row]:.4f}", track.id, *numbers, type_of(track), track.kind))
    return text.getvalue()


def types_text(tracks: Sequence[Track]) -> str:
    """Return the types of road users as an additional file of SUMO."""
    lines = ["<additional>"]
    for name, track in sorted({type_of(track): track for track in tracks}.items()):
        length, width, height = track.size
        lines.append(
            f"    <vType id={quoteattr(name)} vClass={quoteattr(track.vclass)}"
            f' length="{length:g}" width="{width:g}" height="{height:g}"/>'
        )
    return "\n".join([*lines, "</additional>", ""])


def type_of(track: Track) -> str:
    """Return the id of a road user's type."""
    length, width, _ = track.size
    return f"{track.vclass} {length:g} x {width:g} m"
