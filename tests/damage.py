"""A small scenario that has something of everything, and seeded damage to its files.

A case is a kind and a number; the same case is the same damage everywhere and for ever.
"""

from __future__ import annotations

import datetime as dt
import re
import struct
from collections.abc import Callable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np

# The scenario ------------------------------------------------------------------------------

NETWORK = """<net version="1.20" lefthand="false">
<location netOffset="-430000.00,-4580000.00" convBoundary="-120.00,-60.00,120.00,60.00"
 origBoundary="2.16,41.36,2.20,41.38" projParameter="+proj=utm +zone=31 +ellps=WGS84"/>
<type id="city" priority="3" numLanes="1" speed="13.89"/>
<edge id=":m_0" function="internal">
<lane id=":m_0_0" index="0" disallow="pedestrian" speed="13.89" length="10.00"
 shape="-5.00,-1.60 5.00,-1.60"/></edge>
<edge id=":m_1" function="internal">
<lane id=":m_1_0" index="0" speed="6.00" length="7.00" shape="-5.00,-1.60 0.00,-3.00 1.60,-6.00"/>
</edge>
<edge id=":m_c0" function="crossing" crossingEdges="e">
<lane id=":m_c0_0" index="0" allow="pedestrian" speed="2.78" length="6.40" width="4.00"
 shape="8.00,3.20 8.00,-3.20"/></edge>
<edge id=":m_w0" function="walkingarea">
<lane id=":m_w0_0" index="0" allow="pedestrian" speed="2.78" length="4.00" width="2.00"
 shape="6.00,3.20 10.00,3.20 10.00,5.20 6.00,5.20"/></edge>
<edge id="w" from="a" to="m" priority="3" type="city" name="West">
<lane id="w_0" index="0" allow="pedestrian" speed="2.78" length="115.00" width="2.00"
 shape="-120.00,-4.20 -5.00,-4.20"/>
<lane id="w_1" index="1" disallow="pedestrian" speed="13.89" length="115.00" width="3.20"
 shape="-120.00,-1.60 -5.00,-1.60"/></edge>
<edge id="e" from="m" to="b" priority="3" type="city">
<lane id="e_0" index="0" disallow="pedestrian" speed="13.89" length="115.00" width="3.20"
 shape="5.00,-1.60,0.00 60.00,-1.60,0.50 120.00,-1.60,1.00"/></edge>
<edge id="s" from="m" to="c" priority="2" type="city" shape="0.00,0.00 0.00,-60.00">
<lane id="s_0" index="0" disallow="pedestrian" speed="8.33" length="54.00" width="3.20"
 shape="1.60,-6.00 1.60,-60.00"/></edge>
<tlLogic id="m" type="static" programID="0" offset="0">
<phase duration="6" state="GG"/><phase duration="6" state="rr"/></tlLogic>
<junction id="a" type="dead_end" x="-120.00" y="0.00" incLanes="" intLanes=""
 shape="-120.00,0.00 -120.00,-5.20"/>
<junction id="m" type="traffic_light" x="0.00" y="0.00" incLanes="w_0 w_1" intLanes=":m_0_0 :m_1_0"
 shape="-5.00,0.00 5.00,0.00 5.00,-3.20 3.20,-6.00 0.00,-6.00 -5.00,-5.20"/>
<junction id="b" type="dead_end" x="120.00" y="0.00" z="1.00" incLanes="e_0" intLanes=""
 shape="120.00,-3.20 120.00,0.00"/>
<junction id="c" type="dead_end" x="0.00" y="-60.00" incLanes="s_0" intLanes=""
 shape="0.00,-60.00 3.20,-60.00"/>
<connection from="w" to="e" fromLane="1" toLane="0" via=":m_0_0" tl="m" linkIndex="0" dir="s"
 state="o"/>
<connection from="w" to="s" fromLane="1" toLane="0" via=":m_1_0" tl="m" linkIndex="1" dir="r"
 state="o"/>
<connection from=":m_0" to="e" fromLane="0" toLane="0" dir="s" state="M"/>
<connection from=":m_1" to="s" fromLane="0" toLane="0" dir="r" state="M"/>
<connection from=":m_w0" to=":m_c0" fromLane="0" toLane="0" dir="s" state="M"/>
</net>
"""

