"""The kernel of our own finds what Mitsuba's path tracer finds.

Means of independent pictures are compared by z-test, part by part and as a whole. Under an even
sky, the whole is known so well that a bias of a thousandth would show.
"""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    RAW,
    ball,
    box,
    constant_sky,
    diffuse,
    frame_of,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)
from significance import sidak_t

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.lamps import running_lights
from sumo3dviz_pt.library.buildings.building import raised, rectangle
from sumo3dviz_pt.library.buildings.facade import NEAR
from sumo3dviz_pt.library.buildings.palettes import CLADDINGS, palette
from sumo3dviz_pt.library.buildings.shell import paint
from sumo3dviz_pt.library.buildings.styles import ROWS
from sumo3dviz_pt.library.materials import MATERIALS, matt, principled, surface_bsdf
from sumo3dviz_pt.model.geometry import Mesh, Transform
from sumo3dviz_pt.model.scene import (
    LampSet,
    Mover,
    Part,
    Prototype,
    Sky,
    Slots,
    StaticPart,
    VehicleLamp,
)
from sumo3dviz_pt.pipeline.production import Request, example, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.world.areas.covers import land_covers, water_material
from sumo3dviz_pt.world.objects.houses import cladding_material, lamp_sets

pytestmark = pytest.mark.slow

ROW = next(row for row in ROWS if row.style.colours.walls[0].surface == "brick")
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

SIZE, BLOCK, PASSES, SPP = (90, 54), 9, 6, 64
LAYERS = ("radiance", "depth", "hit", "albedo", "normal")
EARTH = principled((0.5, 0.4, 0.3), roughness=0.5)
GLASS = {"type": "roughdielectric", "alpha": 0.3}
SETS = {
    "opaque": ("trim", "steel", "glass", "rim", "signal_lens"),
    "coated and thin": ("paint", "leaf", "cloth", "matt", "far_ground"),
    "worn": ("asphalt", "paving", "plaster", "ground_grass", "ground_chess"),
    "stained": ("red plaster", "red brick"),
    "foreign": ("glass ball", "trim"),
    "mirrors": ("mirror", "trim"),
    "water and users' own": ("water", "picture", "rims", "chrome"),
}
BRICK = str(catalog.find("surfaces", "brick").folder / "albedo.png")
OWN = {
    "water": water_material(land_covers().water, textured=True),
    "picture": matt({"type": "bitmap", "filename": BRICK}),
    "rims": principled((0.66, 0.68, 0.7), roughness=0.3, metallic=1.0),
}
SUN = Sky(np.array([0.3, -0.4, 0.6]))


def surfaces():
    """Materials of all surfaces, and two stained ones."""
    found = {
        name: surface_bsdf(catalog.find("surfaces", name)) for name in catalog.names("surfaces")
    }
    for name in ("plaster", "brick"):
        texture = {k: v for k, v in found[name]["base_color"].items() if k != "wear"}
        mean = list(catalog.find("surfaces", name).meta["albedo"])
        stain = {"type": "stained", "texture": texture, "tint": {"type": "tint"}, "mean": mean}
        found[f"red {name}"] = {**found[name], "base_color": stain}
    return found


def textured(mesh, centre=(0.0, 0.0, 0.0)):
    """A mesh that shows about one tile of a surface."""
    uvs = 0.5 * (mesh.vertices - centre)[:, :2]
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, uvs)


def scene_of_balls(names, *, sky, lamps=()):
    """Balls on the ground, a road user nearby, stretched and turned, and a far one."""
    materials = {**MATERIALS, **surfaces(), **OWN, "matt": diffuse(0.4), "glass ball": GLASS}
    parts = [static("ground", textured(plane()), "asphalt" if "asphalt" in names else "earth")]
    for number, name in enumerate(names):
        centre = np.array([2.5 * number - 5.0, 0.0, 1.0])
        body = textured(ball(centre, 1.0), centre)
        parts.append(static(name, body, name, np.tile((0.5, 0.2, 0.1), (len(body.faces), 1))))
    body = (
        Part(ball((0, 0, 1), 1.0), "paint"),
        Part(box((-1, -1, -1), (0, 0, 0)), "coat_grey"),
    )
    car = Prototype("car", body, body)
    slots = Slots(near={"car": 2}, far={"car": 1})
    materials["earth"] = EARTH
    return scene_of(parts, materials, sky=sky, prototypes=[car], slots=slots, lamps=lamps)


def frame(lamps=None):
    """Everything in view."""
    near = Transform.from_pose((-3, -3, 0.4), yaw=0.5).matrix @ np.diag([1.0, 1.6, 0.7, 1.0])
    movers = [Mover("near", "car", Transform(near), (0.5, 0.1, 0.1))]
    # Its box's top is not in the ground's plane: there, chance decides what is seen.
    far = [mover("far", (3, -3, 0.1), (0.1, 0.1, 0.6), prototype="car")]
    view = view_at((0, -12, 4), pitch=-12, fov=50)
    return frame_of(view, movers=movers, far=far, lamps=lamps)


