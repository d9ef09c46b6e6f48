"""The table of networks: what each number means."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from any_network.ageing import aged
from any_network.plain import Plain, Road, chain, ring, star


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a network and its traffic are made.

    Attributes:
        title: What is special about it.
        options: Of netgenerate, or of netconvert where there is plain XML.
        plain: What netconvert reads; None where netgenerate makes the network.
        after: What is done with the network's text.
        step: Of the simulation and of the log [s].
        end: Of the simulation [s].
        vehicles: How many are sent, about; those without a way are left out.
        persons: How many walk, about.
        sublane: Whether vehicles may stand anywhere across a lane.
        classes: `cars` alone, `road` for what belongs on roads, or `every` class that a lane
            is open to: SUMO lets trains and ships onto lanes without restrictions.
    """

    title: str
    options: str = ""
    plain: Plain | None = None
    after: Callable[[str], str] | None = None
    step: float = 0.5
    end: float = 24.0
    vehicles: int = 40
    persons: int = 0
    sublane: bool = False
    classes: str = "road"


GRID = "--grid --grid.number 3 --grid.length 90 --grid.attach-length 60"
SMALL = "--grid --grid.number 2 --grid.length 90 --grid.attach-length 70"
SPIDER = "--spider --spider.arm-number 5 --spider.circle-number 2 --spider.space-radius 80"
RANDOM = "--rand --rand.iterations 25 --rand.max-distance 160 --rand.min-distance 60"
WALKS = "--sidewalks.guess --crossings.guess --walkingareas"
LIGHTS = "-j traffic_light"

TWELVE = '<lane index="0" width="12"/><lane index="1" width="0.05"/><lane index="2" width="2"/>'
RAILS = 'allow="rail rail_urban rail_electric rail_fast" speed="30" width="3.2" spreadType="center"'
TRACK = 'allow="tram" speed="14" spreadType="center"'
MIXED = (
    '<lane index="0" allow="pedestrian wheelchair" width="2.5"/>'
    '<lane index="1" allow="bicycle scooter" width="1.5"/>'
    '<lane index="2" allow="bus taxi coach emergency"/><lane index="3" disallow="pedestrian tram"/>'
    '<lane index="4" allow="tram"/>'
)


def _wide() -> Plain:
    """Edges of one to eight lanes one after the other, and lanes of odd widths at the end."""
    places = {f"p{n}": (70.0 * n, 15.0 * (n % 2)) for n in range(10)}
    roads = [Road(f"p{n}", f"p{n + 1}", lanes=n + 1) for n in range(8)]
    return Plain(places, [*roads, Road("p8", "p9", lanes=3, lane_xml=TWELVE)], {})


def _motorway() -> Plain:
    """A motorway with an exit, a joining ramp and a road below the two."""
    fast = 'speed="36" priority="12" type="highway.motorway"'
    slow = 'speed="22" priority="8" type="highway.motorway_link"'
    nodes = {
        **{"a": (0, 0), "b": (400, 0), "c": (900, 0), "d": (1400, 0)},
        **{"x": (640, -90), "y": (660, -90)},
    }
    roads = [
        Road(a, b, lanes=3, more=fast, back=False) for a, b in (("a", "b"), ("b", "c"), ("c", "d"))
    ]
    roads += [
        Road("b", "x", more=slow, back=False),
        Road("x", "y", more=slow, back=False),
        Road("y", "c", more=slow, back=False),
    ]
    return Plain(nodes, roads, {})


def _level_crossing(signals: bool) -> Plain:
    """A railway across a road."""
    nodes = {
        **{"w": (-160, 0), "m": (0, 0), "e": (160, 0)},
        **{"s": (0, -160), "n": (0, 160), "k": (0, 80)},
    }
    rails = [
        Road("s", "m", more=RAILS, back=False, name="r0"),
        Road("m", "k", more=RAILS, back=False, name="r1"),
        Road("k", "n", more=RAILS, back=False, name="r2"),
    ]
    kinds = {"m": "rail_crossing", "k": "rail_signal" if signals else "priority"}
    return Plain(nodes, [Road("w", "m"), Road("m", "e"), *rails], kinds)


