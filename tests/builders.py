"""Small scenes made by code: SUMO's files on disk, and scene data for the renderer."""

from __future__ import annotations

import gzip
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Mesh, Transform, merge_meshes
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import (
    FrameState,
    LampSet,
    Mover,
    Part,
    Prototype,
    SceneData,
    Sky,
    Slots,
    StaticPart,
    View,
)

# SUMO's files ------------------------------------------------------------------------------

ROAD = 400.0
"""Length of the straight road [m]; its middle lies at the origin."""

TREES = """<additional><poi id="t0" type="tree" x="10" y="14"/>
<poi id="t1" type="tree" x="22" y="-13"/></additional>"""


def moved(points, offset):
    """SUMO's shape string of points, (x, y) [m]."""
    return " ".join(f"{x + offset[0]:.2f},{y + offset[1]:.2f}" for x, y in points)


def network_xml(*, offset=(0.0, 0.0), signals=False):
    """A straight road to the east, two lanes, in two edges that meet at the origin."""
    half = ROAD / 2
    kind = "traffic_light" if signals else "priority"

    def lane(edge, index, x0, x1):
        y = -4.8 + 3.2 * index
        shape = moved([(x0, y), (x1, y)], offset)
        return (
            f'<lane id="{edge}_{index}" index="{index}" speed="13.9" length="{x1 - x0}"'
            f' width="3.2" shape="{shape}"/>'
        )

    def edge(name, start, end, x0, x1):
        lanes = "".join(lane(name, index, x0, x1) for index in (0, 1))
        return f'<edge id="{name}" from="{start}" to="{end}" priority="3">{lanes}</edge>'

    def junction(name, of_kind, x, incoming):
        shape = moved([(x - 2, 0), (x + 2, 0), (x + 2, -6.4), (x - 2, -6.4)], offset)
        return (
            f'<junction id="{name}" type="{of_kind}" x="{x + offset[0]}" y="{offset[1]}"'
            f' incLanes="{incoming}" intLanes="" shape="{shape}"/>'
        )

    light = 'tl="m" linkIndex="{0}"' if signals else ""
    links = "".join(
        f'<connection from="w" to="e" fromLane="{k}" toLane="{k}" dir="s" state="M"'
        f" {light.format(k)}/>"
        for k in (0, 1)
    )
    box = f"{offset[0] - half},{offset[1] - 10},{offset[0] + half},{offset[1] + 10}"
    return "\n".join(
        [
            '<net version="1.20">',
            f'<location netOffset="0,0" convBoundary="{box}" origBoundary="{box}"'
            ' projParameter="!"/>',
            edge("w", "a", "m", -half, -2.0),
            edge("e", "m", "b", 2.0, half),
            junction("a", "dead_end", -half, ""),
            junction("m", kind, 0.0, "w_0 w_1"),
            junction("b", "dead_end", half, "e_0 e_1"),
            links,
            "</net>",
        ]
    )


