"""Damaged files of SUMO are never passed over in silence."""

import gzip
import logging

import pytest

from sumo3dviz_pt.sumo import find_scenario

NET = '<net><edge id="a"><lane id="a_0" shape="0,0 100,0"/></edge></net>'
ROW = '<vehicle id="v" x="1" y="0" angle="90"/>'
LOG = f'<fcd-export><timestep time="0">{ROW}</timestep></fcd-export>'


def found_with(folder, name, data):
    (folder / "n.net.xml").write_text(NET, encoding="utf-8")
    (folder / "fcd.xml").write_text(LOG, encoding="utf-8")
    (folder / name).write_bytes(data)
    return find_scenario(folder)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ('<additional><poi id="a" x="1" y="2"></additional>', "objects or vehicle types"),
        ('<!-- <net> --><additional><poi id="a" x="1"" y="2"/></additional>', "objects or"),
        ('<routes>\n<vType id="a" vClass=bus/></routes>', "vehicle types"),
        ('<tlsStates><tlsState time="0" id="m" & /></tlsStates>', "a signal log"),
    ],
)
@pytest.mark.parametrize("packed", [False, True])
def test_small_damaged_files_are_named(text, what, packed, tmp_path, caplog):
    data = gzip.compress(text.encode()) if packed else text.encode()
    with caplog.at_level(logging.WARNING):
        files = found_with(tmp_path, "odd.xml", data)
    (said,) = caplog.messages
    assert "odd.xml:" in said and "not well-formed XML" in said
    assert f"it seems to hold {what}" in said and "is left out" in said
    assert not (files.additional or files.vehicle_types or files.signals)


@pytest.mark.parametrize(
    "text", ["<html><p>hello</html>", "<?xml", "<additional/>", "<< EOF", "< net >"]
)
def test_other_files_are_not_mentioned(text, tmp_path, caplog):
    with caplog.at_level(logging.WARNING):
        found_with(tmp_path, "odd.xml", text.encode())
    assert not caplog.records
