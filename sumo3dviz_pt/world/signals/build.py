"""Traffic lights: heads at every signalled stop line, lit as the log says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.library.street.road_styles import STYLES, SignalStyle
from sumo3dviz_pt.model.geometry import Colour, Floats, frozen
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.network import Connection, Network
from sumo3dviz_pt.model.scene import LeftOut, StaticPart
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.world.placement.driven_ground import DrivenGround, driven_ground
from sumo3dviz_pt.world.placement.lane_index import build_lane_index
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings
from sumo3dviz_pt.world.rails.guards import guard_of
from sumo3dviz_pt.world.signals.aspects import (
    GREEN,
    RED,
    YELLOW,
    AspectCourse,
    course_of,
    with_yellow,
)
from sumo3dviz_pt.world.signals.bodies import LAMP_SET, STACK, counter_rows, lamp_set, static_parts
from sumo3dviz_pt.world.signals.heads import Head, Support
from sumo3dviz_pt.world.signals.sites import sites

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

    def heads_of(self, tls: str, link: int) -> tuple[int, ...]:
        """Return indices of the heads that show a link's state."""
        return tuple(
            i for i, head in enumerate(self.heads) if head.tls == tls and link in head.links
        )

    def aspect_at(self, tls: str, link: int, time: float) -> frozenset[str]:
        """Return which lamps are lit for a link; none for an unknown link.

        Args:
            tls: Id of the traffic light.
            link: Number of the link.
            time: [s].
        """
        found = self.heads_of(tls, link)
        if not found:
            return frozenset()
        head = self.heads[found[0]]
        return head.course.lit_at(time, lamps=head.lamps)


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