def fcd_xml(
    *,
    offset=(0.0, 0.0),
    vehicles=6,
    step=1.0,
    end=12.0,
    begin=0.0,
    persons=0,
    speed=10.0,
    spacing=18.0,
):
    """Cars `v0`, ... driving to the east from x = -40, `spacing` metres apart; walkers beside."""
    rows = []
    for number in range(round((end - begin) / step) + 1):
        time = begin + number * step
        row = [f'<timestep time="{time:.2f}">']
        for index in range(vehicles):
            lane = index % 2
            x = -40.0 + spacing * (index // 2) + speed * (time - begin) + offset[0]
            y = -4.8 + 3.2 * lane + offset[1]
            row.append(
                f'<vehicle id="v{index}" x="{x:.3f}" y="{y:.3f}" angle="90" type="car"'
                f' speed="{speed}" lane="w_{lane}"/>'
            )
        for index in range(persons):
            x, y = 5.0 * index + 1.2 * (time - begin) + offset[0], 2.0 + offset[1]
            row.append(
                f'<person id="p{index}" x="{x:.3f}" y="{y:.3f}" angle="90" speed="1.2" edge="w"/>'
            )
        rows.append("".join(row) + "</timestep>")
    return "<fcd-export>\n" + "\n".join(rows) + "\n</fcd-export>"


TYPES = '<additional><vType id="car" vClass="passenger" length="4.6" width="1.8"/></additional>'

SIGNALS = """<tlsStates>
<tlsState time="0.00" id="m" programID="0" phase="0" state="Gr"/>
<tlsState time="6.00" id="m" programID="0" phase="1" state="rG"/>
</tlsStates>"""

SCENE = """scenario:
  network: net.net.xml
  trajectories: fcd.xml
  vehicle_types: types.add.xml
{files}template: abstract
seed: 3
quality: draft
cameras:
  post:
    mode: eulerian
    position: [{x0}, {y0}, 6]
    look_at: [{x1}, {y1}, 0]
    lens: {{fov: 60}}
  driver: {{mode: lagrangian, vehicle: v0, view: driver}}
shots:
  - {{camera: post, from: 4, to: 5}}
output: {{size: [64, 36], fps: 10}}
"""


def write_scenario(
    folder, *, offset=(0.0, 0.0), signals=False, trees=False, scene=None, **traffic
) -> Path:
    """Write network, log, types and a scene file; returns the scene file."""
    folder = Path(folder)
    files = ""
    (folder / "net.net.xml").write_text(
        network_xml(offset=offset, signals=signals), encoding="utf-8"
    )
    (folder / "fcd.xml").write_text(fcd_xml(offset=offset, **traffic), encoding="utf-8")
    (folder / "types.add.xml").write_text(TYPES, encoding="utf-8")
    if signals:
        (folder / "tls.xml").write_text(SIGNALS, encoding="utf-8")
        files += "  signals: tls.xml\n"
    if trees:
        (folder / "trees.add.xml").write_text(TREES, encoding="utf-8")
        files += "  additional: trees.add.xml\n"
    x, y = offset
    text = scene or SCENE.format(files=files, x0=x + 30, y0=y - 22, x1=x + 5, y1=y - 3)
    (folder / "scene.yaml").write_text(text, encoding="utf-8")
    return folder / "scene.yaml"


def complaints(said: str) -> list[str]:
    """Lines that are neither notes nor tell how far work is, which a slow machine gets to."""
    return [x for x in said.splitlines() if ": note: " not in x and not x.endswith(" left")]


def gzipped(text: str) -> bytes:
    """The same bytes at all times."""
    return gzip.compress(text.encode("utf-8"), mtime=0)


# Scene data --------------------------------------------------------------------------------

_QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(low, high) -> Mesh:
    """An axis-aligned box by its corners [m]."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = np.array(
        [[x, y, z] for z in (z0, z1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    )
    faces = [tri for a, b, c, d in _QUADS for tri in ((a, b, c), (a, c, d))]
    return Mesh(corners, np.array(faces))


def plane(half=50.0, *, centre=(0.0, 0.0), z=0.0) -> Mesh:
    """A square looking up."""
    x, y = centre
    corners = [[x + sx * half, y + sy * half, z] for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


def ball(centre, radius, *, rows=32, columns=64) -> Mesh:
    """A smooth sphere."""
    theta = np.linspace(0, np.pi, rows + 1)
    phi = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    theta, phi = np.meshgrid(theta, phi, indexing="ij")
    normals = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    ).reshape(-1, 3)
    faces = []
    for row in range(rows):
        for column in range(columns):
            a, b = row * columns + column, row * columns + (column + 1) % columns
            below, beside = a + columns, b + columns
            faces += [(a, below, b)] if row == 0 else []
            faces += [(a, below, beside)] if row == rows - 1 else []
            faces += [(a, below, beside), (a, beside, b)] if 0 < row < rows - 1 else []
    return Mesh(radius * normals + centre, np.array(faces), normals)


def diffuse(*colour):
    """A matt material of a linear reflectance."""
    value = list(colour) if len(colour) == 3 else [colour[0]] * 3
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": value}}


def constant_sky(radiance=1.0) -> Sky:
    """The same radiance from everywhere."""
    return Sky(None, image=np.full((8, 16, 3), radiance, dtype=np.float32))


def static(name, mesh, material, tint=None) -> StaticPart:
    """A part that does not move."""
    return StaticPart(name, "test", Part(mesh, material, tint))


LAMPS = LampSet(
    "lamps",
    "signals",
    Mesh(np.array([[-1, 9, 1], [1, 9, 1], [1, 9, 2]]), np.array([[0, 1, 2]])),
    np.zeros(1, int),
    ("one",),
    sampled=True,
)
"""A triangle that shines and that paths aim at."""


def scene_of(parts, materials, *, sky=None, prototypes=(), slots=None, lamps=(), haze=None):
    """Scene data of the given parts."""
    return SceneData(
        materials=materials,
        static=tuple(parts),
        prototypes={prototype.name: prototype for prototype in prototypes},
        lamps=tuple(lamps),
        sky=sky or constant_sky(),
        slots=slots or Slots(),
        haze=haze,
    )


def view_at(position, *, heading=0.0, pitch=0.0, fov=60.0) -> View:
    """A camera by position [m], compass heading, pitch and opening angle [deg]."""
    yaw = np.radians(90.0 - heading)
    return View(
        Transform.from_pose(position, yaw=yaw, pitch=np.radians(pitch)), Lens.of_degrees(fov)
    )


def frame_of(view, *, time=0.0, movers=(), far=(), lamps=None) -> FrameState:
    """The state of a frame."""
    return FrameState(time, view, tuple(movers), tuple(far), lamps or {})


def cube(name="cube", *, material="matt_tint", side=2.0) -> Prototype:
    """A body of one tinted box, its front at the origin."""
    mesh = box((-side, -side / 2, 0.0), (0.0, side / 2, side))
    part = Part(mesh, material)
    return Prototype(name, (part,), (part,))


def mover(name, position, colour, *, prototype="cube", yaw=0.0) -> Mover:
    """A road user at a place."""
    return Mover(name, prototype, Transform.from_pose(position, yaw=yaw), colour)


RAW = Quality(spp=4, pass_spp=4, max_depth=6, denoise="none", cap=None, haze=False)
"""What the integrator says, untouched."""


@contextmanager
def session_of(scene, *, size=(64, 36), quality=RAW, seed=1, variant="llvm", **settings):
    """A scene in the renderer, with further settings by name."""
    from sumo3dviz_pt.render.backend import choose_backend
    from sumo3dviz_pt.render.session import RenderSettings, Session

    with Session(
        scene, choose_backend(variant), RenderSettings(size, quality, seed, **settings)
    ) as session:
        yield session


def joined(*meshes: Mesh) -> Mesh:
    """One mesh of several."""
    return merge_meshes(meshes)


def z_scores(means, variances, counts):
    """Differences of two sample means over their standard error, elementwise."""
    (mean_a, mean_b), (var_a, var_b), (n_a, n_b) = means, variances, counts
    spread = np.sqrt(var_a / n_a + var_b / n_b)
    return (mean_a - mean_b) / np.maximum(spread, 1e-12)


def aspect_at(signals, tls, link, time):
    """Which lamps are lit for a link of a signal; none for an unknown one."""
    heads = [signals.heads[k] for k in signals.heads_of(tls, link)[:1]]
    return frozenset().union(*(head.course.lit_at(time, lamps=head.lamps) for head in heads))
