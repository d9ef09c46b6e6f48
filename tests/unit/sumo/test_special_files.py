"""No reader of SUMO's files waits at a pipe or reads a device."""

import os
from pathlib import Path

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo.additional import read_additional, read_parking, read_stops
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.find import find_scenario
from sumo3dviz_pt.sumo.formats import is_log
from sumo3dviz_pt.sumo.network import network_of, read_location
from sumo3dviz_pt.sumo.signals import read_signals
from sumo3dviz_pt.sumo.types import read_vehicle_types

READERS = {
    "network": network_of,
    "location": read_location,
    "configuration": find_scenario,
    "log": lambda path: read_trajectories([path]),
    "types": lambda path: read_vehicle_types([path]),
    "signals": lambda path: read_signals([path], None),
    "objects": lambda path: read_additional([path], None),
    "stops": lambda path: read_stops([path]),
    "parking": lambda path: read_parking([path], None),
}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such paths")
@pytest.mark.parametrize("reader", READERS)
def test_every_reader_refuses_a_device(reader):
    """An empty one, so that a reader that opens it fails here and does not hang."""
    with pytest.raises(InputError, match=r"null.*: is a device and no plain file"):
        READERS[reader](Path("/dev/null"))
    assert not is_log(Path("/dev/null"))
