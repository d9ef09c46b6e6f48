"""Small simulations of several kinds, each with a .sumocfg, made by SUMO's own programs."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import rail_town
from any_network.programs import call

CONFIGURATION = """<configuration>
<input><net-file value="net.net.xml"/><route-files value="own.rou.xml"/>
<additional-files value="own.add.xml"/></input>
<time><begin value="0"/><end value="{end}"/><step-length value="{step}"/></time>
{more}
</configuration>"""


def _put(
    folder: Path,
    routes: str,
    *,
    additional: str = "",
    end: int = 90,
    step: float = 0.5,
    more: str = "",
) -> Path:
    """Write what belongs to a network; the configuration."""
    root = ET.fromstring(f"<routes>{routes}</routes>")
    # SUMO ignores whoever is late in the file.
    root[:] = sorted(root, key=_departure)
    ET.ElementTree(root).write(folder / "own.rou.xml", encoding="utf-8", xml_declaration=True)
    (folder / "own.add.xml").write_text(f"<additional>{additional}</additional>")
    path = folder / "own.sumocfg"
    path.write_text(CONFIGURATION.format(end=end, step=step, more=more))
    return path


def _grid(folder: Path, *more: str) -> None:
    """Make streets of three by three signalled junctions, 100 m apart, with sidewalks."""
    words = ["--grid", "--grid.number", "3", "--default.lanenumber", "2"]
    words += ["--default-junction-type", "traffic_light", "--sidewalks.guess", "--crossings.guess"]
    call("netgenerate", [*words, *more, "-o", "net.net.xml"], folder=folder)


def buses(folder: Path) -> Path:
    """Streets with buses, people who walk and ride, containers on a lorry, and parked cars."""
    _grid(folder)
    stops = '<busStop id="s{}" lane="{}_1" startPos="40" endPos="70"/>'
    additional = stops.format(0, "A0A1") + stops.format(1, "B1C1")
    additional += '<containerStop id="k0" lane="A1B1_1" startPos="20" endPos="50"/>'
    additional += '<containerStop id="k1" lane="C1C2_1" startPos="20" endPos="50"/>'
    additional += (
        '<parkingArea id="p" lane="B1B0_1" startPos="20" endPos="60" roadsideCapacity="4"/>'
    )
    way = '<route edges="A0A1 A1B1 B1C1 C1C2"/>'
    routes = (
        '<vType id="bus" vClass="bus"/><vType id="lorry" vClass="truck" containerCapacity="2"/>'
    )
    routes += (
        f'<vehicle id="bus0" type="bus" depart="30" line="7">{way}'
        '<stop busStop="s0" duration="12"/><stop busStop="s1" duration="12"/></vehicle>'
        f'<vehicle id="lorry0" type="lorry" depart="1">{way}'
        '<stop containerStop="k0" duration="8"/><stop containerStop="k1" duration="8"/></vehicle>'
        '<vehicle id="parked0" depart="0" departPos="5"><route edges="B1B0"/>'
        '<stop parkingArea="p" duration="200"/></vehicle>'
        '<container id="box0" depart="0" departPos="30"><stop containerStop="k0" duration="1"/>'
        '<transport from="A1B1" containerStop="k1" lines="lorry0"/></container>'
        '<container id="box1" depart="0" departPos="25">'
        '<tranship from="A1B1" to="B1C1" arrivalPos="30" speed="2"/></container>'
        '<flow id="f" begin="0" end="60" period="6" from="C2B2" to="A1A0"/>'
    )
    routes += "".join(
        f'<person id="rider{k}" depart="{k}"><walk from="A0A1" busStop="s0"/>'
        '<ride busStop="s1" lines="7"/><walk to="C1C0"/></person>'
        for k in range(3)
    )
    routes += '<personFlow id="w" begin="0" end="40" period="9"><walk from="C2B2" to="B2A2"/>'
    return _put(folder, f"{routes}</personFlow>", additional=additional, end=150)


def rails(folder: Path) -> Path:
    """A railway with signals, a level crossing, and trams among cars; one takes a person along."""
    rail_town.build_network(folder).rename(folder / "net.net.xml")
    stop = '<busStop id="h" lane="TST_2" startPos="60" endPos="110"/>'
    routes = rail_town.ROUTES.removeprefix("<routes>").removesuffix("</routes>")
    routes += (
        '<vehicle id="zug" type="tram" depart="40" line="4"><route edges="TST TTN"/>'
        '<stop busStop="h" duration="10"/></vehicle>'
        '<person id="p" depart="0" departPos="50"><walk from="TST" busStop="h"/>'
        '<ride to="TTN" lines="4"/></person>'
    )
    return _put(folder, routes, additional=stop, end=100)


def _departure(element: ET.Element) -> float:
    """When a road user or a flow begins [s]; definitions come before all."""
    return float(element.get("depart", element.get("begin", "-1")))


def sublanes(folder: Path) -> Path:
    """Wide streets on which cars, motorcycles and bicycles share lanes."""
    words = ["--grid", "--grid.number", "2", "--grid.length", "200", "--default.lanenumber", "2"]
    words += ["--default.lanewidth", "4.5", "-o", "net.net.xml"]
    call("netgenerate", words, folder=folder)
    kinds = {"car": "passenger", "moto": "motorcycle", "bike": "bicycle"}
    routes = "".join(
        f'<vType id="{kind}" vClass="{vclass}" latAlignment="arbitrary" minGapLat="0.3"/>'
        for kind, vclass in kinds.items()
    )
    routes += "".join(
        f'<flow id="{kind}" type="{kind}" begin="{k}" end="60" period="{7 + k}"'
        ' from="A0A1" to="B1B0" departLane="random" departPosLat="random"/>'
        for k, kind in enumerate(kinds)
    )
    more = '<processing><lateral-resolution value="0.8"/></processing>'
    return _put(folder, routes, step=0.2, end=60, more=more)


def hills(folder: Path) -> Path:
    """A road over a hill, with a sidewalk; it begins in a hollow and at height 0 at its end."""
    heights = {"a": (0, -4), "b": (120, 8), "c": (240, 14), "d": (360, 0), "e": (460, 0)}
    nodes = "".join(f'<node id="{n}" x="{x}" y="0" z="{z}"/>' for n, (x, z) in heights.items())
    ways = [*zip("abcd", "bcde", strict=True), *zip("bcde", "abcd", strict=True)]
    edges = "".join(
        f'<edge id="{a}{b}" from="{a}" to="{b}" numLanes="1" speed="13.9" sidewalkWidth="2"/>'
        for a, b in ways
    )
    (folder / "own.nod.xml").write_text(f"<nodes>{nodes}</nodes>")
    (folder / "own.edg.xml").write_text(f"<edges>{edges}</edges>")
    words = ["-n", "own.nod.xml", "-e", "own.edg.xml", "--no-turnarounds", "--walkingareas"]
    call("netconvert", [*words, "-o", "net.net.xml"], folder=folder)
    routes = (
        '<person id="p0" depart="0"><walk from="ed" to="dc"/></person>'
        '<flow id="up" begin="0" end="60" period="7" from="ab" to="de"/>'
        '<flow id="down" begin="1" end="60" period="9" from="ed" to="ba"/>'
        '<person id="p1" depart="2"><walk from="de" to="de" arrivalPos="60"/></person>'
    )
    return _put(folder, routes, end=70)


KINDS: dict[str, Callable[[Path], Path]] = {
    "buses": buses,
    "rails": rails,
    "sublanes": sublanes,
    "hills": hills,
}
"""Makers of a simulation in an empty folder; each returns its configuration."""