def pictures(scene, state, *, tracer):
    """Independent pictures of a scene, (passes, h, w, 3), and the last one's layers."""
    passes = {"spp": SPP, "pass_spp": SPP, "max_depth": 8, "tracer": tracer}
    quality = RAW.model_copy(update=passes)
    found = []
    with session_of(scene, size=SIZE, quality=quality, layers=LAYERS) as session:
        for seed in range(PASSES):
            session.retune(quality, seed=10 * seed + (tracer == "kernel"))
            found.append(session.render(state))
    return np.array([each.radiance for each in found], dtype=np.float64), found[-1].layers


def blocks(images):
    """Means of square blocks, (passes, rows, columns)."""
    count, height, width, _ = images.shape
    cut = images.reshape(count, height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)
    return cut.mean(axis=(2, 4, 5))


def scores(ours, theirs):
    """Differences of means over their standard errors; blocks without noise are left out."""
    spread = np.sqrt((ours.var(axis=0, ddof=1) + theirs.var(axis=0, ddof=1)) / PASSES)
    known = spread > 1e-6 * theirs.mean()
    return ((ours.mean(axis=0) - theirs.mean(axis=0))[known]) / spread[known]


def compared(scene, state):
    """Check radiance by blocks; return pictures of ours and of Mitsuba's, and layers."""
    ours, layers = pictures(scene, state, tracer="kernel")
    theirs, guides = pictures(scene, state, tracer="path")
    z = scores(blocks(ours), blocks(theirs))
    assert np.abs(z).max() < sidak_t(len(z) * len(SETS), freedom=2 * PASSES - 2)
    return ours, theirs, layers, guides


@pytest.mark.parametrize("name", SETS)
def test_all_materials_look_as_by_mitsuba(name):
    scene = scene_of_balls(SETS[name], sky=constant_sky())
    ours, theirs, layers, guides = compared(scene, frame())
    bias = ours.mean() / theirs.mean() - 1.0
    error = np.hypot(*(x.mean(axis=(1, 2, 3)).std(ddof=1) / PASSES**0.5 for x in (ours, theirs)))
    assert abs(bias) < 1e-3 + 3 * error / theirs.mean()
    # What a mirror shows guides our denoiser; Mitsuba's guide is the pane.
    same = ("hit", "depth") if name == "mirrors" else ("hit", "albedo", "normal", "depth")
    for layer in same:
        assert layers[layer].mean() == pytest.approx(guides[layer].mean(), rel=3e-3, abs=3e-4)


@pytest.mark.parametrize("name", ["coated and thin", "water and users' own"])
def test_sun_and_sky_light_as_by_mitsuba(name):
    compared(scene_of_balls(SETS[name], sky=SUN), frame())


@pytest.mark.parametrize("lit", [False, True], ids=["dark", "lit"])
def test_rooms_and_old_walls_look_as_by_mitsuba(lit):
    """A wall with windows and shops, some of them lit."""
    colours = palette(ROW.style.colours, np.random.default_rng(2), textured=True, dark=lit)
    walls = {f"cladding:{name}": 3.0 for name in CLADDINGS}
    shell = raised(rectangle(8.0, 9.0), ROW.style.designs[0], height=13.0, level=NEAR, seed=3)
    parts = paint({k: v @ QUARTER + (0, 6, 0) for k, v in shell.items()}, colours, tiles=walls)
    materials = dict(MATERIALS) | {n: cladding_material(n, textured=True) for n in walls}
    still = [StaticPart(p.material, "objects", p) for p in parts if "lamp:" not in p.material]
    lamps = lamp_sets([p for p in parts if "lamp:" in p.material])
    lamps = tuple(replace(some, sampled=False) for some in lamps)
    scene = scene_of(still, materials, sky=constant_sky(0.1 if lit else 1.0), lamps=lamps)
    compared(scene, frame_of(view_at((3, -12, 3), pitch=8, fov=60)))


@pytest.mark.parametrize("name", ["coated and thin", "foreign"])
def test_lamps_light_as_by_mitsuba(name):
    """Two sets, of which one is hidden from most of the ground."""
    corners = np.array([[-1, 0, 0], [1, 0, 0], [1, 0, 1], [-1, 0, 1]])
    panel = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    sets = tuple(
        LampSet(
            name,
            "signals",
            Mesh(panel.vertices + at, panel.faces),
            np.zeros(2, int),
            ("one",),
            sampled=True,
        )
        for name, at in (("high", (-4.0, 2.0, 3.0)), ("low", (4.0, 2.0, 0.2)))
    )
    scene = scene_of_balls(SETS[name], sky=constant_sky(0.01), lamps=sets)
    compared(scene, frame({each.id: np.full((1, 3), 3.0) for each in sets}))


