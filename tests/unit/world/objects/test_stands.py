"""Plants that share models: how small their leaves are, and which plants share."""

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import ObjectsSettings
from sumo3dviz_pt.library.plants.tree import SHRUBS, SPECIES, fine_leaves, fine_tree, tree
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import areas
from sumo3dviz_pt.model.network import Location, Network
from sumo3dviz_pt.model.traffic import Poi
from sumo3dviz_pt.model.weather import Weather, Wind
from sumo3dviz_pt.world.objects import stands
from sumo3dviz_pt.world.objects.objects import build_scenery
from sumo3dviz_pt.world.objects.plants import CROWN
from sumo3dviz_pt.world.placement.surroundings import surroundings

HALF = 0.5  # half angle of the picture's diagonal [rad]
NOWHERE = Network({}, {}, (), Location())


def drive(xs):
    """A camera that goes east and looks ahead."""
    places = np.array([[x, 0.0, 1.4] for x in xs])
    return CameraPath(places, np.tile([1.0, 0.0, 0.0], (len(xs), 1)), np.full(len(xs), HALF))


def grove(kind, count, *, seed=3, sides=(6.0, 60.0), to=300.0):
    rng = np.random.default_rng(seed)
    xs, ys = rng.uniform(10.0, to, count), rng.uniform(*sides, count) * rng.choice([-1, 1], count)
    return [
        Poi(f"{kind}{k}", kind, (x, y), None, (1.0, 0.0, 0.0), "a.xml")
        for k, (x, y) in enumerate(zip(xs.tolist(), ys.tolist(), strict=True))
    ]


def planted(pois, path, **around):
    where = replace(surroundings(NOWHERE, seed=7, camera_path=path), **around)
    return build_scenery(pois, (), ObjectsSettings(), around=where)


def leaf_length(prototype):
    """Mean length of a model's leaves [m]."""
    (leaves,) = (part.mesh for part in prototype.parts if part.material == "leaf")
    corners = leaves.vertices[leaves.faces]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return float(sides.max(axis=1).mean())


@pytest.mark.parametrize("kind", ["tree", "shrub"])
def test_leaves_are_a_few_pixels_long_wherever_a_drive_comes_by(kind):
    path = drive(np.linspace(0.0, 200.0, 41))
    # So few that their budget does not make leaves larger.
    pois = grove(kind, 12)
    found = planted(pois, path).stands
    assert len(found.movers) > 8
    lengths = {name: leaf_length(body) for name, body in found.prototypes.items()}
    pixel = 2.0 * HALF / np.hypot(1280, 720)
    for mover in found.movers:
        matrix = mover.world_from_body.matrix
        towards = matrix[:3, 3] + [0.0, 0.0, 2.0] - path.positions
        away = np.linalg.norm(towards, axis=1)
        pictured = away[towards[:, 0] > np.cos(HALF) * away]
        # Needles are longer, and leaves of a crown differ among themselves.
        most = 6.0 if "spruce" in mover.prototype or "pine" in mover.prototype else 4.2
        leaf = np.cbrt(np.linalg.det(matrix[:3, :3])) * lengths[mover.prototype]
        assert leaf < most * pixel * max(pictured.min(initial=np.inf), 20.0), mover
        # Much smaller ones are noise that a denoiser smears; young trees have leaves as long.
        partly = away[np.arccos(towards[:, 0] / away) < HALF + CROWN / away]
        assert leaf > 1.6 * pixel * (partly.min(initial=40.0) - 6.0), mover


def test_leaves_do_not_hang_on_the_length_of_the_shot():
    xs = np.linspace(0.0, 200.0, 6)
    pois = grove("shrub", 30)
    long = {m.id: m.prototype for m in planted(pois, drive(xs)).stands.movers}
    shots = [planted(pois, drive([x])).stands.movers for x in xs]
    nearest = {}
    for mover in (each for shot in shots for each in shot):
        size = int(mover.prototype.split("/")[3][0])
        nearest[mover.id] = min(size, nearest.get(mover.id, size))
    assert {name: int(model.split("/")[3][0]) for name, model in long.items()} == nearest


