"""Traffic lights: heads at every signalled stop line, lit as the log says.

They are meshes of heads, of what carries them, and of everything in them that shines.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.library.street import national, traffic_light
from sumo3dviz_pt.library.street.road_styles import STYLES, SignalStyle
from sumo3dviz_pt.model.geometry import (
    Colour,
    Floats,
    Ints,
    Mesh,
    Transform,
    belonging,
    frozen,
    merge_meshes,
)
from sumo3dviz_pt.model.network import Connection, Network
from sumo3dviz_pt.model.scene import LampSet, LeftOut, Lobe, Part, StaticPart
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.world.placement.lanes import DrivenGround, build_lane_index, driven_ground
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings, thing_at
from sumo3dviz_pt.world.rails.ways import guard_of
from sumo3dviz_pt.world.signals.heads import (
    ARM_BOTTOM,
    GREEN,
    RED,
    YELLOW,
    AspectCourse,
    Head,
    Support,
    course_of,
    with_yellow,
)
from sumo3dviz_pt.world.signals.sites import sites

LAMP_SET = "signals"
"""Id of the only lamp set."""

STACK: Mapping[int, tuple[str, ...]] = {2: (GREEN, RED), 3: (GREEN, YELLOW, RED)}
"""Lamps of a head from the lowest up."""

LOBE = Lobe(0.06, 40.0)
"""Of a lens by night: half of its light beyond 10 degrees from the axis, as lenses have that
are to be seen along a street (EN 12368 tells them apart as extra wide, wide, medium and
narrow), and enough at the side to be seen lit."""

FAR = 150.0
"""Distance beyond which heads and poles are plainer [m]."""

GLASS: Mapping[str, Colour] = {
    RED: (0.12, 0.006, 0.006),
    YELLOW: (0.13, 0.055, 0.004),
    GREEN: (0.004, 0.075, 0.045),
}
"""Reflectance of lenses that are not lit."""

_DARK: Colour = (0.02, 0.02, 0.02)
_FIGURES = ("foot", "tram")
_SMALL = 0.62  # size of heads for cyclists against those for cars
_ARM = ARM_BOTTOM + 1.0


def static_parts(
    heads: Sequence[Head],
    supports: Sequence[Support],
    *,
    head_distances: Floats,
    support_distances: Floats,
    style: SignalStyle,
) -> tuple[StaticPart, ...]:
    """Build housings and poles, merged by material.

    Args:
        heads: All of them.
        supports: All of them.
        head_distances: Of each head from the nearest camera, (heads,) [m].
        support_distances: Of each support from the nearest camera, (supports,) [m].
        style: Colours of heads for vehicles.
    """
    levels = [(away > FAR).astype(np.int64) for away in (head_distances, support_distances)]
    by_material: dict[str, list[Mesh]] = {}
    for head, title, level in zip(heads, _titles(heads), levels[0], strict=True):
        thing = _thing(title)
        for material, mesh in _head(head, int(level), style).items():
            by_material.setdefault(material, []).append(belonging(_placed(mesh, head), thing))
    for support, level in zip(supports, levels[1], strict=True):
        for material, mesh in _support(support, int(level)).items():
            thing = thing_at("pole", support.position)
            by_material.setdefault(material, []).append(belonging(mesh, thing))
    return tuple(
        StaticPart(f"signals/{material}", "signals", Part(merge_meshes(meshes), material))
        for material, meshes in sorted(by_material.items())
    )


def lamp_set(heads: Sequence[Head]) -> LampSet:
    """Build all that shines as one mesh: lamps of every head, then bars of every counter."""
    meshes: list[Mesh] = []
    names: list[str] = []
    glass: list[Colour] = []
    titles = _titles(heads)
    for head, title in zip(heads, titles, strict=True):
        for i, colour in enumerate(STACK[head.lamps]):
            meshes.append(belonging(_placed(_lamp(head, i, colour), head), _thing(title)))
            names.append(f"{title}/{colour}")
            glass.append(_DARK if head.kind in _FIGURES else GLASS[colour])
    for head, title in zip(heads, titles, strict=True):
        for place in (0, 1) if head.counter else ():
            bars = traffic_light.digit(place, head.lamps)
            meshes += [belonging(_placed(mesh, head), _thing(title)) for mesh in bars]
            names += [f"{title}/countdown/{place}{bar}" for bar in traffic_light.BARS]
            glass += [_DARK] * len(bars)
    index = _lamp_of_face(meshes)
    tint = np.array(glass)[index]
    mesh = merge_meshes(meshes)
    return LampSet(LAMP_SET, "signals", mesh, index, tuple(names), weight=1.5, tint=tint, lobe=LOBE)


def counter_rows(number: int | None, colour: Colour) -> list[Colour]:
    """Return the radiance of the fourteen bars of a counter that shows a number, or nothing."""
    lit = traffic_light.bars_of(number)
    return [
        colour if (place, bar) in lit else (0.0, 0.0, 0.0)
        for place in (0, 1)
        for bar in traffic_light.BARS
    ]


def _titles(heads: Sequence[Head]) -> list[str]:
    """The beginning of the names of a head's lamps: light, link and number."""
    count: Counter[tuple[str, int]] = Counter()
    titles = []
    for head in heads:
        key = (head.tls, head.links[0])
        titles.append(f"{head.tls}/{head.links[0]}/{count[key]}")
        count[key] += 1
    return titles


