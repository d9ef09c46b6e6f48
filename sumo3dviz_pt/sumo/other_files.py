"""Files that users take for networks or vehicle logs: what each is, and what to do with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

PBF = "osm.pbf"
"""Stands for the root element of a map that is packed and has none."""

_LOG = "run sumo with --fcd-output fcd.xml.gz, too, and name that file"


@dataclass(frozen=True, slots=True)
class OtherFile:
    """A kind of file.

    Attributes:
        what: What it is, in words.
        option: Of netconvert that reads it; empty for what is no network.
    """

    what: str
    option: str = ""


def _output(option: str, holds: str) -> OtherFile:
    """Return an output of SUMO that holds no places of vehicles that can be drawn."""
    return OtherFile(f"SUMO's --{option}, which holds {holds}")


OTHERS: Mapping[str, OtherFile] = {
    # Other networks.
    "OpenDRIVE": OtherFile("a road network in OpenDRIVE", "opendrive-files"),
    "osm": OtherFile("a map of OpenStreetMap", "osm-files"),
    PBF: OtherFile("a map of OpenStreetMap, packed as PBF", "osm-files"),
    "network": OtherFile("a network of MATSim", "matsim-files"),
    "nodes": OtherFile("the junctions of a network that is not built", "node-files"),
    "edges": OtherFile("the roads of a network that is not built", "edge-files"),
    # Other outputs of a simulation.
    "emission-export": _output("emission-output", "what vehicles emit"),
    "netstate": _output("netstate-dump", "vehicles by lane without x and y"),
    "sumo-netstate": _output("netstate-dump", "vehicles by lane without x and y"),
    "full-export": _output("full-output", "vehicles, lanes and lights mixed"),
    "queue-export": _output("queue-output", "queues by lane"),
    "battery-export": _output("battery-output", "batteries"),
    "tripinfos": _output("tripinfo-output", "one row for each trip"),
    "summary": _output("summary-output", "counts of vehicles"),
    "meandata": OtherFile("mean values of edges or lanes of SUMO"),
    "detector": OtherFile("the output of a detector of SUMO"),
    "collisions": _output("collision-output", "collisions"),
    "lanechanges": _output("lanechange-output", "lane changes"),
    "stops": _output("stop-output", "stops"),
    "SSMLog": OtherFile("SUMO's log of surrogate safety measures"),
    "instantE1": OtherFile("the output of a detector of SUMO"),
    "trajectories": _output("amitran-output", "speeds of vehicles"),
    "snapshot": _output("save-state", "one moment of a simulation"),
}
"""By root element."""


def is_packed_map(head: bytes) -> bool:
    """Whether first bytes of a file are those of a map of OpenStreetMap in PBF."""
    return head[4:15] == b"\n\tOSMHeader"


def remedy(root: str, file: Path) -> str:
    """Return what to do with a file.

    Args:
        root: Its root element, one of `OTHERS`.
        file: The file.
    """
    option = OTHERS[root].option
    if not option:
        return _LOG
    if root == PBF:
        text = file.with_name(f"{file.name.split('.')[0]}.osm")
        return f"unpack it with osmium cat {file} -o {text}, then {remedy('osm', text)}"
    net = f"{file.name.removesuffix('.gz').split('.')[0]}.net.xml"
    also = {"node-files": " --edge-files FILE.edg.xml", "edge-files": " --node-files FILE.nod.xml"}
    return f"make a network of it: netconvert --{option} {file}{also.get(option, '')} -o {net}"


def advice(files: Mapping[Path, str | None], *, networks: bool) -> str:
    """Return what the first file is that seems to have been meant, and what to do; or nothing.

    Args:
        files: Root elements, all of them in `OTHERS`, by file.
        networks: Whether a network was looked for, else a vehicle log.
    """
    for file, root in files.items():
        if root is not None and bool(OTHERS[root].option) is networks:
            found = f"{file.name} is {OTHERS[root].what}"
            return f"{found}: {remedy(root, file)}" if networks else found
    return ""