@pytest.mark.parametrize("kind", ["tree", "shrub"])
def test_models_keep_their_budget_in_a_wood(kind):
    path = drive(np.linspace(0.0, 250.0, 30))
    wood = planted(grove(kind, 900, sides=(4.0, 90.0)), path)
    leaves = sum(
        len(part.mesh.faces)
        for body in wood.stands.prototypes.values()
        for part in body.parts
        if part.material == "leaf"
    )
    assert leaves <= stands.TRIANGLES[f"{kind}s"]
    assert 0.3 * stands.MOST[f"{kind}s"] < len(wood.stands.movers) <= stands.MOST[f"{kind}s"]
    # Every plant is there once.
    shared = [mover.id for mover in wood.stands.movers]
    alone = {thing for part in wood.static for thing, _ in part.part.mesh.things}
    assert len(set(shared)) == len(shared)
    assert not set(shared) & alone
    assert sum(wood.stands.slots.values()) == len(shared)


def test_models_are_the_same_plant_and_the_same_every_time():
    path = drive([0.0])
    one, other = (planted(grove("tree", 20), path).stands for _ in range(2))
    for mover, same in zip(one.movers, other.movers, strict=True):
        assert (mover.id, mover.prototype) == (same.id, same.prototype)
        assert np.array_equal(mover.world_from_body.matrix, same.world_from_body.matrix)
    for name, body in one.prototypes.items():
        for part, again in zip(body.parts, other.prototypes[name].parts, strict=True):
            assert np.array_equal(part.mesh.vertices, again.mesh.vertices)


@pytest.mark.parametrize("species", sorted({**SPECIES, **SHRUBS}))
def test_small_leaves_have_the_area_and_bounds_of_the_crown(species):
    usual = tree(species, seed=1, level=2)
    fine = fine_tree(species, seed=1, leaf=0.2)
    pairs = [(a.mesh, b.mesh) for a, b in zip(usual, fine, strict=True) if a.material == "leaf"]
    for old, new in pairs:
        area, again = (areas(mesh.vertices, mesh.faces).sum() for mesh in (old, new))
        assert again == pytest.approx(area, rel=0.02)
        assert np.allclose(old.bounds[1][2], new.bounds[1][2], rtol=0.1)
    leaves = fine_leaves(species, leaf=0.2)
    assert sum(len(new.faces) for _, new in pairs) == leaves
    assert fine_leaves(species, leaf=0.1) == pytest.approx(4 * leaves, rel=0.01)


@pytest.mark.parametrize("why", ["anywhere", "bare"])
def test_who_does_not_share(why):
    path = CameraPath.all_round(np.zeros((1, 3))) if why == "anywhere" else drive([0.0])
    season = "winter" if why == "bare" else "summer"
    found = planted(grove("tree", 12), path, season=season).stands
    names = [mover.prototype for mover in found.movers]
    evergreen = ("spruce", "pine")
    assert all(any(species in name for species in evergreen) for name in names)
    assert why == "bare" or not names


def test_plants_lean_with_the_wind_about_their_feet_and_never_jump():
    still = planted(grove("tree", 20), drive([0.0]), windy=True).stands
    assert not any(body.rooted for body in still.prototypes.values())
    calm = still.movers_at(3.0, Weather(wind=Wind(0.0, 0.0)))
    assert calm == still.movers_at(3.0, None) == still.movers
    gale = Weather(wind=Wind(9.0, 0.0))
    tips = []
    for time in np.arange(0.0, 3.0, 0.04).tolist():
        moved = still.movers_at(time, gale)
        for one, rest in zip(moved, still.movers, strict=True):
            here, there = one.world_from_body.matrix, rest.world_from_body.matrix
            np.testing.assert_allclose(here[:3, 3], there[:3, 3])
            np.testing.assert_allclose(here[:3, :2], there[:3, :2])
        tips.append([(k.world_from_body.matrix @ [0.0, 0.0, 8.0, 1.0])[:3] for k in moved])
    ways = np.array(tips)
    # To leeward on the whole, by a thousandth to a tenth of the height, and smoothly.
    away = ways - [(k.world_from_body.matrix @ [0.0, 0.0, 8.0, 1.0])[:3] for k in still.movers]
    assert 0.02 < away[..., 0].mean() < 0.4
    assert np.abs(away).max() < 0.8
    assert np.abs(np.diff(ways, axis=0)).max() < 0.06
    # Not all alike.
    assert np.std(away[-1, :, 0] - away[0, :, 0]) > 0.002