def _thing(title: str) -> str:
    """What the faces of a head belong to, by the beginning of the names of its lamps."""
    return f"signal:{title}"


def _lamp_of_face(meshes: Sequence[Mesh]) -> Ints:
    """Number of the mesh that each face of them all belongs to."""
    return np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])


def _lamp(head: Head, index: int, colour: str) -> Mesh:
    """What shines: a lens, or a person for people."""
    if head.walks:
        return traffic_light.walker(index, walking=colour == GREEN)
    if head.kind == "tram":
        return traffic_light.tram_bar(index, {RED: "stop", YELLOW: "wait", GREEN: "go"}[colour])
    return traffic_light.lens(index)


def _placed(mesh: Mesh, head: Head) -> Mesh:
    """A mesh of a head where it hangs."""
    if head.kind == "bicycle":
        return Transform.from_pose(head.position, yaw=head.yaw, scale=_SMALL).mesh(mesh)
    return traffic_light.placed(mesh, head.position, head.yaw)


def _head(head: Head, level: int, style: SignalStyle) -> dict[str, Mesh]:
    """Everything of a head that does not shine, by material."""
    yellow = style.housing == "yellow" and head.kind == "vehicle"
    backed = head.kind == "rail" or (head.kind == "vehicle" and not yellow)
    rim = backed and (head.kind == "rail" or style.border == "white")
    parts = dict(_box(head.lamps, level, backed=backed, rim=rim, counter=head.counter))
    if head.kind in _FIGURES:
        windows = [traffic_light.window(i, sides=20 - 12 * level) for i in range(head.lamps)]
        parts["glass"] = merge_meshes(windows)
    if yellow:
        parts["signal_housing_yellow"] = parts.pop("signal_housing")
    if head.over_road:
        top = _ARM - float(head.position[2] - head.foot[2])
        parts["signal_pole"] = traffic_light.hanger(head.lamps, top)
    elif not level:
        parts["signal_pole"] = traffic_light.bracket(head.lamps)
    return parts


@cache
def _box(lamps: int, level: int, *, backed: bool, rim: bool, counter: bool) -> Mapping[str, Mesh]:
    """The housing of a head, with a board behind it and a white rim around that, by material."""
    parts = {
        "signal_housing": traffic_light.housing(lamps, backing=backed, counter=counter, level=level)
    }
    if rim:
        parts["signal_border"] = traffic_light.border(lamps + counter)
    return parts


def _support(support: Support, level: int) -> dict[str, Mesh]:
    """A pole or a mast, with a crossbar for several heads, by material."""
    parts: dict[str, list[Mesh]] = {"signal_pole": []}
    if support.rail:
        for part in national.rail_mast(support.height, level=level):
            parts.setdefault(part.material, []).append(part.mesh)
    elif support.reach:
        mast = traffic_light.mast(support.height, support.reach, level=level)
        parts["signal_pole"].append(mast)
    else:
        parts["signal_pole"].append(traffic_light.pole(support.height, level=level))
    if support.bar:
        height = support.height - 0.4 if not support.reach else 2.9
        parts["signal_pole"].append(traffic_light.crossbar(support.bar, height))
    return {
        material: traffic_light.placed(merge_meshes(meshes), support.position, support.yaw)
        for material, meshes in parts.items()
    }


RADIANCE: Mapping[str, Colour] = {
    RED: (1.5, 0.013, 0.008),
    YELLOW: (0.78, 0.31, 0.006),
    GREEN: (0.006, 0.52, 0.18),
}
"""Of a lit lens on its axis, in scene units, where a sunlit white wall has about 1.

On a lens of 200 mm these are 330 cd of red and 390 cd of yellow and green. EN 12368 has 100
to 400 cd for heads of performance level 1, class 1.
"""


TRAM_RADIANCE: Mapping[str, Colour] = dict.fromkeys((RED, YELLOW, GREEN), (0.7, 0.7, 0.66))
"""The same for the white bars of trams' signals."""

