"""A network with a lane that goes straight up, as netconvert writes some, gets a scene file."""

from __future__ import annotations

from builders import network_xml, write_scenario

from sumo3dviz_pt.proposals.proposal import propose


def test_it_is_proposed(tmp_path):
    scene = write_scenario(tmp_path, vehicles=2)
    upright = (
        '<edge id="r" from="b" to="b"><lane id="r_0" index="0" speed="13.9" length="10"'
        ' shape="200,-4,0 200,-4,10"/></edge></net>'
    )
    network = network_xml().replace("</net>", upright)
    (tmp_path / "net.net.xml").write_text(network, encoding="utf-8")
    scene.unlink()
    text, _ = propose(tmp_path, output=scene, template="city_day")
    assert "driver:" in text
