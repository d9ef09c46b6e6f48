"""Tells on which ways through junctions rails lie."""

from __future__ import annotations

from sumo3dviz_pt.model.network import Connection, Network
from sumo3dviz_pt.world.roads.style import has_rails


def bare_ways(network: Network) -> frozenset[str]:
    """Return internal lanes without rails, though only rail vehicles may use them.

    SUMO writes a lane for every turn that a tram is allowed to make. Rails lie only where
    they lead from a track to a track, and nowhere where a tram would turn round.
    """
    railed: set[str] = set()
    bare: set[str] = set()
    following = {k.from_lane: k.via for k in network.connections if k.from_lane.startswith(":")}
    for link in network.connections:
        if not link.via or link.from_lane.startswith(":"):
            continue
        lanes = railed if _joins_tracks(network, link) else bare
        # A way may have several lanes one after the other.
        via = link.via
        while via and via not in lanes:
            lanes.add(via)
            via = following.get(via, "")
    return frozenset(bare - railed)


def _joins_tracks(network: Network, link: Connection) -> bool:
    """Whether a connection leads from a track to another."""
    ends = (network.lanes[key] for key in (link.from_lane, link.to_lane))
    return link.direction not in {"t", "T"} and all(has_rails(lane) for lane in ends)