_HEAD_HEIGHT, _HEAD_RADIUS = 1.1, 0.2  # about [m]
_POLE_HEIGHT, _POLE_RADIUS = 3.2, 0.06
_SAME_GROUND = 2.0
"""Ground that is higher than a signal's road by more belongs to another level [m]."""

NIGHT_POWER = 0.35
"""Factor of `RADIANCE` by night, when signals are dimmed so that they do not dazzle."""


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """Everything about traffic lights of a scene.

    Attributes:
        static: Poles and housings.
        lamps: One lamp set with every lens, or nothing.
        heads: All heads; lamps follow them in order, from the lowest lamp up,
            and then the digits of their counters.
        left_out: What was left out, and why.
        power: Factor of `RADIANCE`.
    """

    static: tuple[StaticPart, ...] = ()
    lamps: tuple[LampSet, ...] = ()
    heads: tuple[Head, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    power: float = 1.0

    @property
    def feet(self) -> Floats:
        """Where poles stand, (heads, 2) [m]."""
        return np.array([head.foot[:2] for head in self.heads]).reshape(-1, 2)

    def radiance_at(self, time: float) -> dict[str, Floats]:
        """Return the radiance of every lamp at a time [s], (lamps, 3), by lamp set id."""
        if not self.lamps:
            return {}
        known: dict[tuple[int, int], frozenset[str]] = {}
        rows = []
        counters = []
        for head in self.heads:
            key = (id(head.course), head.lamps)
            if key not in known:
                known[key] = head.course.lit_at(time, lamps=head.lamps)
            lit = [colour for colour in STACK[head.lamps] if colour in known[key]]
            shines = TRAM_RADIANCE if head.kind == "tram" else RADIANCE
            rows += [shines[c] if c in lit else (0.0, 0.0, 0.0) for c in STACK[head.lamps]]
            if head.counter:
                number = head.course.seconds_left(time) if lit else None
                counters += counter_rows(number, RADIANCE[lit[-1]] if lit else (0.0, 0.0, 0.0))
        return {LAMP_SET: frozen(self.power * np.array(rows + counters))}

    def following(self, phases: Mapping[str, SignalPhases], settings: SignalSettings) -> Signals:
        """Return the same lights, lit as another log says; what that does not know stays.

        Args:
            phases: The signal log by tls id.
            settings: What to do about missing yellow.
        """
        courses: dict[tuple[str, int, bool], AspectCourse] = {}
        heads = []
        for head in self.heads:
            fill = settings.yellow == "auto" and head.lamps == 3 and not head.walks
            key = (head.tls, head.links[0], fill)
            if key not in courses and head.tls in phases:
                course = course_of(phases[head.tls], head.links[0])
                courses[key] = with_yellow(course, settings.yellow_time) if fill else course
            heads.append(replace(head, course=courses.get(key, head.course)))
        return replace(self, heads=tuple(heads))

    def heads_of(self, tls: str, link: int) -> tuple[int, ...]:
        """Return indices of the heads that show a link's state."""
        return tuple(
            i for i, head in enumerate(self.heads) if head.tls == tls and link in head.links
        )


def build_signals(
    network: Network,
    phases: Mapping[str, SignalPhases],
    settings: SignalSettings,
    *,
    style: SignalStyle = STYLES["european"].signals,
    around: Surroundings | None = None,
    standing: HeightAt | None = None,
) -> Signals:
    """Build the traffic lights of a network.

    Args:
        network: The road network; its connections say where lights stand.
        phases: The signal log by tls id.
        settings: Design, and what to do about missing yellow.
        style: What heads look like, and where they are repeated.
        around: Lanes and cameras, if they are indexed already; without, all is near.
        standing: Height of whatever people walk on at places.

    Returns:
        Empty, and saying why, without lights in the network or without a log.
    """
    links, left_out = _signalled(network, phases, settings)
    if not links:
        return Signals(left_out=left_out)
    # Decide what a head shows; links that show the same share one course.
    lamps = 2 if settings.design == "two_heads" else 3
    courses: dict[tuple[str, int, bool], AspectCourse] = {}
    unique: dict[AspectCourse, AspectCourse] = {}

    def shown(link: Connection, lamps_of_head: int) -> AspectCourse:
        walks = network.edges[network.lanes[link.from_lane].edge_id].function != "normal"
        fill = settings.yellow == "auto" and lamps_of_head == 3 and not walks
        key = (link.tls, link.link_index, fill)
        if key not in courses:
            course = course_of(phases[link.tls], link.link_index)
            course = with_yellow(course, settings.yellow_time) if fill else course
            courses[key] = unique.setdefault(course, course)
        return courses[key]

    # Place heads and poles, as high as people walk there.
    ground = _driven_ground(network, around)
    heads, supports = sites(
        network, links, ground=ground, course_of=shown, lamps=lamps, far_side=style.far_side
    )
    if not heads:
        return Signals(left_out=left_out)
    if settings.design == "countdown":
        heads = [replace(head, counter=head.kind == "vehicle") for head in heads]
    heads = [
        replace(head, position=head.position + up, foot=head.foot + up)
        for head, up in zip(heads, _lift(heads, standing), strict=True)
    ]
    supports = [
        replace(support, position=support.position + up)
        for support, up in zip(supports, _lift(supports, standing), strict=True)
    ]
    # Build what they are made of.
    static = static_parts(
        heads,
        supports,
        head_distances=_distances(heads, around),
        support_distances=_distances(supports, around),
        style=style,
    )
    power = NIGHT_POWER if around is not None and around.dark else 1.0
    left_out += _in_the_way(heads, network, around)
    return Signals(static, (lamp_set(heads),), tuple(heads), left_out, power)


def _driven_ground(network: Network, around: Surroundings | None) -> DrivenGround:
    """Where vehicles drive, indexed once for all shots."""
    if around is None:
        return driven_ground(network, build_lane_index(network))
    return around.memory.of(("driven ground",), partial(driven_ground, network, around.index))


def _lift(things: list[Head] | list[Support], standing: HeightAt | None) -> Floats:
    """By how much things move up to stand on the ground, (n, 3) [m]; never onto a bridge."""
    up = np.zeros((len(things), 3))
    if standing is not None and things:
        feet = np.array([thing.foot for thing in things])
        rise = standing(feet[:, :2]) - feet[:, 2]
        up[:, 2] = np.where(rise < _SAME_GROUND, np.maximum(rise, 0.0), 0.0)
    return up


def _distances(things: list[Head] | list[Support], around: Surroundings | None) -> Floats:
    """How far things are from the nearest camera, (n,) [m]; 0 without one."""
    if around is None or not len(around.viewpoints):
        return np.zeros(len(things))
    return around.distances(np.array([thing.position[:2] for thing in things]).reshape(-1, 2))


def _signalled(
    network: Network, phases: Mapping[str, SignalPhases], settings: SignalSettings
) -> tuple[list[Connection], tuple[LeftOut, ...]]:
    """Connections with a light whose states are known, and why others have none."""
    if not settings.show:
        return [], (LeftOut("signals", "switched off by `signals.show`"),)
    links = [
        link
        for link in network.connections
        if link.tls and link.link_index >= 0 and guard_of(network, link) != "level crossing"
    ]
    if not links:
        return [], (LeftOut("signals", "the network has none"),)
    if not any(entry.states for entry in phases.values()):
        return [], (LeftOut("signals", "there is no signal log"),)
    # Keep links whose state is in the log.
    silent = {link.tls for link in links if not (link.tls in phases and phases[link.tls].states)}
    known = [link for link in links if link.tls not in silent]
    right = [
        link
        for link in known
        if any(link.link_index < len(state) for state in phases[link.tls].states)
    ]
    # Say what is missing.
    left_out = []
    if silent:
        left_out.append(
            LeftOut(
                f"signals of {len(silent)} traffic lights",
                f"the signal log does not know them: {_some(silent)}",
                surprising=True,
            )
        )
    if len(right) < len(known):
        left_out.append(
            LeftOut(
                f"signals of {len(known) - len(right)} links",
                "the log's state strings are too short for them",
                surprising=True,
            )
        )
    return right, tuple(left_out)


def _in_the_way(
    heads: Sequence[Head], network: Network, around: Surroundings | None
) -> tuple[LeftOut, ...]:
    """Say which heads and poles fill much of a camera's picture: they stay, being signals."""
    if around is None:
        return ()
    filled = around.clearance.filled
    places, feet = (
        np.array([getattr(head, name) for head in heads]) for name in ("position", "foot")
    )
    hides = filled(places[:, :2], places[:, 2], height=_HEAD_HEIGHT, radius=_HEAD_RADIUS)
    hides |= filled(feet[:, :2], feet[:, 2], height=_POLE_HEIGHT, radius=_POLE_RADIUS)
    if not hides.any():
        return ()
    what = f"a clear view past {int(hides.sum())} heads of traffic lights"
    outside = network.location.outside(places[int(np.argmax(hides)), :2])
    first = "({:.0f}, {:.0f})".format(*outside)
    why = f"they stand right before a camera, the first at {first}; another eye sees past them"
    return (LeftOut(what, why),)


def _some(names: set[str]) -> str:
    """The first few names."""
    listed = sorted(names)
    return ", ".join(listed[:3]) + (", ..." if len(listed) > 3 else "")
