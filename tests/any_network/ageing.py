"""Networks as older versions of SUMO wrote them: attributes that came later are taken away."""

from __future__ import annotations

import xml.etree.ElementTree as ET

_LATER = {
    "edge": ("type", "spreadType", "name"),
    "lane": ("acceleration", "changeLeft", "changeRight", "friction"),
    "connection": ("uncontrolled", "visibility", "contPos", "keepClear"),
    "junction": ("customShape", "fringe", "radius", "rightOfWay"),
    "location": (),
}
"""Attributes that the file of SUMO 0.27 has not, by element."""


def aged(text: str, *, bare: bool) -> str:
    """Return a network without attributes that came after SUMO 0.27.

    Args:
        text: The network's XML.
        bare: Whether to leave out, too, what readers can do without: version, place on the
            Earth, directions and states of connections, types and priorities.
    """
    root = ET.fromstring(text)
    root.attrib = {} if bare else {"version": "0.27"}
    for element in root.iter():
        for name in _LATER.get(element.tag, ()):
            element.attrib.pop(name, None)
        if bare and element.tag == "connection":
            element.attrib.pop("dir", None)
            element.attrib.pop("state", None)
        if bare and element.tag == "edge":
            element.attrib.pop("priority", None)
    if bare:
        for element in root.findall("location") + root.findall("type"):
            root.remove(element)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode")