def test_a_lamp_in_front_of_its_housing_lights_the_wall_opposite():
    """Rays start a centimetre off the wall, which is more than the lamp stands before its box."""
    middle = np.array([100.0, 100.0, 0.0])
    corners = np.array([[-1, -0.006, 1], [1, -0.006, 1], [1, -0.006, 2], [-1, -0.006, 2]])
    panel = Mesh(corners + middle, np.array([[0, 1, 2], [0, 2, 3]]))
    sign = LampSet("sign", "signals", panel, np.zeros(2, int), ("one",), sampled=True)
    parts = [
        static("housing", box(np.add(middle, (-2, 0, 0)), np.add(middle, (2, 1, 3))), "earth"),
        static("wall", box(np.add(middle, (-2, -3, 0)), np.add(middle, (2, -2, 3))), "earth"),
    ]
    scene = scene_of(parts, {**MATERIALS, "earth": EARTH}, sky=constant_sky(0.01), lamps=[sign])
    view = view_at(np.add(middle, (-6, 3, 5)), heading=135, pitch=-20, fov=50)
    ours, theirs, _, _ = compared(scene, frame_of(view, lamps={"sign": np.full((1, 3), 3.0)}))
    assert ours.mean() == pytest.approx(theirs.mean(), rel=5e-3)


CAR = Prototype(
    "car",
    (Part(box((-4.0, -0.9, 0.3), (0.0, 0.9, 1.4)), "earth"),),
    (Part(box((-4.0, -0.9, 0.3), (0.0, 0.9, 1.4)), "earth"),),
    (
        VehicleLamp("head", (0.01, 0.6, 0.7), (0.2, 0.12), 0.0),
        VehicleLamp("head", (0.01, -0.6, 0.7), (0.2, 0.12), 0.0),
        VehicleLamp("brake", (-4.01, 0.6, 0.8), (0.2, 0.12), np.pi),
        VehicleLamp("brake", (-4.01, -0.6, 0.8), (0.2, 0.12), np.pi),
    ),
)


def traffic(sky):
    """Two cars between a wall and a lit sign, on ground as large as the grid of the choice."""
    corners = np.array([[2, 6, 3], [4, 6, 3], [4, 6, 4], [2, 6, 4]])
    panel = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    sign = LampSet("sign", "signals", panel, np.zeros(2, int), ("one",), sampled=True)
    parts = [
        static("ground", plane(), "earth"),
        static("wall", box((9.0, -8.0, 0.0), (10.0, 8.0, 5.0)), "earth"),
    ]
    materials = {**MATERIALS, "earth": EARTH}
    slots = Slots(near={"car": 1}, far={"car": 1})
    scene = scene_of(parts, materials, sky=sky, prototypes=[CAR], slots=slots, lamps=[sign])
    return replace(scene, running=running_lights([CAR], dark=True, left_hand=False))


def street():
    """One car shines at the wall, a far one brakes in front of it."""
    near = replace(mover("a", (0, -1, 0), (0.1, 0.1, 0.1), prototype="car"), lit=HEAD)
    far = replace(mover("b", (8, 3, 0), (0.1, 0.1, 0.1), prototype="car", yaw=0.4), lit=BRAKE)
    view = view_at((-7, -9, 5), heading=50, pitch=-18, fov=60)
    return frame_of(view, movers=[near], far=[far], lamps={"sign": np.full((1, 3), 0.05)})


HEAD, BRAKE = frozenset({"head"}), frozenset({"brake"})
DUSK = Sky(np.array([0.9, -0.3, 0.02]))


@pytest.mark.parametrize("sky", [constant_sky(1e-4), DUSK], ids=["night", "dusk"])
def test_beams_light_as_by_mitsuba(sky):
    """Also at the edge of beams, where the choice by place knows least about them."""
    ours, theirs, _, _ = compared(traffic(sky), street())
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)


SHOWN = [("crossing", "corner", 456.0, "highway_day"), ("ronda", "driver", 460.0, "highway_day")]


def with_few_plants(shot):
    """A shot with a tenth of the plants that share models: Mitsuba records instances in every pass,
    in a time that grows with the square of their number."""
    stands, slots = shot.stands, shot.data.slots
    few = replace(stands, movers=stands.movers[::10], seeds=stands.seeds[::10])
    others = {name: count for name, count in slots.near.items() if name not in stands.slots}
    data = replace(shot.data, slots=replace(slots, near={**others, **few.slots}))
    return replace(shot, stands=few, data=data)


@pytest.mark.parametrize("example_shown", SHOWN, ids=lambda it: it[0])
def test_examples_look_as_by_mitsuba(example_shown):
    """With everything that a scene has, at a low resolution."""
    name, camera, time, template = example_shown
    job = load_job(example(name), {"template": template})
    production = prepare(job, Request(camera, "draft", SIZE), np.array([time]))
    production = replace(production, shot=with_few_plants(production.shot))
    found = []
    for tracer in ("kernel", "path"):
        passes = {"spp": 16, "pass_spp": 16, "denoise": "none", "tracer": tracer}
        quality = production.quality.model_copy(update=passes)
        with opened(replace(production, quality=quality)) as session:
            pictures = []
            for seed in range(PASSES):
                session.retune(quality, seed=10 * seed + (tracer == "kernel"))
                pictures.append(session.samples(production.shot.frame_at(time)).layers["capped"])
        found.append(np.array(pictures, dtype=np.float64))
    ours, theirs = found
    z = scores(blocks(ours), blocks(theirs))
    assert np.abs(z).max() < sidak_t(2 * len(z), freedom=2 * PASSES - 2)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
