"""Traffic lights: heads at every signalled stop line, lit as the log says."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.job import SignalSettings
from sumo3dviz_pt.model.geometry import Floats, Mesh, frozen, merge_meshes
from sumo3dviz_pt.model.network import Connection, Network
from sumo3dviz_pt.model.scene import LampSet, LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.scene.aspects import GREEN, RED, YELLOW, Course, course_of, with_yellow
from sumo3dviz_pt.scene.lane_index import LaneIndex, build_lane_index
from sumo3dviz_pt.scene.signal_sites import Head, Support, sites
from sumo3dviz_pt.shapes import traffic_light

_LOG = logging.getLogger(__name__)

LAMP_SET = "signals"
"""Id of the only lamp set."""

RADIANCE: Mapping[str, tuple[float, float, float]] = {
    RED: (1.9, 0.02, 0.012),
    YELLOW: (1.9, 0.85, 0.02),
    GREEN: (0.02, 1.8, 0.65),
}
"""Of a lit lens, in scene units, where a sunlit white wall has about 1.

Twice as bright as white, so that it reads in sunlight; not more, because tone curves
turn very bright colours white: red of 3.2 came out salmon under `neutral`.
"""

_STACK = {2: (GREEN, RED), 3: (GREEN, YELLOW, RED)}  # from the lowest lamp up


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """Everything about traffic lights of a scene.

    Attributes:
        static: Poles and housings.
        lamps: One lamp set with every lens, or nothing.
        heads: All heads; lamps follow them in order, from the lowest lamp up.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...] = ()
    lamps: tuple[LampSet, ...] = ()
    heads: tuple[Head, ...] = ()
    left_out: tuple[LeftOut, ...] = ()

    def radiance_at(self, time: float) -> dict[str, Floats]:
        """Radiance of every lamp at a time [s], (lamps, 3), by lamp set id."""
        if not self.lamps:
            return {}
        known: dict[tuple[int, int], frozenset[str]] = {}
        rows = []
        for head in self.heads:
            key = (id(head.course), head.lamps)
            if key not in known:
                known[key] = head.course.lit_at(time, lamps=head.lamps)
            rows += [
                RADIANCE[c] if c in known[key] else (0.0, 0.0, 0.0) for c in _STACK[head.lamps]
            ]
        return {LAMP_SET: frozen(np.array(rows))}

    def heads_of(self, tls: str, link: int) -> tuple[int, ...]:
        """Indices of the heads that show a link's state."""
        return tuple(
            i for i, head in enumerate(self.heads) if head.tls == tls and link in head.links
        )

    def aspect_at(self, tls: str, link: int, time: float) -> frozenset[str]:
        """Which lamps are lit for a link at a time [s]; empty for an unknown link."""
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
    index: LaneIndex | None = None,
) -> Signals:
    """Build the traffic lights of a network.

    Args:
        network: The road network; its connections say where lights stand.
        phases: The signal log by tls id.
        settings: Design, and what to do about missing yellow.
        index: The network's lanes, if somebody indexed them already.

    Returns:
        Empty, and saying why, without lights in the network or without a log.
    """
    links, left_out = _signalled(network, phases, settings)
    if not links:
        return Signals(left_out=left_out)
    lamps = 3 if settings.design == "three_heads" else 2
    courses: dict[tuple[str, int, bool], Course] = {}
    unique: dict[Course, Course] = {}

    def shown(link: Connection, lamps_of_head: int) -> Course:
        walks = network.edges[network.lanes[link.from_lane].edge_id].function != "normal"
        fill = settings.yellow == "auto" and lamps_of_head == 3 and not walks
        key = (link.tls, link.link_index, fill)
        if key not in courses:
            course = course_of(phases[link.tls], link.link_index)
            course = with_yellow(course, settings.yellow_time) if fill else course
            courses[key] = unique.setdefault(course, course)
        return courses[key]

    heads, supports = sites(
        network, links, index=index or build_lane_index(network), course_of=shown, lamps=lamps
    )
    if not heads:
        return Signals(left_out=left_out)
    return Signals(_static(heads, supports), (_lamp_set(heads),), tuple(heads), left_out)


def _signalled(
    network: Network, phases: Mapping[str, SignalPhases], settings: SignalSettings
) -> tuple[list[Connection], tuple[LeftOut, ...]]:
    """Connections with a light whose states are known, and why others have none."""
    if not settings.show:
        return [], (LeftOut("signals", "switched off by `signals.show`"),)
    links = [link for link in network.connections if link.tls and link.link_index >= 0]
    if not links:
        return [], (LeftOut("signals", "the network has none"),)
    if not any(entry.states for entry in phases.values()):
        return [], (LeftOut("signals", "there is no signal log"),)
    silent = {link.tls for link in links if not (link.tls in phases and phases[link.tls].states)}
    known = [link for link in links if link.tls not in silent]
    right = [
        link
        for link in known
        if any(link.link_index < len(state) for state in phases[link.tls].states)
    ]
    left_out = []
    if silent:
        left_out.append(
            LeftOut(
                f"signals of {len(silent)} traffic lights",
                f"the signal log does not know them: {_some(silent)}",
            )
        )
    if len(right) < len(known):
        left_out.append(
            LeftOut(
                f"signals of {len(known) - len(right)} links",
                "the log's state strings are too short for them",
            )
        )
    for item in left_out:
        _LOG.warning("left out %s: %s", item.what, item.why)
    return right, tuple(left_out)


def _some(names: set[str]) -> str:
    """The first few names."""
    listed = sorted(names)
    return ", ".join(listed[:3]) + (", ..." if len(listed) > 3 else "")


def _static(heads: Sequence[Head], supports: Sequence[Support]) -> tuple[StaticPart, ...]:
    """Housings and poles, merged by material."""
    bodies = {lamps: traffic_light.housing(lamps) for lamps in _STACK}
    housings = [traffic_light.placed(bodies[head.lamps], head.position, head.yaw) for head in heads]
    poles = [_support(support) for support in supports]
    return tuple(
        StaticPart(f"signals/{material}", "signals", Part(merge_meshes(meshes), material))
        for material, meshes in (("signal_housing", housings), ("signal_pole", poles))
    )


def _support(support: Support) -> Mesh:
    """A pole or a mast, with a crossbar for several heads."""
    if support.reach:
        mesh = traffic_light.mast(support.height, support.reach)
    else:
        mesh = traffic_light.pole(support.height)
    if support.bar:
        height = support.height - 0.4 if not support.reach else 2.9
        mesh = merge_meshes([mesh, traffic_light.crossbar(support.bar, height)])
    return traffic_light.placed(mesh, support.position, support.yaw)


def _lamp_set(heads: Sequence[Head]) -> LampSet:
    """All lenses as one mesh, and the names of the lamps."""
    discs = [traffic_light.lens(i) for i in range(3)]
    meshes: list[Mesh] = []
    names: list[str] = []
    count: Counter[tuple[str, int]] = Counter()
    for head in heads:
        number = count[head.tls, head.links[0]]
        count[head.tls, head.links[0]] += 1
        for i, colour in enumerate(_STACK[head.lamps]):
            meshes.append(traffic_light.placed(discs[i], head.position, head.yaw))
            names.append(f"{head.tls}/{head.links[0]}/{number}/{colour}")
    sizes = [len(mesh.faces) for mesh in meshes]
    lamp_of_face = np.repeat(np.arange(len(meshes)), sizes)
    return LampSet(LAMP_SET, "signals", merge_meshes(meshes), lamp_of_face, tuple(names))