OBJECTS = """<additional>
<poi id="t0" type="tree" color="0,128,0" layer="1" x="-20.00" y="12.00" angle="30"/>
<poi id="h0" type="home" x="25.00" y="-22.00" angle="90"><param key="height" value="7"/></poi>
<poi id="b0" type="block" x="-30.00" y="30.00"/>
<poi id="p0" type="bench" x="12.00" y="4.60" angle="180"/>
<poi id="l0" type="tree" lane="w_1" pos="10"/>
<poly id="g0" type="building" color="#aabbcc" fill="true" layer="-1" height="9"
 shape="-60.00,10.00 -45.00,10.00 -45.00,22.00 -60.00,22.00"><param key="height" value="9"/></poly>
<poly id="f0" type="fence" color="red" fill="0" shape="10.00,-8.00 40.00,-8.00 40.00,-20.00"/>
<poly id="k0" type="hedge" fill="0" shape="-40.00,4.00 -20.00,4.00"/>
<poly id="q0" type="building" geo="true" shape="2.16,41.36 2.17,41.37 2.17,41.36"/>
<busStop id="stop" lane="e_0" startPos="20" endPos="-60" lines="7 8"/>
</additional>
"""

TYPES = """<routes>
<vTypeDistribution id="mix">
<vType id="car" vClass="passenger" length="4.6" width="1.8" height="1.5" color="200,10,10"
 guiShape="passenger/sedan" probability="0.5"/></vTypeDistribution>
<vType id="own" vClass="passenger" length="4.2" maxSpeed="50"/>
<vType id="tram" vClass="tram" length="30" width="2.4" guiShape="rail/railcar"
 locomotiveLength="10" carriageLength="9.5" carriageGap="0.5"><param key="a" value="b"/></vType>
<vType id="DEFAULT_PEDTYPE" vClass="pedestrian" width="0.5" length="0.3"/>
<vehicle id="c0" type="car" depart="0"/>
</routes>
"""

SIGNALS = """<tlsStates>
<tlsState time="0.00" id="m" programID="0" phase="0" state="GG"/>
<tlsState time="6.00" id="m" programID="0" phase="1" state="rr"/>
<tlsState time="7.00" id="m" programID="1" phase="0" state="ry"/>
</tlsStates>
"""

CONFIGURATION = """<configuration>
<input><net-file value="net.net.xml"/><additional-files value="objects.add.xml, types.rou.xml"/>
</input>
<output><fcd-output value="fcd.xml"/></output><time><begin value="0"/></time>
</configuration>
"""