def _double_track() -> Plain:
    """Two tracks side by side with signals."""
    nodes = {
        **{"a": (0, 0), "b": (150, 0), "c": (300, 0), "d": (450, 0)},
        **{"p": (450, 4.5), "q": (300, 4.5), "r": (150, 4.5), "s": (0, 4.5)},
    }
    ways = [("a", "b"), ("b", "c"), ("c", "d"), ("p", "q"), ("q", "r"), ("r", "s")]
    roads = [Road(a, b, more=RAILS, back=False) for a, b in ways]
    kinds = dict.fromkeys(("b", "c", "q", "r"), "rail_signal")
    return Plain(nodes, roads, kinds)


def _river() -> Plain:
    """A waterway below a road on a bridge."""
    nodes = {
        **{"u": (0, -200, 0), "v": (0, 200, 0)},
        **{"w": (-200, 0, 1), "l": (-60, 0, 6.5), "r": (60, 0, 6.5), "e": (200, 0, 1)},
    }
    water = Road("u", "v", more='allow="ship" speed="6" width="20"')
    return Plain(nodes, [water, Road("w", "l"), Road("l", "r"), Road("r", "e")], {})


def _bridge() -> Plain:
    """A road with footways that crosses over another one."""
    nodes = {
        **{"u": (0, -180, 0), "o": (0, 0, 0), "v": (0, 180, 0)},
        **{"w": (-200, 0, 0), "l": (-40, 0, 7), "r": (40, 0, 7), "e": (200, 0, 0)},
    }
    roads = [Road("u", "o", lanes=2), Road("o", "v", lanes=2)]
    return Plain(nodes, [*roads, Road("w", "l"), Road("l", "r"), Road("r", "e")], {})


def _flat_crossing() -> Plain:
    """Two roads that cross without a junction and without heights."""
    nodes = {"u": (0, -150), "v": (0, 150), "w": (-150, 20), "e": (150, -20)}
    return Plain(nodes, [Road("u", "v", lanes=2), Road("w", "e")], {})


def _apart() -> Plain:
    """Three roads that nothing joins."""
    nodes = {
        **{"a": (0, 0), "b": (150, 0), "c": (0, 60), "d": (150, 70)},
        **{"e": (2200, 1500), "f": (2300, 1600)},
    }
    return Plain(nodes, [Road("a", "b"), Road("c", "d", lanes=2), Road("e", "f")], {})


def _street_with_tram() -> Plain:
    """A street with a footway, a cycle lane, a bus lane and a track, and one of cars across."""
    main = {"lanes": 5, "lane_xml": MIXED}
    nodes = {"w": (-150, 0), "m": (0, 0), "e": (150, 0), "n": (0, 120), "s": (0, -120)}
    roads = [Road("w", "m", **main), Road("m", "e", **main), Road("n", "m"), Road("m", "s")]
    return Plain(nodes, roads, {"m": "traffic_light"})


def _tracks() -> Plain:
    """Tram tracks of their own that meet a street at traffic lights."""
    nodes = {"w": (-150, 0), "m": (0, 0), "e": (150, 0), "n": (0, 150), "s": (0, -150)}
    roads = [Road("w", "m"), Road("m", "e"), Road("n", "m", more=TRACK), Road("m", "s", more=TRACK)]
    return Plain(nodes, roads, {"m": "traffic_light"})


def _plaza() -> Plain:
    """Ways for people on foot alone."""
    plain = star(5, 50.0)
    foot = 'allow="pedestrian wheelchair" speed="2" width="3"'
    roads = [Road(road.start, road.end, more=foot) for road in plain.roads]
    return Plain(plain.nodes, roads, {})


def _loops() -> Plain:
    """A road with a loop at its end, dead ends and two roads between the same nodes."""
    nodes = {"a": (0, 0), "b": (100, 0), "c": (170, 0), "d": (100, 80)}
    loop = 'speed="8" shape="170,0 200,30 230,0 200,-30 170,0"'
    bow = 'speed="8" shape="0,0 50,45 100,0"'
    roads = [
        Road("a", "b"),
        Road("b", "c"),
        Road("c", "c", more=loop, back=False, name="loop"),
        Road("a", "b", more=bow, name="bow"),
        Road("b", "d"),
    ]
    return Plain(nodes, roads, {})


def _acute() -> Plain:
    """Roads that meet at angles of five degrees."""
    nodes = {
        "m": (0, 0),
        **{"a": (200, 0), "b": (199, 17.4), "c": (197, 34.7), "d": (-150, 0), "e": (-149, 13)},
    }
    return Plain(nodes, [Road(name, "m") for name in "abcde"], {})


