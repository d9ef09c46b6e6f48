"""SUMO's files become values of the model; SUMO's conventions end here."""

from __future__ import annotations

from sumo3dviz_pt.sumo.additional import read_additional, read_stops
from sumo3dviz_pt.sumo.fcd import Whereabouts, read_roster, read_trajectories, whereabouts
from sumo3dviz_pt.sumo.find import find_scenario
from sumo3dviz_pt.sumo.guesses import with_use
from sumo3dviz_pt.sumo.network import read_location, read_network
from sumo3dviz_pt.sumo.scenario import read_scenario
from sumo3dviz_pt.sumo.signals import read_signals
from sumo3dviz_pt.sumo.types import default_vehicle_type, read_vehicle_types

__all__ = [
    "Whereabouts",
    "default_vehicle_type",
    "find_scenario",
    "read_additional",
    "read_location",
    "read_network",
    "read_roster",
    "read_scenario",
    "read_signals",
    "read_stops",
    "read_trajectories",
    "read_vehicle_types",
    "whereabouts",
    "with_use",
]