SCENE = """# everything that a scene can say
scenario:
  network: net.net.xml
  trajectories: [fcd.xml]
  signals: tls.xml
  additional: objects.add.xml
  vehicle_types: [types.rou.xml]
template: abstract
seed: 3
quality: draft
sky: {preset: sky_blue, sun: {date: 2026-06-21, time: "17:30", place: [41.4, 2.2]}, turbidity: 3}
ground: {texture: ground_grass, scale: 1.0, horizon: flat, planting: none}
roads: &roads
  surface: asphalt
  marking_style: european
  lane_width: from_network
  line_width: 0.12
  per_edge: {"w*": {surface: concrete, lane_width: 3.0, colour: "#445566"}}
vehicles:
  passenger: [hatchback]
  models: {tram: [], pedestrian: [woman_sport]}
  colours: ["#aa1111", "#11aa11"]
  user_models: {own: own.yaml}
objects: {trees: {scale: 0.8, variation: 0.1}, homes: null, hedges: {colour: "#224422"}}
signals: {show: true, design: countdown, yellow: auto, yellow_time: 3}
street: {fronts: none, lamps: none, signs: auto, furniture: none}
motion: {smoother: lane, heading: chord, suspension: true}
lights: auto
cameras:
  post:
    mode: eulerian
    position: [30, -22, 6]
    look_at: [5, -3, 0]
    lens: {fov: 60}
  driver: {mode: lagrangian, vehicle: c0, view: driver, eye_height: 1.2}
  flight:
    mode: cinematic
    keyframes:
      - {time: 4, position: [20, -20, 8], heading: 300, pitch: -10}
      - {time: 6, position: [-20, -20, 8], look_at: [0, 0, 0], fov: 40, roll: 2}
shots:
  - {camera: post, from: 4, to: 4.5}
output: {size: [64, 36], fps: 10, codec: h264, exposure: 0.5, tone: neutral, glare: 0.1, half: true}
textured: false
"""

OWN_CAR = """mesh: own.obj
forward: +x
up: +z
scale: fit
materials: {body: paint, "rim*": {colour: "#aab0b4", roughness: 0.3, metallic: 1.0}}
lamps: [{role: head, at: [0.0, 0.6, 0.7], size: [0.2, 0.1], yaw: 0}]
"""


def log_text(*, people: bool = False) -> str:
    """Thirteen steps of two cars, a tram and a container, perhaps a walker and a rider."""
    rows = []
    for time in range(13):
        x = -60.0 + 9.0 * time
        lane = "w_1" if x < -5 else ":m_0_0" if x < 5 else "e_0"
        way = f'y="-1.60" angle="90.00" speed="9.00" pos="{max(x + 120, 0):.2f}" slope="0.00"'
        rows.append(
            f'<timestep time="{time}.00">\n'
            f'<vehicle id="c0" x="{x:.2f}" {way} type="car" lane="{lane}" signals="8"/>\n'
            f'<vehicle id="c1" x="{x - 15:.2f}" {way} type="own" lane="w_1" signals="1"/>\n'
            f'<vehicle id="t0" x="{x - 26:.2f}" {way} type="tram" lane="w_1"/>\n'
            + people
            * (
                f'<person id="p0" x="{time:.2f}" y="4.00" angle="90.00" speed="1.00" edge=":m_w0"'
                f' type="DEFAULT_PEDTYPE"/>\n'
                f'<person id="p1" x="{x:.2f}" {way} edge="w" vehicle="c0" stage="driving"/>\n'
            )
            + '<container id="k0" x="40.00" y="-4.00" angle="0.00" speed="0.00" edge="e"/>\n'
            "</timestep>"
        )
    return "<fcd-export>\n" + "\n".join(rows) + "\n</fcd-export>\n"


