"""Makes a network, what stands beside it, and traffic from a map, by SUMO's own programs.

An OpenDRIVE map keeps its coordinates, so that what other tools logged on it fits. A map of
OpenStreetMap gives buildings and greens, too, and sidewalks where towns have some; nobody drives on
it, so traffic can be invented.
"""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError, InputError, InstallationError
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.recording.run import RecordOrder, pass_on, record, sumo_homes, sumo_program
from sumo3dviz_pt.sumo.stream import OTHERS, Element, read_elements, remedy, root_of

logger = logging.getLogger(__name__)

_OSM, _OPENDRIVE = "osm", "OpenDRIVE"

_STREETS = (
    *("--osm.elevation", "--osm.sidewalks", "--osm.turn-lanes", "--output.street-names"),
    *("--geometry.remove", "--ramps.guess", "--junctions.join", "--roundabouts.guess"),
    *(
        "--tls.guess-signals",
        "--tls.discard-simple",
        "--tls.join",
        "--tls.default-type",
        "actuated",
    ),
    *("--sidewalks.guess", "--crossings.guess"),
)
"""How SUMO's own wizard for maps makes streets (tools/osmWebWizard.py of 1.28), with heights."""

_JOINED = "--remove-edges.isolated"  # part of them; it takes out roads that nothing joins

_LAYERS = ("--osm.layer-elevation", "6")
"""How high a bridge lies for each of its layers [m]; trucks need 4.5 m, and decks 1 m."""

_NO_STREET = "holds no street; give a map that does"
_TYPES = ("osmNetconvert", "osmNetconvertUrbanDe", "osmNetconvertPedestrians")

_SEED = 1  # of routes and simulation

_CARS, _WALKERS = 70, 40
"""How many set out in an hour, for each kilometre of street."""


@dataclass(frozen=True, slots=True)
class MadeOfMap:
    """What was made of a map.

    Attributes:
        network: The network.
        additional: Buildings and greens; none of OpenDRIVE.
        simulation: The configuration of a recording of invented traffic; None where none is.
    """

    network: Path
    additional: tuple[Path, ...] = ()
    simulation: Path | None = None


def is_map(file: Path) -> bool:
    """Whether a file is a map that SUMO makes a network of."""
    return file.is_file() and root_of(file) in (_OSM, _OPENDRIVE)


def make_of_map(
    file: Path,
    folder: Path,
    *,
    traffic: float | None,
    driven: bool = False,
    replace: bool = False,
) -> MadeOfMap:
    """Make a network of a map, and traffic if that is asked for.

    Args:
        file: The map.
        folder: Where everything is written.
        traffic: How long traffic is invented [s]; None invents none.
        driven: Whether something else tells who drives there.
        replace: Whether a folder that is there is replaced.

    Raises:
        InputError: If there is no SUMO, or it refuses the map.
        ConfigError: If nobody drives there, traffic is asked for on another map than one of
            OpenStreetMap, or the folder exists.
    """
    root = root_of(file) or ""
    if traffic is not None and root != _OSM:
        raise ConfigError(
            "traffic is invented on maps of OpenStreetMap only; name what drives by --trajectories",
            key="--traffic",
        )
    if traffic is None and root == _OSM and not driven:
        raise ConfigError(
            "nobody drives on a map; let some traffic be invented, such as --traffic 600, or name"
            " what drives by --trajectories",
            key="--traffic",
        )
    try:
        program = sumo_program("netconvert")
    except InstallationError as error:
        raise InputError(
            f"is {OTHERS[root].what}; {error}, or elsewhere {remedy(root, file)}", file=file
        ) from None
    if folder.exists() and not replace:
        raise ConfigError(f"{folder}: exists; --overwrite replaces it")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        return _made(file, root, folder, program=program, traffic=traffic)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _made(file: Path, root: str, folder: Path, *, program: str, traffic: float | None) -> MadeOfMap:
    """Fill a folder with what is made of a map."""
    stem = folder / file.name.removesuffix(".gz").split(".")[0]
    network = stem.with_suffix(".net.xml")
    announce(Doing.SIMULATE)
    command = [program, *_network_options(root, file), "-o", str(network)]
    if root == _OPENDRIVE:
        _run(command, file)
        return MadeOfMap(network)
    joined = _streets(command, file, network)
    shapes = _shapes(file, network, stem.with_suffix(".poly.xml"))
    if traffic is None:
        return MadeOfMap(network, shapes)
    simulation = _traffic(network, shapes, stem, seconds=traffic, joined=joined)
    recorded = record(simulation, RecordOrder(folder / "recorded", overwrite=True))[0]
    return MadeOfMap(network, shapes, recorded)


def _streets(command: Sequence[str], file: Path, network: Path) -> bool:
    """Make the network of a map of OpenStreetMap; return whether junctions join its streets.

    Raises:
        InputError: If it has no street.
    """
    command = [*command, *_heights_of(file)]
    for more in ([_JOINED], []):  # roads that nothing joins are kept where there are no others
        said = _ran([*command, *more], file)
        if _has_streets(network):
            pass_on(said)
            return bool(more)
    raise InputError(_NO_STREET, file=file)


