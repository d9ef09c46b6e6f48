"""Logs that are wrong in one way each, made from a right one, and what is said of them."""

from __future__ import annotations

import math

NET = """<net version="1.20">
<location netOffset="-4000,-2500" convBoundary="0,-100,400,200" origBoundary="0,0,1,1"
 projParameter="+proj=utm +zone=31"/>
<edge id="we" from="a" to="b"><lane id="we_0" index="0" speed="13.9" length="400" width="3.2"
 disallow="pedestrian" shape="0,30,{z} 400,30,{z}"/></edge>
<edge id="sn" from="c" to="b"><lane id="sn_0" index="0" speed="13.9" length="300" width="3.2"
 disallow="pedestrian" shape="300,-100,{z} 300,200,{z}"/></edge>
<junction id="a" type="dead_end" x="0" y="30" incLanes="" intLanes="" shape=""/>
<junction id="b" type="dead_end" x="400" y="30" incLanes="we_0" intLanes="" shape=""/>
<junction id="c" type="dead_end" x="300" y="-100" incLanes="" intLanes="" shape=""/>
<junction id="d" type="dead_end" x="300" y="200" incLanes="sn_0" intLanes="" shape=""/>
</net>"""
"""A road to the east and one to the north that cross, and share a junction, so no note is due."""

FLAT = NET.format(z=0)
STEPS = 25


def rows(step=1.0):
    """A row each: six cars to the east and six to the north, at 10 m/s."""
    found = []
    for number in range(STEPS):
        time = number * step
        for car in range(12):
            along = 12.0 * (car // 2) + 10.0 * time
            east = car % 2 == 0
            x, y = (along, 30.0) if east else (300.0, -100.0 + along)
            found.append(
                {
                    "time": time,
                    "id": f"v{car}",
                    "x": x,
                    "y": y,
                    "angle": 90.0 if east else 0.0,
                    "type": "DEFAULT_VEHTYPE",
                    "speed": 10.0,
                    "pos": along,
                    "lane": "we_0" if east else "sn_0",
                }
            )
    return found


def fcd(found):
    steps = {}
    for row in found:
        words = " ".join(f'{key}="{row[key]}"' for key in row if key != "time")
        steps.setdefault(row["time"], []).append(f"<vehicle {words}/>")
    text = "".join(f'<timestep time="{t}">{"".join(r)}</timestep>' for t, r in steps.items())
    return f"<fcd-export>{text}</fcd-export>"


def changed(**changes):
    """Rows with attributes that functions of a row give; None leaves an attribute out."""
    found = rows()
    for row in found:
        new = {key: change(row) for key, change in changes.items()}
        row.update(new)
        for key in [key for key, value in new.items() if value is None]:
            del row[key]
    return found


def no_lanes(found):
    return [{k: v for k, v in row.items() if k not in ("lane", "pos")} for row in found]


REFUSED = {
    "shifted by 25 m": (
        changed(x=lambda r: r["x"] + 25.0),
        r"typically by 25 m; the log lies 25 m east of the network; give",
    ),
    "shifted by 600 m": (
        changed(y=lambda r: r["y"] - 600.0),
        r"off|are on its roads \(the log lies 600 m south of the network\)",
    ),
    "far away": (changed(x=lambda r: r["x"] + 9e4), "the first vehicle is at"),
    "another network": (changed(lane=lambda r: "north_" + r["lane"]), 'such as "north_we_0"'),
    "x and y swapped": (
        changed(x=lambda r: r["y"], y=lambda r: r["x"]),
        "x and y seem to be swapped",
    ),
    "y counts downwards": (changed(y=lambda r: 100.0 - r["y"]), "y seems to count downwards"),
    "places in feet": (
        changed(x=lambda r: r["x"] / 0.3048, y=lambda r: r["y"] / 0.3048),
        "seem to be feet",
    ),
    "places in degrees": (
        changed(x=lambda r: 2.1 + r["x"] * 1e-5, y=lambda r: 41.3 + r["y"] * 1e-5),
        "--fcd-output.geo",
    ),
    "angles in radians": (
        changed(angle=lambda r: math.radians(r["angle"])),
        "they seem to be radians",
    ),
    "angles from east": (changed(angle=lambda r: 90.0 - r["angle"]), "counter-clockwise from east"),
    "angles backwards": (changed(angle=lambda r: r["angle"] + 180.0), "point backwards"),
    "all angles zero": (changed(angle=lambda r: 217.0), "not those of the vehicles"),
    "a mesoscopic simulation": (
        changed(edge=lambda r: r["lane"][:-2], lane=lambda _: None),
        "mesoscopic simulation",
    ),
}

NOTED = {
    "shifted by 5 m": (changed(x=lambda r: r["x"] + 5.0), "the log lies 5 m east"),
    "no lanes, shifted by 9 m": (
        no_lanes(changed(x=lambda r: r["x"] + 6.0, y=lambda r: r["y"] - 6.0)),
        "off the lanes",
    ),
    "a row every 10 s": (
        [row for row in rows(0.5) if row["time"] % 10.0 == 0.0],
        "a row every 10 s only",
    ),
    "a hole of 8 s": (
        [row for row in rows() if not 8.0 < row["time"] < 16.0],
        "a hole from 8 to 16 s, in which its 12 vehicles are not drawn",
    ),
    "speeds in km/h": (changed(speed=lambda r: 3.6 * r["speed"]), r"3\.6 times .* km/h"),
    "times in milliseconds": (changed(time=lambda r: 1000.0 * r["time"]), "milliseconds"),
    "ids mixed up": (
        changed(id=lambda r: f"v{(int(r['id'][1:]) * 5 + int(r['time']) * 7) % 12}"),
        "faster than 100 m/s",
    ),
    "one row 39 km away": (
        changed(x=lambda r: r["x"] - 39_000.0 * ((r["id"], r["time"]) == ("v4", 6.0))),
        r'a row lies far .*: vehicle "v4" at 6 s, 38,990 m away, .* not drawn from 5 to 7 s',
    ),
    "the first row 39 km away": (
        changed(x=lambda r: r["x"] - 39_000.0 * ((r["id"], r["time"]) == ("v4", 0.0))),
        r'a row lies far .*: vehicle "v4" at 0 s, 39,010 m away, .* not drawn from 0 to 1 s',
    ),
    "the last row 39 km away": (
        changed(x=lambda r: r["x"] - 39_000.0 * ((r["id"], r["time"]) == ("v4", 24.0))),
        r'a row lies far .*: vehicle "v4" at 24 s, 38,990 m away, .* not drawn from 23 to 24 s',
    ),
    "three rows astray": (
        changed(y=lambda r: r["y"] + 2000.0 * ((r["id"], r["time"] % 9) == ("v2", 6.0))),
        '3 rows lie far .*: first vehicle "v2" at 6 s',
    ),
    "heights from another zero": (changed(z=lambda _: 47.0), "47 m above their lanes"),
}
