"""Drawn signals against real logs: radiance of every link at every logged time."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from builders import aspect_at

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.sumo import read_network, read_signals
from sumo3dviz_pt.world.placement.lanes import build_lane_index
from sumo3dviz_pt.world.signals.signals import build_signals

ROOT = Path(__file__).parents[2]
DATA, EXAMPLES = ROOT.parent / "shared" / "data", ROOT / "examples"
BUNDLED = ["crossing", "ronda"]
SHARED = ["doerpfeldstr", "bologna_acosta", "badhersfeld", "barcelona"]
absent = pytest.mark.skipif(not DATA.is_dir(), reason="the shared scenarios are not here")
NAMES = [*BUNDLED, *(pytest.param(name, marks=[absent, pytest.mark.slow]) for name in SHARED)]
SHOWN = {
    "r": "red",
    "s": "red",
    "u": "red yellow",
    "y": "yellow",
    "Y": "yellow",
    "g": "green",
    "G": "green",
    "O": "",
}
WALKED = {**SHOWN, "u": "red", "y": "red", "Y": "red"}


@cache
def loaded(name):
    files = [DATA / name / "net.net.xml.gz", DATA / name / "tls_states.xml.gz"]
    if name in BUNDLED:
        files = [EXAMPLES / name / f"{name}.net.xml.gz", EXAMPLES / name / "signals.xml.gz"]
    return read_network(files[0]), read_signals(files[1:])


def lamps_of(signals):
    """Lamp rows of each (tls, link): a list of {colour: row} per head."""
    rows, found = 0, {}
    names = signals.lamps[0].lamps
    for head in signals.heads:
        lamps = {names[rows + i].split("/")[-1]: rows + i for i in range(head.lamps)}
        for link in head.links:
            found.setdefault((head.tls, link), []).append((head.lamps, lamps))
        rows += head.lamps
    return found


def expected_links(network):
    """Links with a signal; level crossings have barriers."""
    rail = {key for key, node in network.junctions.items() if node.type == "rail_crossing"}
    links = {(c.tls, c.link_index) for c in network.connections if c.tls and c.link_index >= 0}
    return {(tls, number) for tls, number in links if tls not in rail}


@pytest.mark.parametrize("name", NAMES)
def test_every_signalled_link_has_a_head(name):
    network, phases = loaded(name)
    signals = build_signals(network, phases, SignalSettings())
    expected = expected_links(network)
    assert set(lamps_of(signals) if expected else ()) == expected
    assert bool(signals.left_out) != bool(expected)


@pytest.mark.parametrize("name", NAMES)
def test_radiance_equals_the_log_at_every_step(name):
    network, phases = loaded(name)
    if not expected_links(network):
        pytest.skip("it has level crossings only")
    signals = build_signals(network, phases, SignalSettings(yellow="log"))
    lamps = lamps_of(signals)
    times = sorted({t for entry in phases.values() for t in entry.times})
    compared = 0
    for time in np.array(times) + 0.37:
        lit = signals.radiance_at(float(time))["signals"].any(axis=1)
        states = {tls: entry.state_at(float(time)) for tls, entry in phases.items()}
        for (tls, link), heads in lamps.items():
            for count, rows in heads:
                table = SHOWN if count == 3 else WALKED
                wanted = set(table[states[tls][link]].split()) if states[tls] else set()
                assert {colour for colour, row in rows.items() if lit[row]} == wanted
                compared += 1
    assert compared > 0


@pytest.mark.parametrize("name", NAMES)
def test_interpolated_yellow_only_where_the_log_has_none(name):
    network, phases = loaded(name)
    signals = build_signals(network, phases, SignalSettings())
    logged = build_signals(network, phases, SignalSettings(yellow="log"))
    for tls, link in expected_links(network):
        letters = {state[link] for state in phases[tls].states}
        if letters & set("yYu") or "r" not in letters:
            times = phases[tls].times[:: max(len(phases[tls].times) // 50, 1)]
            for time in times:
                assert aspect_at(signals, tls, link, time) == aspect_at(logged, tls, link, time)


@pytest.mark.parametrize("name", NAMES)
def test_poles_stand_on_no_carriageway(name):
    network, phases = loaded(name)
    signals = build_signals(network, phases, SignalSettings())
    feet = np.array([h.position[:2] for h in signals.heads if h.position[2] < 4.0]).reshape(-1, 2)
    on_road = build_lane_index(network).covers(feet, margin=0.0)
    assert on_road.sum() <= 0.04 * len(
        on_road
    )  # islands of joined junctions are narrower than a pole