def _serpentine() -> Plain:
    """A mountain road with hairpins that climbs by a tenth."""
    shape, z = [], 0.0
    for turn in range(4):
        ends = (0.0, 120.0) if turn % 2 == 0 else (120.0, 0.0)
        for x in ends:
            shape.append((x, 14.0 * turn, z))
            z += 6.0
        bow = 7.0 if turn % 2 == 0 else -7.0
        shape.append((ends[1] + bow, 14.0 * turn + 7.0, z))
    points = " ".join(f"{x:.2f},{y:.2f},{h:.2f}" for x, y, h in shape)
    nodes = {"a": shape[0], "b": shape[-1]}
    return Plain(nodes, [Road("a", "b", more=f'speed="8.3" shape="{points}"')], {})


def _short() -> Plain:
    """Edges of a decimetre and less between long ones."""
    places = [(0, 0), (80, 0), (80.1, 0), (80.101, 0), (80.5, 0.4), (160, 20), (160, 20.02)]
    return chain(places)


def _clustered() -> Plain:
    """Two dual carriageways whose four junctions are joined into one."""
    nodes, roads = {}, []
    for x in (0, 14):
        for y in (0, 14):
            nodes[f"m{x}_{y}"] = (x, y)
    for name, x, y in (("w", -120, 0), ("e", 134, 0), ("s", 0, -120), ("n", 0, 134)):
        for part in (0, 14):
            nodes[f"{name}{part}"] = (x, part) if name in "we" else (part, y)
    lines = [
        *(("w14", "m0_14"), ("m0_14", "m14_14"), ("m14_14", "e14")),
        *(("e0", "m14_0"), ("m14_0", "m0_0"), ("m0_0", "w0")),
        *(("n0", "m0_14"), ("m0_14", "m0_0"), ("m0_0", "s0")),
        *(("s14", "m14_0"), ("m14_0", "m14_14"), ("m14_14", "n14")),
    ]
    for a, b in lines:
        roads.append(Road(b, a, lanes=2, back=False, name=f"{a}to{b}"))
    kinds = {name: "traffic_light" for name in nodes if name.startswith("m")}
    return Plain(nodes, roads, kinds)


def _on_earth() -> Plain:
    """A junction in degrees of longitude and latitude."""
    nodes = {"m": (13.4, 52.5), "a": (13.402, 52.5003), "b": (13.3985, 52.501), "c": (13.4, 52.499)}
    return Plain(nodes, [Road(name, "m", lanes=2) for name in "abc"], {}, degrees=True)


