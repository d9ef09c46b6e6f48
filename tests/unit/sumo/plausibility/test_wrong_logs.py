"""Wrong logs and networks are refused or noted, in one sentence that says what to do."""

import logging
import re

import pytest
from wrong_logs import FLAT, NET, NOTED, REFUSED, changed, fcd, no_lanes, rows

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import LogChoices
from sumo3dviz_pt.sumo import find_scenario, read_scenario


def read(folder, found, *, net=FLAT, misfit=False, **window):
    (folder / "n.net.xml").write_text(net, encoding="utf-8")
    (folder / "fcd.xml").write_text(fcd(found), encoding="utf-8")
    return read_scenario(find_scenario(folder), choices=LogChoices(allow_misfit=misfit), **window)


def test_the_right_log_says_nothing(tmp_path, caplog):
    with caplog.at_level(logging.WARNING):
        assert len(read(tmp_path, rows()).traffic.traces) == 12
        read(tmp_path, no_lanes(rows()))
        read(tmp_path, rows(0.1))
        read(tmp_path, rows(), begin=3.0, end=5.0)
    assert not caplog.records


@pytest.mark.parametrize("kind", REFUSED)
def test_hopeless_logs_are_refused_unless_allowed(kind, tmp_path, caplog):
    found, words = REFUSED[kind]
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, found)
    assert "allow_misfit" in str(caught.value) and "fcd.xml" in str(caught.value)
    with caplog.at_level(logging.WARNING):
        assert len(read(tmp_path, found, misfit=True).traffic.traces) == 12
    assert caplog.records


@pytest.mark.parametrize("kind", NOTED)
def test_odd_logs_are_noted(kind, tmp_path, caplog):
    found, words = NOTED[kind]
    with caplog.at_level(logging.WARNING):
        read(tmp_path, found)
    (said,) = caplog.messages
    assert re.search(words, said) and "fcd.xml" in said


def test_a_network_of_another_height_is_noted(tmp_path, caplog):
    found = changed(z=lambda _: 5.0)
    with caplog.at_level(logging.WARNING):
        read(tmp_path, found, net=NET.format(z=12))
    assert "7 m below their lanes" in caplog.text


@pytest.mark.parametrize(
    ("way", "words"), [(-1, "netOffset seems to be missing"), (1, "netOffset seems to be added")]
)
@pytest.mark.parametrize("box", ['convBoundary="0,-100,400,200"', ""])
def test_a_small_offset_that_is_wrong_is_told(way, words, box, tmp_path):
    """Large ones are undone where the network has a box, as `--fcd-output.utm` leaves them out."""
    net = FLAT.replace("-4000,-2500", "-400,-250").replace('convBoundary="0,-100,400,200"', box)
    found = changed(x=lambda r: r["x"] - 400.0 * way, y=lambda r: r["y"] - 250.0 * way)
    with pytest.raises(InputError, match=words):
        read(tmp_path, found, net=net)


def test_windows_are_never_refused(tmp_path, caplog):
    found, _ = REFUSED["angles in radians"]
    with caplog.at_level(logging.WARNING):
        read(tmp_path, found, begin=3.0, end=20.0)
    assert "radians" in caplog.text


def test_a_teleport_is_no_row_astray(tmp_path, caplog):
    """SUMO moves a vehicle that is stuck to another edge; it does not come back from there."""
    found = changed(x=lambda r: r["x"] + 300.0 * (r["id"] == "v0" and r["time"] > 4.0))
    with caplog.at_level(logging.WARNING):
        read(tmp_path, found)
    assert "far from the rows" not in caplog.text


def test_nothing_is_guessed_of_places_that_fit(tmp_path):
    """A log of renamed lanes on a network that is the same with x and y swapped."""
    net = FLAT.replace("0,30,0 400,30,0", "0,300,0 400,300,0").replace("300,-100,0", "300,0,0")
    net = net.replace("300,200,0", "300,400,0")
    found = changed(
        x=lambda r: r["x"],
        y=lambda r: 300.0 if r["lane"] == "we_0" else r["y"] + 100.0,
        lane=lambda r: "old_" + r["lane"],
    )
    with pytest.raises(InputError, match=r'lanes that it does not have, such as "old_\w+"; use'):
        read(tmp_path, found, net=net)


def test_a_unit_is_not_guessed_where_it_puts_everybody_on_one_spot(tmp_path):
    """Places off the roads, whose hundredth part lies where a road begins."""
    net = FLAT.replace("0,30,0 400,30,0", "0,0,0 400,0,0")
    found = no_lanes(changed(x=lambda r: r["x"] + 60.0, y=lambda r: r["y"] + 60.0))
    with pytest.raises(InputError) as caught:
        read(tmp_path, found, net=net)
    assert "centimetres" not in str(caught.value) and "on its roads" in str(caught.value)
