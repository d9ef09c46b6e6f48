"""A small town with what railways and signals need, made by SUMO's own programs.

A road crosses a double track at a level crossing, then a tram street at a signalled
junction that it reaches with three lanes; behind it are a bus lane, a bicycle lane, a side
street that gives way and one that has to stop.
"""

from __future__ import annotations

from pathlib import Path

from any_network.programs import call, program

NEEDED = ("netconvert", "sumo")
"""Programs without which nothing can be made."""

NODES = """<nodes>
<node id="W" x="-220" y="0"/><node id="Q" x="-110" y="0" type="priority_stop"/>
<node id="X" x="0" y="0" type="rail_crossing"/><node id="T" x="150" y="0" type="traffic_light"/>
<node id="P" x="260" y="0" type="priority"/><node id="E" x="400" y="0"/>
<node id="QS" x="-110" y="-120"/><node id="PS" x="260" y="-120"/>
<node id="RS" x="0" y="-400"/><node id="R1" x="0" y="-70" type="rail_signal"/>
<node id="R2" x="0" y="70" type="rail_signal"/><node id="RN" x="0" y="400"/>
<node id="TS" x="150" y="-250"/><node id="TN" x="150" y="250"/>
</nodes>"""

_WALK = '<lane index="0" allow="pedestrian" width="2.5"/>'
_CARS = 'disallow="pedestrian tram rail rail_electric rail_fast rail_urban subway"'
_TRAM = '<lane index="{}" allow="tram" width="3.0"/>'


def _edge(ends: str, lanes: str = "", *, count: int = 2, priority: int = 5, words: str = "") -> str:
    """An edge between two nodes whose names have a colon between them."""
    start, end = ends.split(":")
    return (
        f'<edge id="{start}{end}" from="{start}" to="{end}" numLanes="{count}"'
        f' speed="13.9" priority="{priority}" {words or _CARS}>{lanes}</edge>'
    )


def _edges() -> str:
    """All edges."""
    rail = 'allow="rail" width="4.2"'
    lines = [
        _edge(ends, count=1, priority=20, words=rail)
        for ends in ("RS:R1", "R1:X", "X:R2", "R2:RN", "RN:R2", "R2:X", "X:R1", "R1:RS")
    ]
    lines += [_edge(ends, _WALK) for ends in ("W:Q", "Q:W", "Q:X", "X:Q", "T:X")]
    lines.append(_edge("X:T", _WALK, count=4))
    bus = '<lane index="1" allow="bus taxi"/>'
    lines += [_edge(ends, _WALK + bus, count=4) for ends in ("T:P", "P:E")]
    bicycle = '<lane index="1" allow="bicycle" width="1.6"/>'
    lines += [_edge(ends, _WALK + bicycle, count=4) for ends in ("P:T", "E:P")]
    for ends in ("TS:T", "T:TN", "TN:T", "T:TS"):
        lines.append(_edge(ends, _WALK + _TRAM.format(2), count=3, priority=3))
    lines += [_edge(e, count=1, priority=1) for e in ("QS:Q", "Q:QS", "PS:P", "P:PS")]
    return "<edges>" + "\n".join(lines) + "</edges>"


ROUTES = """<routes>
<vType id="car"/><vType id="tram" vClass="tram"/><vType id="train" vClass="rail" length="70"/>
<vType id="bus" vClass="bus"/><vType id="bike" vClass="bicycle"/>
<flow id="e" type="car" from="WQ" to="PE" begin="0" end="120" period="5"/>
<flow id="w" type="car" from="EP" to="QW" begin="0" end="120" period="6"/>
<flow id="n" type="car" from="TST" to="TTN" begin="0" end="120" period="9"/>
<flow id="t" type="tram" from="TST" to="TTN" begin="0" end="120" period="50"/>
<flow id="u" type="tram" from="TNT" to="TTS" begin="5" end="120" period="50"/>
<trip id="r" type="train" from="RSR1" to="R2RN" depart="35" departSpeed="max"/>
<flow id="b" type="bus" from="TST" to="PE" begin="3" end="120" period="40"/>
<flow id="c" type="bike" from="EP" to="TTN" begin="3" end="120" period="20"/>
</routes>"""


def missing() -> bool:
    """Whether SUMO's programs are not installed."""
    return any(program(name) is None for name in NEEDED)


def build_network(folder: Path, *, left_hand: bool = False) -> Path:
    """Make the network in a folder and return its file."""
    (folder / "town.nod.xml").write_text(NODES)
    (folder / "town.edg.xml").write_text(_edges())
    made = folder / "town.net.xml"
    words = ["-n", "town.nod.xml", "-e", "town.edg.xml", "-o", made.name]
    words += ["--crossings.guess", "--walkingareas", "--no-turnarounds"]
    words += ["--lefthand"] * left_hand
    call("netconvert", words, folder=folder)
    return made