RECIPES: tuple[Recipe, ...] = (
    Recipe("grid", GRID, classes="every"),
    Recipe("grid, left-hand, lights", f"{GRID} --lefthand {LIGHTS} -L 2", sublane=True),
    Recipe("grid, hills", f"{GRID} --perturb-z 4 -L 2"),
    Recipe("grid, hills, footways", f"{SMALL} --perturb-z 4 {WALKS}", persons=20),
    Recipe(
        "grid, footways, cycle lanes, actuated lights",
        f"{SMALL} {WALKS} --bikelanes.guess {LIGHTS} --tls.default-type actuated",
        persons=20,
        step=0.1,
        end=20.0,
    ),
    Recipe(
        "grid, turn lanes, lights", f"{GRID} --turn-lanes 1 --turn-lanes.length 30 -L 2 {LIGHTS}"
    ),
    Recipe("spider", SPIDER, step=1.0, end=30.0),
    Recipe(
        "spider, left-hand, footways, no middle",
        f"{SPIDER} --spider.omit-center --lefthand {WALKS}",
        persons=25,
    ),
    Recipe("random", f"{RANDOM} --seed 8 -L 2"),
    Recipe(
        "random, left-hand, guessed lights, footways",
        f"{RANDOM} --seed 9 --lefthand --tls.guess --tls.guess.threshold 40 {WALKS}",
        persons=25,
    ),
    Recipe(
        "random, hills, cycle lanes",
        f"{RANDOM} --seed 10 --perturb-z 3 --bikelanes.guess",
        step=1.0,
    ),
    Recipe("grid, no internal links", f"{GRID} --no-internal-links -L 2", sublane=True),
    Recipe("spider, left-hand, no internal links", f"{SPIDER} --lefthand --no-internal-links"),
    Recipe("far from the origin", f"{SMALL} --offset.x 450000 --offset.y 5400000 {LIGHTS}"),
    Recipe("negative coordinates", f"{SMALL} --offset.x -3000 --offset.y -1500 --lefthand"),
    Recipe("right before left", f"{SMALL} -j right_before_left"),
    Recipe("all-way stops", f"{SMALL} -j allway_stop {WALKS}", persons=15),
    Recipe("priority stops", f"{SMALL} -j priority_stop -L 2"),
    Recipe("zipper", plain=_motorway(), options="-j zipper"),
    Recipe("unregulated", f"{SMALL} -j unregulated --lefthand"),
    Recipe("roundabout", plain=ring(18, 4), options="--roundabouts.guess"),
    Recipe(
        "roundabout, left-hand, footways",
        plain=ring(25, 5, left=True),
        options=f"--lefthand --roundabouts.guess {WALKS}",
        persons=20,
    ),
    Recipe("motorway with ramps", plain=_motorway(), options="--ramps.guess", vehicles=60),
    Recipe(
        "motorway of 5 km",
        plain=chain(
            [(0, 0), (2500, 300), (5000, 0)],
            lanes=4,
            more='speed="36" type="highway.motorway"',
            back=False,
        ),
        vehicles=150,
        step=1.0,
    ),
    Recipe(
        "one to eight lanes, and lanes of 0.05 m and 12 m",
        plain=_wide(),
        vehicles=80,
        classes="every",
    ),
    Recipe("lengths of next to nothing", plain=_short(), classes="every"),
    Recipe("parts that nothing joins", plain=_apart()),
    Recipe("level crossing", plain=_level_crossing(signals=False), step=1.0, end=40.0),
    Recipe("level crossing with rail signals", plain=_level_crossing(signals=True), end=40.0),
    Recipe("railway with two tracks and signals", plain=_double_track(), end=40.0, step=1.0),
    Recipe("river below a bridge", plain=_river()),
    Recipe("bridge with footways", plain=_bridge(), options=WALKS, persons=15),
    Recipe("two roads that cross without a junction", plain=_flat_crossing()),
    Recipe("opposite lanes", plain=star(3, 130.0), options="--opposites.guess"),
    Recipe("as SUMO 0.27 wrote it", f"{GRID} -L 2", after=lambda text: aged(text, bare=False)),
    Recipe(
        "with nothing but what readers need",
        f"{SMALL} --no-internal-links",
        after=lambda text: aged(text, bare=True),
    ),
    Recipe("one lane alone", plain=chain([(0, 0), (100, 0)], back=False), vehicles=6),
    Recipe("one junction of roads of 30 m", plain=star(4, 30.0, turn=0.3), vehicles=12),
    Recipe("20 m in all", plain=chain([(0, 0), (20, 0)]), vehicles=3, end=20.0),
    Recipe("joined junctions, lights", plain=_clustered(), options="--junctions.join --tls.join"),
    Recipe("place on the Earth", plain=_on_earth(), options="--proj.utm"),
    Recipe(
        "street with a tram's lane",
        plain=_street_with_tram(),
        options="--crossings.guess --walkingareas",
        persons=20,
    ),
    Recipe("tram's own tracks, lights", plain=_tracks(), options=WALKS, persons=10),
    Recipe("people on foot alone", plain=_plaza(), options=WALKS, vehicles=0, persons=40),
    Recipe("a loop, dead ends and twins", plain=_loops()),
    Recipe("roads at five degrees", plain=_acute()),
    Recipe("hairpins on a hillside", plain=_serpentine(), step=1.0),
    Recipe("steep hills", f"{SMALL} --perturb-z 14 -L 2", sublane=True),
    Recipe(
        "everything at once",
        f"{RANDOM} --seed 48 --lefthand --perturb-z 2 --random-lanenumber -L 3 {WALKS}"
        " --bikelanes.guess --tls.guess --tls.guess.threshold 30 --turn-lanes 1",
        persons=30,
        sublane=True,
    ),
    Recipe(
        "grid, random numbers of lanes, cars alone",
        f"{GRID} --random-lanenumber -L 5",
        classes="cars",
    ),
)
"""A network's number is its place here; new ones come at the end."""
