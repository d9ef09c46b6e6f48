"""Whoever waits first at a stop line has a head of his own lane in the picture before him."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest
from any_network.programs import program

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.library.street.road_styles import STYLES
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.shot.cameras.riding import read_view
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.world.signals.heads import direction_at_end, kind_of
from sumo3dviz_pt.world.signals.signals import Signals, build_signals

EYE = (2.1, 0.37, 1.2)
"""A driver's eye in a common car: behind its front, towards the road's middle, up [m]."""

GAPS = (0.2, 1.0)
"""From the front of a car that waits to the end of its lane [m]."""

GRID = "--grid --grid.number 2 --grid.length 90 --grid.attach-length 70 -j traffic_light"
RANDOM = "--rand --rand.iterations 20 --rand.max-distance 160 --rand.min-distance 60"
NETS = [
    f"{GRID} -L 2",
    f"{GRID} -L 3 --lefthand",
    f"{GRID} -L 2 --sidewalks.guess --crossings.guess",
    f"{RANDOM} -j traffic_light -L 2 --seed 7",
]


def blind(network: Network, signals: Signals) -> list[str]:
    """Lanes whose first waiting driver has no lens of an own head in the picture."""
    preset = read_view("driver")
    half = np.tan(np.radians(preset.fov / 2.0))
    side = -1.0 if network.left_hand else 1.0
    links = [k for k in network.connections if k.tls and kind_of(network, k) == "vehicle"]
    found = []
    for name in dict.fromkeys(link.from_lane for link in links):
        own = {(k.tls, k.link_index) for k in links if k.from_lane == name}
        heads = [h for h in signals.heads if any((h.tls, n) in own for n in h.links)]
        along, yaw = direction_at_end(network.lanes[name].shape)
        for gap in GAPS:
            middle = side * np.array([-along[1], along[0], 0.0])
            eye = network.lanes[name].shape[-1] - (gap + EYE[0]) * along + EYE[1] * middle
            eye = eye + np.array([0.0, 0.0, EYE[2]])
            camera = Transform.from_pose(eye, yaw=yaw, pitch=np.radians(preset.pitch_deg))
            seen = False
            for head in heads:
                lenses = head.position + np.array([[0, 0, 0.15], [0, 0, 0.3 * head.lamps - 0.15]])
                ahead, left, up = ((lenses - eye) @ camera.matrix[:3, :3]).T
                faces = np.cos(head.yaw - yaw) > 0.5
                inside = (np.abs(left) < half * ahead) & (np.abs(up) < half * 9 / 16 * ahead)
                seen |= bool(faces and inside.all())
            if not seen:
                found.append(name)
    return found


def lit(network: Network, style: str) -> Signals:
    """Every light of a network; neighbouring links show different things."""
    counts: dict[str, int] = {}
    for link in network.connections:
        if link.tls:
            counts[link.tls] = max(counts.get(link.tls, 0), link.link_index + 1)
    phases = {
        tls: SignalPhases(
            tls,
            (0.0, 10.0),
            tuple("".join("Gr"[(k + phase) % 2] for k in range(count)) for phase in (0, 1)),
        )
        for tls, count in counts.items()
    }
    return build_signals(network, phases, SignalSettings(), style=STYLES[style].signals)


def approach(lanes: int, *, across: float, left: bool) -> Network:
    """An edge to the east whose lanes lead over a junction so wide [m]."""
    side = -1.0 if left else 1.0

    def edge(name: str, ends: tuple[str, str], x: tuple[float, float]) -> Edge:
        rows = [np.array([(x[0], 3.2 * side * k, 0.0), (x[1], 3.2 * side * k, 0.0)])
                for k in range(lanes)]  # fmt: skip
        made = [Lane(f"{name}_{k}", name, k, row, 3.2, 13.9, 100.0, frozenset({"passenger"}))
                for k, row in enumerate(rows)]  # fmt: skip
        return Edge(name, "normal", *ends, tuple(made))

    end = 100.0 + across
    low, high = sorted((-1.6 * side, 3.2 * side * (lanes - 0.5)))
    outline = np.array([(100.0, low, 0), (end, low, 0), (end, high, 0), (100.0, high, 0)])
    links = tuple(Connection(f"in_{k}", f"out_{k}", "", "B", k) for k in range(lanes))
    edges = {"in": edge("in", ("A", "B"), (0.0, 100.0)), "out": edge("out", ("B", "C"), (end, 250))}
    junction = Junction("B", "traffic_light", outline.mean(axis=0), outline)
    return Network(edges, {"B": junction}, links, Location(), left)


@pytest.mark.parametrize("style", sorted(STYLES))
@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize("across", [1.0, 6.0, 14.0, 30.0, 80.0])
def test_the_first_driver_of_every_lane_sees_a_head_of_his_own(style, left, across):
    for lanes in (1, 2, 3, 4, 5):
        network = approach(lanes, across=across, left=left)
        assert blind(network, lit(network, style)) == []


@pytest.mark.slow
@pytest.mark.skipif(program("netgenerate") is None, reason="SUMO's programs are not there")
@pytest.mark.parametrize("style", ["european", "american"])
@pytest.mark.parametrize("options", NETS)
def test_so_it_is_in_networks_of_sumos_own_making(options, style, tmp_path):
    path = tmp_path / "made.net.xml"
    subprocess.run(
        [str(program("netgenerate")), *options.split(), "-o", str(path)],
        check=True,
        capture_output=True,
    )
    network = read_network(path)
    assert blind(network, lit(network, style)) == []