def _network_options(root: str, file: Path) -> list[str]:
    """Return netconvert's options for a map."""
    if root == _OPENDRIVE:
        return ["--opendrive-files", str(file), "--offset.disable-normalization"]
    types = ",".join(str(_data(f"data/typemap/{name}.typ.xml", file)) for name in _TYPES)
    return ["--osm-files", str(file), "--type-files", types, *_STREETS]


def _heights_of(file: Path) -> tuple[str, ...]:
    """Return the options that give bridges and tunnels heights, unless a map tells all heights.

    Raises:
        InputError: If the map has no street.
    """
    high: set[str] = set()
    ways, layered = 0, False
    for thing, refs, tags in _things(file):
        if thing.tag == "node" and "ele" in tags:
            high.add(thing.text("id"))
        elif tags.keys() & {"highway", "railway"}:
            ways += len(refs) > 1
            if not high.isdisjoint(refs):
                return ()
            layered |= "layer" in tags and bool(tags.keys() & {"bridge", "tunnel"})
    if not ways:
        raise InputError(_NO_STREET, file=file)
    return _LAYERS if layered else ()


def _things(file: Path) -> Iterator[tuple[Element, list[str], dict[str, str]]]:
    """Yield nodes, ways and relations, with the nodes and tags of each."""
    thing: Element | None = None
    refs: list[str] = []
    tags: dict[str, str] = {}
    for element in read_elements(file, root=_OSM, what="a map of OpenStreetMap"):
        if element.depth == 1:
            if thing is not None:
                yield thing, refs, tags
            thing, refs, tags = element, [], {}
        elif element.tag == "nd":
            refs.append(element.text("ref"))
        elif element.tag == "tag":
            tags[element.text("k")] = element.text("v")
    if thing is not None:
        yield thing, refs, tags


def _has_streets(network: Path) -> bool:
    """Whether a network has a road."""
    elements = read_elements(network, root="net", what="a SUMO network")
    return any(each.tag == "edge" and "function" not in each.attributes for each in elements)


def _shapes(file: Path, network: Path, target: Path) -> tuple[Path, ...]:
    """Write the buildings and greens of a map of OpenStreetMap."""
    types = _data("data/typemap/osmPolyconvert.typ.xml", file)
    command = [sumo_program("polyconvert"), "--osm-files", str(file), "--net-file", str(network)]
    # All attributes: roofs and storeys are among them.
    command += ["--type-file", str(types), "--osm.keep-full-type", "--all-attributes"]
    _run([*command, "-o", str(target)], file)
    return (target,)


def _traffic(
    network: Path, shapes: Sequence[Path], stem: Path, *, seconds: float, joined: bool
) -> Path:
    """Write routes of cars and people, and a configuration of SUMO; return that."""
    apart = [] if joined else ["--allow-fringe"]  # trips may end on the street where they begin
    tool = _data("tools/randomTrips.py", network)
    routes = []
    kinds = (
        ("cars", _CARS, ["--fringe-factor", "5", "--vehicle-class", "passenger"]),
        ("people", _WALKERS, ["--pedestrians", "--max-distance", "800"]),
    )
    for kind, density, more in kinds:
        target = stem.with_suffix(f".{kind}.rou.xml")
        command = [sys.executable, str(tool), "-n", str(network), "-r", str(target)]
        command += ["-o", str(stem.with_suffix(f".{kind}.trips.xml")), "--seed", str(_SEED)]
        command += ["--end", f"{seconds:g}", "--insertion-density", str(density)]
        _run([*command, "--prefix", kind, "--validate", *more, *apart], network)
        routes.append(target.name)
    text = (
        f'<configuration>\n    <net-file value="{network.name}"/>\n'
        f'    <route-files value="{",".join(routes)}"/>\n'
        f'    <additional-files value="{",".join(shape.name for shape in shapes)}"/>\n'
        f'    <end value="{seconds:g}"/>\n    <step-length value="0.5"/>\n'
        f'    <seed value="{_SEED}"/>\n</configuration>\n'
    )
    simulation = stem.with_suffix(".sumocfg")
    write_atomically(simulation, text)
    return simulation


def _data(name: str, file: Path) -> Path:
    """Return a file of SUMO's installation.

    Raises:
        InputError: If it is not there.
    """
    for home in (*sumo_homes(), Path("/usr/share/sumo")):
        if (home / name).is_file():
            return home / name
    message = f"SUMO's {name} is not here; install all of SUMO with: pip install eclipse-sumo"
    raise InputError(message, file=file)


def _run(command: Sequence[str], file: Path) -> None:
    """Run a program of SUMO, and pass on what it says."""
    pass_on(_ran(command, file))


def _ran(command: Sequence[str], file: Path) -> str:
    """Run a program of SUMO; return what it says.

    Raises:
        InputError: If it fails; has its own words.
    """
    homes = sumo_homes()
    around = {**os.environ, **({"SUMO_HOME": str(homes[0])} if homes else {})}
    done = subprocess.run(command, capture_output=True, env=around, check=False)
    text = (done.stdout + done.stderr).decode("utf-8", errors="replace")
    if done.returncode != 0:
        faults = [line.strip() for line in text.splitlines() if "rror" in line]
        why = " ".join(faults[:2]) or f"it ended with code {done.returncode}"
        raise InputError(f"{Path(command[0]).name} stopped: {why}", file=file)
    return text
