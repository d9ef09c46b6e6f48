"""Thin layers on the ground do not fight for the picture, from however far away.

Every part gets a colour of its own; with a grey sky and one bounce a sample's hue says
which part it hit. The truth is our own ray casting in double precision.
"""

from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from builders import (
    RAW,
    constant_sky,
    diffuse,
    frame_of,
    plane,
    scene_of,
    session_of,
    static,
    write_scenario,
)

from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import ORIGIN_GRID, Part, View
from sumo3dviz_pt.pipeline.production import Request, example, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.cameras.aiming import aim_at

pytestmark = pytest.mark.slow

SIZE = (128, 72)
QUALITY = RAW.model_copy(update={"spp": 1, "pass_spp": 1, "max_depth": 2})
MOST_WRONG = 1e-3

# Albedos of different hue: directions of a cube's surface grid, no two alike.
HUES = np.array([c for c in product((0.1, 0.33, 0.57, 0.8), repeat=3) if max(c) == 0.8])
HUES = HUES / np.linalg.norm(HUES, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """Parts on the ground, in their own colours.

    Attributes:
        scene: For the renderer.
        corners: Of all triangles, (n, 3, 3) [m].
        owner: Number of each triangle's part, (n,).
        names: Of the parts.
    """

    scene: object
    corners: np.ndarray
    owner: np.ndarray
    names: tuple


def layered(parts):
    """Parts with unique materials under a grey sky."""
    parts = [replace(part, part=Part(part.part.mesh, part.id)) for part in parts]
    assert len(parts) <= len(HUES)
    materials = {part.id: diffuse(*(0.8 * HUES[k])) for k, part in enumerate(parts)}
    meshes = [part.part.mesh for part in parts]
    return Layers(
        scene_of(parts, materials, sky=constant_sky()),
        np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes]),
        np.repeat(np.arange(len(parts)), [len(mesh.faces) for mesh in meshes]),
        tuple(part.id for part in parts),
    )


def on_the_ground(data):
    """Parts that lie on each other; hills and woods of the ground's family would hide them."""
    return [p for p in data.static if p.family in ("roads", "markings") or p.id == "ground"]


@cache
def crossing_layers():
    """Ground, roads and markings of the bundled crossing."""
    job = load_job(example("crossing"))
    return layered(on_the_ground(prepare(job, Request(), frame_times(450, 450.1, 10)).shot.data))


def view_of(target, *, distance, height, azimuth, width):
    """A view that is some metres wide at its target, from a compass direction [deg]."""
    a = np.radians(azimuth)
    eye = np.add(target, [distance * np.sin(a), distance * np.cos(a), height])
    direction = np.subtract(target, eye)
    fov = 2 * np.arctan(0.5 * width / np.linalg.norm(direction))
    return View(aim_at(direction).placed(eye), Lens(float(fov)))


def rays(view, x, y):
    """Directions through places of the picture [px], (len(y), len(x), 3), not unit."""
    half = view.lens.half_width
    left, up = np.meshgrid(1 - 2 * x / SIZE[0], (SIZE[1] - 2 * y) / SIZE[0])
    local = np.stack([np.ones_like(left), half * left, half * up], axis=-1)
    return local @ view.world_from_camera.matrix[:3, :3].T


def in_picture(layers, view):
    """Triangles that may be in view, (k,), and their boxes x0, x1, y0, y1, (k, 4) [px]."""
    local = (layers.corners - view.position) @ view.world_from_camera.matrix[:3, :3]
    depth = local[..., 0]
    half = view.lens.half_width
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (1 - local[..., 1] / depth / half) / 2 * SIZE[0]
        y = (SIZE[1] - local[..., 2] / depth / half * SIZE[0]) / 2
    boxes = np.stack([x.min(1), x.max(1), y.min(1), y.max(1)], axis=1)
    # What reaches behind the eye may cover anything.
    boxes[(depth <= 1e-3).any(axis=1)] = (0, SIZE[0], 0, SIZE[1])
    seen = (boxes[:, 1] >= 0) & (boxes[:, 0] <= SIZE[0]) & (depth > 1e-3).any(axis=1)
    seen &= (boxes[:, 3] >= 0) & (boxes[:, 2] <= SIZE[1])
    return np.flatnonzero(seen), boxes[seen]


def hits(corners, directions):
    """Where rays from the origin meet a triangle: multiples of their directions, or inf."""
    a, b, c = corners
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (a @ normal) / (directions @ normal)
        point = directions * t[..., None]
        inside = t > 0
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= (point - p) @ np.cross(normal, q - p) >= 0
    return np.where(inside, t, np.inf)


def parts_behind(layers, view, pixel):
    """Numbers of the parts that a pixel (row, column) shows anywhere, to 1/200 of its height."""
    row, column = pixel
    index, boxes = in_picture(layers, view)
    near = (boxes[:, 0] <= column + 1) & (boxes[:, 1] >= column)
    index = index[near & (boxes[:, 2] <= row + 1) & (boxes[:, 3] >= row)]
    directions = rays(view, column + np.linspace(0, 1, 5), row + np.linspace(0, 1, 201))
    found = [hits(layers.corners[k] - view.position, directions) for k in index]
    return set(layers.owner[index[np.argmin(found, axis=0)]].ravel())