def write_town(folder: Path) -> Path:
    """Write the scenario; returns its scene file."""
    texts = {
        "net.net.xml": NETWORK,
        "fcd.xml": log_text(),
        "tls.xml": SIGNALS,
        "objects.add.xml": OBJECTS,
        "types.rou.xml": TYPES,
        "town.sumocfg": CONFIGURATION,
        "scene.yaml": SCENE,
        "own.yaml": OWN_CAR,
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    for name, data in models().items():
        (folder / name).write_bytes(data)
    return folder / "scene.yaml"


# Models and pictures -----------------------------------------------------------------------

_CORNERS = np.array(
    [[x, y, z] for z in (0.0, 1.4) for y in (-0.9, 0.9) for x in (-4.2, 0.0)], dtype="<f4"
)
_FACES = np.array(
    [
        *([0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]),
        *([2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]),
    ],
    dtype="<u2",
)


def models() -> dict[str, bytes]:
    """One box in four formats."""
    lines = ["mtllib own.mtl", "o body", "usemtl paint"]
    lines += [f"v {x:g} {y:g} {z:g}" for x, y, z in _CORNERS.tolist()]
    lines += ["vt 0 0", "vn 0 0 1"]
    lines += [f"f {a + 1}/1/1 {b + 1}/1/1 {c + 1}/1/1" for a, b, c in _FACES.tolist()]
    head = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
    head += (
        "property float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = [f"{x:g} {y:g} {z:g}" for x, y, z in _CORNERS.tolist()]
    body += [f"3 {a} {b} {c}" for a, b, c in _FACES.tolist()]
    triangles = b"".join(
        struct.pack("<12fH", 0, 0, 1, *_CORNERS[face].ravel().tolist(), 0) for face in _FACES
    )
    return {
        "own.obj": ("\n".join(lines) + "\n").encode(),
        "own.mtl": b"newmtl paint\nKd 0.8 0.1 0.1\nmap_Kd skin.png\n",
        "own.ply": (head + "\n".join(body) + "\n").encode(),
        "own.stl": b"\0" * 80 + struct.pack("<I", len(_FACES)) + triangles,
        "own.glb": _glb(),
        "skin.png": _png(),
        "sky.hdr": _hdr(),
        "sky.exr": _exr(),
    }


def _glb() -> bytes:
    """The box as binary glTF, with a material that has a picture."""
    picture = _png()
    vertices, faces = _CORNERS.tobytes(), _FACES.astype("<u2").tobytes()
    binary = vertices + faces + picture
    binary += b"\0" * (-len(binary) % 4)
    text = (
        '{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],'
        ' "nodes": [{"mesh": 0, "name": "body", "scale": [1, 1, 1]}],'
        ' "meshes": [{"name": "body", "primitives": [{"attributes": {"POSITION": 0},'
        ' "indices": 1, "material": 0}]}],'
        ' "materials": [{"name": "paint", "pbrMetallicRoughness":'
        ' {"baseColorFactor": [0.8, 0.1, 0.1, 1.0], "metallicFactor": 0.1,'
        ' "roughnessFactor": 0.4, "baseColorTexture": {"index": 0}}}],'
        ' "textures": [{"source": 0}], "images": [{"bufferView": 2, "mimeType": "image/png"}],'
        ' "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",'
        ' "min": [-4.2, -0.9, 0], "max": [0, 0.9, 1.4]},'
        ' {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],'
        f' "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": {len(vertices)}}},'
        f' {{"buffer": 0, "byteOffset": {len(vertices)}, "byteLength": {len(faces)}}},'
        f' {{"buffer": 0, "byteOffset": {len(vertices) + len(faces)},'
        f' "byteLength": {len(picture)}}}], "buffers": [{{"byteLength": {len(binary)}}}]}}'
    ).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _png() -> bytes:
    """A picture of 8 x 8 pixels."""
    from sumo3dviz_pt.image.png import encoded

    return encoded(np.arange(192, dtype=np.uint8).reshape(8, 8, 3))


def _hdr() -> bytes:
    """A radiance map of 16 x 8 pixels, run-length coded."""
    row = bytes([2, 2, 0, 16])
    for value in (90, 120, 150, 129):
        row += bytes([128 + 8, value, 8, *[value + n for n in range(8)]])
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + row * 8


def _exr() -> bytes:
    """A radiance map of 16 x 8 pixels."""
    import tempfile

    from sumo3dviz_pt.image.exr import write_exr

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.exr"
        write_exr(path, {"radiance": np.full((8, 16, 3), 0.5, dtype=np.float32)})
        return path.read_bytes()


# Damage ------------------------------------------------------------------------------------

Chance = np.random.Generator

NUMBERS = (
    *("nan", "inf", "-inf", "1e300", "-1e300", "1e12", "1e-300", "-1", "0", "1e6", "-1e6", "1e9"),
    *("9" * 5000, "9" * 400, "2147483648", "-2147483649", "18446744073709551616", "0.0", "-0.0"),
    *("abc", "", "0x10", "1_000", "1,5", "٣", "1e", "--1", "true", "1 2", "1;2", "5e-324"),
)
"""What a number in a file may turn into."""

WORDS = (
    *("", " ", "null", "none", "*", "??", "[", "a b", "é", "名前", "../../x", "C:\\x", "x" * 3000),
    *("-", "_", ":", "#", "%s", "{}", "\t", "'", "&amp;", "&lt;", "all", "..", "/", "0"),
)
"""What a word in a file may turn into."""

YAML_BITS = (
    *("!!int abc", "!!float x", "!!bool x", "!!null x", "!!timestamp x", "!!binary x", "!!set {a}"),
    *("!!python/object:os.system x", "!x y", "*none", "*roads", "&roads", "<<: *roads", "? a", "|"),
    *(">", "- - - -", "[[[[[[[[", "]", "{", "}", "{a: b", "[1, 2", "a: b: c", "\t", "%YAML 9.9"),
    *("---", "...", "@", "`", "'", '"', "null", "~", "[]", "{}", ".nan", ".inf", "12:30", "0o17"),
    *("21.06.2026", "2026-13-45", "25:99", "[500, 500]", "3", "1e12", "1e6", "true", "on", "1e300"),
    *("!!map []", "!!seq {}", "!!str [a]", "!!omap [a]", "!!pairs [a]", "<<", "<<: 3", "=", "!"),
)
"""What a value in YAML may turn into."""

_NUMBER = re.compile(r"(?<![\w.#])-?\d+(?:\.\d+)?(?![\w.])")
_ATTRIBUTE = re.compile(r'\s([\w:-]+)="([^"]*)"')
_TAG = re.compile(r"<[^>!?]+>")
_VALUE = re.compile(r"(?<=: )[^\n{}\[\],]+|(?<=[\[,] )[^\n{}\[\],]+")


def damaged_xml(text: str, rng: Chance) -> bytes:
    """XML with one to three pieces of damage, or torn bytes."""
    if rng.random() < 0.08:
        return damaged_bytes(text.encode(), rng)
    for _ in range(int(rng.integers(1, 4))):
        text = _XML_WAYS[int(rng.integers(len(_XML_WAYS)))](text, rng)
    return text.encode("utf-8", errors="surrogatepass")


def damaged_yaml(text: str, rng: Chance) -> bytes:
    """YAML with one or two pieces of damage, or torn bytes."""
    if rng.random() < 0.06:
        return damaged_bytes(text.encode(), rng)
    for _ in range(int(rng.integers(1, 3))):
        text = _YAML_WAYS[int(rng.integers(len(_YAML_WAYS)))](text, rng)
    return text.encode("utf-8", errors="surrogatepass")


def damaged_bytes(data: bytes, rng: Chance) -> bytes:
    """Bytes cut off, flipped, moved, doubled, or with extreme lengths and numbers in them."""
    way, at = int(rng.integers(7)), int(rng.integers(max(len(data), 1)))
    if way == 0:
        return data[:at]
    if way == 1:
        part = bytearray(data)
        for place in rng.integers(max(len(part), 1), size=int(rng.integers(1, 9))):
            part[place] ^= int(rng.integers(1, 256))
        return bytes(part)
    if way == 2:
        return data[:at] + data[at + int(rng.integers(1, 64)) :]
    if way == 3:
        return data[:at] + rng.integers(256, size=int(rng.integers(1, 40))).astype("u1").tobytes()
    if way == 4:
        return data[:at] + data[max(at - 100, 0) : at] + data[at:]
    formats = ("<I", ">I", "<i", "<f", "<d", "<H")
    extremes = (2**31 - 1, 2**31, 2**32 - 1, 0, 1, 2**24, float("nan"), float("inf"), 1e30, -1.0)
    value = extremes[int(rng.integers(len(extremes)))]
    form = formats[int(rng.integers(len(formats)))]
    try:
        packed = struct.pack(form, value if form[1] in "fd" else int(value))
    except (struct.error, ValueError, OverflowError):
        packed = b"\xff" * struct.calcsize(form)
    at -= at % 2
    return data[:at] + packed + data[at + len(packed) :]


def _chosen(found: list[re.Match[str]], rng: Chance) -> re.Match[str] | None:
    return found[int(rng.integers(len(found)))] if found else None


def _put(text: str, match: re.Match[str], new: str, group: int = 0) -> str:
    return text[: match.start(group)] + new + text[match.end(group) :]


def _any(values: tuple[str, ...], rng: Chance) -> str:
    return values[int(rng.integers(len(values)))]


def _number(text: str, rng: Chance) -> str:
    match = _chosen(list(_NUMBER.finditer(text)), rng)
    return text if match is None else _put(text, match, _any(NUMBERS, rng))


def _shifted_number(text: str, rng: Chance) -> str:
    match = _chosen(list(_NUMBER.finditer(text)), rng)
    if match is None:
        return text
    factors = (-1.0, 0.0, 10.0, 1000.0, 0.001, 1e5)
    changed = float(match[0]) * factors[int(rng.integers(len(factors)))]
    return _put(text, match, f"{changed:g}")


def _attribute(text: str, rng: Chance) -> str:
    """Take an attribute away, give it another's value, a number or a word."""
    found = list(_ATTRIBUTE.finditer(text))
    match, other = _chosen(found, rng), _chosen(found, rng)
    if match is None or other is None:
        return text
    way = int(rng.integers(5))
    if way == 0:
        return _put(text, match, "")
    new = (other[2], _any(NUMBERS, rng), _any(WORDS, rng), match[2] * 2)[way - 1]
    return _put(text, match, new.replace("<", "&lt;").replace('"', "&quot;"), 2)


def _element(text: str, rng: Chance) -> str:
    """Take a tag away, double it, move it, or break it."""
    found = list(_TAG.finditer(text))
    match, other = _chosen(found, rng), _chosen(found, rng)
    if match is None or other is None:
        return text
    ways = (
        lambda: _put(text, match, ""),
        lambda: _put(text, match, match[0] * 2),
        lambda: _put(text, match, other[0]),
        lambda: _put(text, match, other[0] + match[0]),
        lambda: _put(text, match, match[0].replace("/>", ">")),
        lambda: _put(text, match, re.sub(r"^<(/?)\w+", r"<\1odd", match[0])),
    )
    return ways[int(rng.integers(len(ways)))]()


def _points(text: str, rng: Chance) -> str:
    """Give a shape other points: many, none, one, all the same, crossing each other."""
    found = [match for match in _ATTRIBUTE.finditer(text) if "shape" in match[1].lower()]
    match = _chosen(found, rng)
    if match is None:
        return _number(text, rng)
    counts = (0, 1, 2, 3, 4, 12, 100, 3000)
    points = rng.uniform(-150, 150, size=(counts[int(rng.integers(len(counts)))], 2))
    if rng.random() < 0.3:
        points = np.round(points / 100) * 100
    return _put(text, match, " ".join(f"{x:.2f},{y:.2f}" for x, y in points), 2)


def _line(text: str, rng: Chance) -> str:
    """Take a line away, double it, move it, indent it."""
    lines = text.split("\n")
    at, to = (int(k) for k in rng.integers(len(lines), size=2))
    way = int(rng.integers(4))
    if way == 0:
        del lines[at]
    elif way == 1:
        lines.insert(to, lines[at])
    elif way == 2:
        lines[at] = " " * int(rng.integers(1, 5)) + lines[at]
    else:
        lines[at] = lines[at].strip()
    return "\n".join(lines)


def _value(text: str, rng: Chance) -> str:
    """Another value for a key."""
    found = list(_VALUE.finditer(text))
    match, other = _chosen(found, rng), _chosen(found, rng)
    if match is None or other is None:
        return text
    new = (_any(YAML_BITS, rng), _any(NUMBERS, rng), _any(WORDS, rng), other[0])
    return _put(text, match, new[int(rng.integers(4))])


def _inserted(text: str, rng: Chance) -> str:
    """Something odd anywhere."""
    at = int(rng.integers(len(text) + 1))
    odd = (*YAML_BITS, "\0", "\ufeff", "\u2028", "\ud800", "\x1b", "  ", "\n", "a" * 5000)
    return text[:at] + _any(odd, rng) + text[at:]


def _key(text: str, rng: Chance) -> str:
    """A key that is misspelt, a number, or another one."""
    found = list(re.finditer(r"[\w*]+(?=:)", text))
    match, other = _chosen(found, rng), _chosen(found, rng)
    if match is None or other is None:
        return text
    new = (other[0], match[0][:-1], "1", "null", "[a, b]", "? [1]", _any(WORDS, rng))
    return _put(text, match, new[int(rng.integers(len(new)))])


_XML_WAYS = (_number, _number, _shifted_number, _attribute, _attribute, _element, _points)
_YAML_WAYS = (_number, _shifted_number, _value, _value, _line, _inserted, _key)


# Cases -------------------------------------------------------------------------------------


def _swap(scene: Path, old: str, new: str) -> None:
    """Change the scene file by hand."""
    text = scene.read_text(encoding="utf-8")
    assert old in text
    scene.write_text(text.replace(old, new), encoding="utf-8")


def _text_case(name: str, damage: Callable[[str, Chance], bytes]) -> Callable[[Path, Chance], None]:
    def apply(scene: Path, rng: Chance) -> None:
        path = scene.with_name(name)
        path.write_bytes(damage(path.read_text(encoding="utf-8"), rng))

    return apply


def _model_case(scene: Path, rng: Chance) -> None:
    """A damaged model, its material or the YAML file about it."""
    names = ("own.obj", "own.glb", "own.glb", "own.ply", "own.stl", "own.mtl", "own.yaml")
    name = names[int(rng.integers(len(names)))]
    path = scene.with_name(name)
    if name == "own.glb":
        path.write_bytes(_damaged_glb(path.read_bytes(), rng))
    elif name == "own.yaml":
        path.write_bytes(damaged_yaml(path.read_text(encoding="utf-8"), rng))
    elif name in ("own.obj", "own.ply", "own.mtl") and rng.random() < 0.7:
        path.write_bytes(_number(path.read_text(encoding="utf-8"), rng).encode())
    else:
        path.write_bytes(damaged_bytes(path.read_bytes(), rng))
    if name not in ("own.obj", "own.mtl", "own.yaml"):
        _swap(scene.with_name("own.yaml"), "own.obj", name)


def _damaged_glb(data: bytes, rng: Chance) -> bytes:
    """Damage to the JSON of a binary glTF with its lengths kept right, or to any bytes."""
    if rng.random() < 0.3:
        return damaged_bytes(data, rng)
    (length,) = struct.unpack_from("<I", data, 12)
    text, rest = data[20 : 20 + length].decode(), data[20 + length :]
    text = _number(text, rng) if rng.random() < 0.8 else _inserted(text, rng)
    body = text.encode("utf-8", errors="replace")
    body += b" " * (-len(body) % 4)
    total = 20 + len(body) + len(rest)
    head = struct.pack("<4sII", b"glTF", 2, total)
    return head + struct.pack("<I4s", len(body), b"JSON") + body + rest


def _image_case(scene: Path, rng: Chance) -> None:
    """A damaged radiance map or picture."""
    name = ("sky.hdr", "sky.exr", "skin.png")[int(rng.integers(3))]
    path = scene.with_name(name)
    path.write_bytes(damaged_bytes(path.read_bytes(), rng))
    if name == "skin.png":
        _swap(scene, "surface: asphalt", "surface: skin.png")
        _swap(scene, "textured: false", "textured: true")
        return
    start, end = SCENE.index("sky: {"), SCENE.index("\nground:")
    _swap(scene, SCENE[start:end], f"sky: {{file: {name}}}")


def _log_case(scene: Path, rng: Chance) -> None:
    """A damaged log; people walk only here, because each of them takes long to dress."""
    scene.with_name("fcd.xml").write_bytes(damaged_xml(log_text(people=True), rng))


def _any_case(scene: Path, rng: Chance) -> None:
    """Any text of the scenario."""
    names = ("scene", "network", "log", "objects", "types", "signals")
    KINDS[names[int(rng.integers(len(names)))]](scene, rng)


KINDS: Mapping[str, Callable[[Path, Chance], None]] = {
    "scene": _text_case("scene.yaml", damaged_yaml),
    "network": _text_case("net.net.xml", damaged_xml),
    "log": _log_case,
    "signals": _text_case("tls.xml", damaged_xml),
    "objects": _text_case("objects.add.xml", damaged_xml),
    "types": _text_case("types.rou.xml", damaged_xml),
    "configuration": _text_case("town.sumocfg", damaged_xml),
    "models": _model_case,
    "images": _image_case,
    "overrides": lambda scene, rng: None,
    "cameras": _any_case,
    "nothing": lambda scene, rng: None,
}
"""What is damaged, by the name of a kind."""


def chance_of(kind: str, seed: int) -> Chance:
    """What a case is made from."""
    return np.random.default_rng([seed, *kind.encode()])


def write_case(folder: Path, kind: str, seed: int) -> Path:
    """Write the scenario with one case's damage; returns its scene file."""
    scene = write_town(folder)
    KINDS[kind](scene, chance_of(kind, seed))
    return scene


def odd_overrides(rng: Chance) -> dict[object, object]:
    """Overrides as a program may give them, most of them wrong."""
    values: tuple[object, ...] = (
        *(
            None,
            True,
            0,
            -1,
            1e300,
            float("nan"),
            float("inf"),
            10**400,
            "draft",
            "",
            "[",
            "a" * 5000,
        ),
        *(
            b"x",
            (),
            [],
            {},
            {"fov": 40},
            {"mode": "eulerian"},
            [1, 2, 3],
            (640, 360),
            {1: 2},
            {None: 3},
        ),
        *(np.float32(2.5), np.int64(3), np.arange(3), np.array(np.nan), Path("a/b.exr"), Path()),
        *(dt.date(2026, 6, 21), dt.time(17, 30), Fraction(30000, 1001), Decimal("1.5"), range(3)),
        *(object(), print, {1, 2}, "\ud800", "\0", "21.06.2026", [[[[]]]], {"a": {"b": {"c": 1}}}),
    )
    keys: tuple[object, ...] = (
        *(
            "output.fps",
            "output.size",
            "output",
            "quality",
            "seed",
            "sky",
            "sky.sun.date",
            "sky.file",
        ),
        *(
            "cameras.post.lens.fov",
            "cameras.post",
            "cameras",
            "cameras.driver.vehicle",
            "shots.0.to",
        ),
        *("shots", "shots.0", "shots.9.to", "roads.per_edge", "vehicles.colours", "objects.trees"),
        *(
            "scenario.network",
            "scenario",
            "template",
            "ground.scale",
            "",
            ".",
            "a..b",
            "output.size.0",
        ),
        *(3, None, ("a",), "vehicles.by_id", "cameras.flight.keyframes.0.time", "motion.smoother"),
    )
    return {
        keys[int(rng.integers(len(keys)))]: values[int(rng.integers(len(values)))]
        for _ in range(int(rng.integers(1, 3)))
    }