def on_top(layers, view):
    """Number of the part at the corners of all pixels and between them; -1 is sky.

    Rows are four times as dense, because at grazing angles a pixel is a long strip of
    ground: (4 h + 1, w + 1).
    """
    directions = rays(view, np.arange(SIZE[0] + 1.0), np.arange(4 * SIZE[1] + 1) / 4)
    nearest = np.full(directions.shape[:-1], np.inf)
    owner = np.full(directions.shape[:-1], -1)
    index, boxes = in_picture(layers, view)
    boxes = np.clip(boxes, 0, [SIZE[0], SIZE[0], SIZE[1], SIZE[1]]) * [1, 1, 4, 4]
    for k, (x0, x1, y0, y1) in zip(index, boxes.astype(int), strict=True):
        here = np.s_[max(y0 - 1, 0) : y1 + 2, max(x0 - 1, 0) : x1 + 2]
        t = hits(layers.corners[k] - view.position, directions[here])
        closer = t < nearest[here]
        nearest[here][closer] = t[closer]
        owner[here][closer] = layers.owner[k]
    return owner


def filled_by(layers, view):
    """Number of the part that fills each pixel, (h, w); -1 where it is sky or several."""
    owner = on_top(layers, view)
    rows = [owner[k : k + 4 * SIZE[1] : 4] for k in range(5)]
    values = np.stack([row[:, k : k + SIZE[0]] for row in rows for k in (0, 1)])
    return np.where((values == values[0]).all(axis=0), values[0], -1)


def judged(layers, session, view):
    """Share of wrong pixels away from borders, how many were judged, and what is in sight."""
    image = session.render(frame_of(view)).radiance.astype(float)
    found = np.argmax(image @ HUES.T, axis=-1)
    truth = filled_by(layers, view)
    plain = (truth >= 0) & (image.max(axis=-1) > 0)
    odd = np.argwhere(plain & (found != truth))
    # A stripe thinner than a quarter of a pixel escapes the grid of `filled_by`.
    asked = odd[:: max(len(odd) // 100, 1)]
    wrong = [found[tuple(pixel)] not in parts_behind(layers, view, pixel) for pixel in asked]
    count = int(plain.sum())
    share = float(np.mean(wrong or [0])) * len(odd) / count
    return share, count, {layers.names[k] for k in np.unique(truth[plain])}


WHERE = [
    {"distance": 2000, "height": 20, "azimuth": 90, "width": 6},
    {"distance": 2000, "height": 5, "azimuth": 37, "width": 6},
    {"distance": 300, "height": 2, "azimuth": 200, "width": 4},
    {"distance": 300, "height": 2, "azimuth": 90, "width": 1},
    {"distance": 60, "height": 2, "azimuth": 37, "width": 12},
    {"distance": 8, "height": 2, "azimuth": 0, "width": 9},
]


@cache
def small_layers(step):
    """The straight road of the builders, its middle moved by a step [m], and its location."""
    with TemporaryDirectory() as folder:
        place = write_scenario(folder, offset=step, vehicles=1)
        shot = prepare(load_job(place), Request(), frame_times(4, 4.1, 10)).shot
    return layered(on_the_ground(shot.data)), shot.fleet.location


def check(layers, target):
    """All views of a target, in one session."""
    counts, sight = [], set()
    with session_of(layers.scene, size=SIZE, quality=QUALITY) as session:
        for where in WHERE:
            wrong, count, seen = judged(layers, session, view_of(target, **where))
            assert wrong < MOST_WRONG, (where, wrong, count)
            counts.append(count)
            sight |= seen
    assert min(counts) > 3000
    return sight


@pytest.mark.parametrize("far", [0, 1], ids=["middle of all", "edge"])
def test_layers_of_the_crossing_keep_their_order(far):
    """From 2 km, 300 m and eye height, through lenses down to a tenth of a degree."""
    layers = crossing_layers()
    marks = layers.owner == layers.names.index("markings/asphalt")
    spots = layers.corners[marks].mean(axis=1)
    order = np.argsort(np.linalg.norm(spots - np.median(spots, axis=0), axis=1))
    sight = check(layers, spots[order[far * len(order) // 4]])
    assert {"markings/asphalt", "road/asphalt", "ground", "road/faces/kerb"} <= sight


@pytest.mark.parametrize("corner", [(0.0, 0.0), (0.4999, 0.4999), (-0.4999, 0.25)], ids=str)
def test_the_place_in_the_renderers_grid_does_not_matter(corner):
    """The road is moved so that the farthest eye stands there within its cell."""
    target = np.array([-60.0, -3.2, 0.0])
    eye = view_of(target, **WHERE[0]).position
    step = ORIGIN_GRID * (np.array(corner) + 4) - eye[:2]
    layers, location = small_layers(tuple(step))
    # Cells are whole parts of the kilometres from which places are counted.
    assert np.remainder(location.origin, ORIGIN_GRID).tolist() == [0.0, 0.0]
    sight = check(layers, location.inside(np.add(target, (*step, 0.0))))
    assert {"road/asphalt", "ground"} <= sight


def test_the_judge_sees_a_fight():
    """Two layers at one height are what the tests above exclude."""
    layers = layered(
        [static(name, plane(30, centre=(x, 0)), name) for name, x in (("a", 0), ("b", 1e-4))]
    )
    with session_of(layers.scene, size=SIZE, quality=QUALITY) as session:
        wrong, _, _ = judged(layers, session, view_of((0, 0, 0), **WHERE[-1]))
    assert wrong > 0.1
