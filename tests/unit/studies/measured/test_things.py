"""How much of a body nothing hides, in layers that are traced by hand."""

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.layers import Layers, Thing, number_of
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.pipeline.films.stored_layers import FrameLayers, StoredCamera
from sumo3dviz_pt.studies.measured.pictures import _seen, box_entries, shining_lenses
from sumo3dviz_pt.studies.measured.traffic import Traffic
from sumo3dviz_pt.world.signals.signals import GLASS

SIZE = (160, 90)
LENS = Lens.of_degrees(60.0)
CAR, WALL = "vehicle:a@b:1", "building:w"
BODY = (4.0, 1.8, 1.5)


def traffic(x, y=0.0):
    """One car that looks away from the camera, with its rear x metres ahead of it."""
    one = np.zeros((1, 1))
    place = np.array([[[x + BODY[0], y, 0.0]]])
    sizes, there = np.array([BODY]), np.ones((1, 1), bool)
    return Traffic([CAR], sizes, there, place, one, one, one, np.zeros(1))


def frame(x, y=0.0, *walls):
    """What a camera 1.2 m above the ground sees of a car, whose box is full, and of walls."""
    eye, rays = np.array([0.0, 0.0, 1.2]), LENS.rays(SIZE)
    ground = np.where(rays[..., 2] < 0.0, -eye[2] / np.minimum(rays[..., 2], -1e-9), np.inf)
    depth, owner = ground, np.zeros(rays.shape[:2], dtype=np.int64)
    car = ((x, y - 0.9, 0.0), (x + 4.0, y + 0.9, 1.5))
    for name, (low, high) in [(CAR, car), *((WALL, wall) for wall in walls)]:
        near, meets = box_entries(eye, rays, np.array(low), np.array(high))
        first = meets & (near < depth)
        depth, owner = np.where(first, near, depth), np.where(first, number_of(name), owner)
    depth = np.where(np.isfinite(depth), depth, 0.0)
    pose = np.eye(4)
    pose[:3, 3] = eye
    things = {number_of(CAR): Thing(CAR, "car"), number_of(WALL): Thing(WALL, "building")}
    camera = StoredCamera(SIZE, 138.6, (79.5, 44.5), Transform(pose))
    layers = Layers({"depth": depth, "instance": owner})
    return FrameLayers(0, 0.0, layers, things, (), (), frozenset(), camera)


def seen(x, y=0.0, *walls, within=100.0):
    return _seen(frame(x, y, *walls), LENS, traffic(x, y), 0, within=within).get((0, CAR))


@pytest.mark.parametrize(("x", "y"), [(8.0, 0.0), (20.0, 4.0), (60.0, -3.0), (-2.0, 0.5)])
def test_a_body_alone_is_seen_whole(x, y):
    """Also one that the eye is in, and one beside it that reaches behind the camera."""
    share, pixels = seen(x, y)
    assert share == 1.0 and pixels > 10


def test_half_a_body_behind_a_wall_is_half_seen():
    share, _ = seen(12.0, 0.0, ((6.0, 0.0, 0.0), (6.5, 9.0, 4.0)))
    assert share == pytest.approx(0.5, abs=0.03)
    low = ((6.0, -9.0, 0.0), (6.2, 9.0, 0.675 + 0.3))  # hides what is below the sight line
    assert 0.2 < seen(12.0, 0.0, low)[0] < 0.6


def test_a_body_behind_a_wall_is_not_seen_and_what_is_behind_it_hides_nothing():
    assert seen(12.0, 0.0, ((6.0, -9.0, 0.0), (6.5, 9.0, 4.0))) == (0.0, 0)
    assert seen(12.0, 0.0, ((20.0, -9.0, 0.0), (21.0, 9.0, 9.0)))[0] == 1.0


def test_who_is_beside_the_picture_or_far_has_no_share():
    assert seen(5.0, 30.0) is None and seen(-30.0) is None
    assert seen(60.0, within=20.0) is None


def test_what_the_edge_cuts_off_does_not_count():
    share, pixels = seen(8.0, 4.8)
    whole = seen(8.0, 0.0)[1]
    assert share == 1.0 and 0 < pixels < whole


@pytest.mark.parametrize(
    ("letters", "shine"),
    [
        ("Gr", {"red": [1]}),
        ("rG", {"green": [3]}),
        ("ru", {"red": [1], "yellow": [4]}),
        ("rO", {}),
        ("r", {}),
    ],
)
def test_lenses_that_shine_are_known_by_log_and_glass(letters, shine):
    """Head 0 of link 1; a car in the red of a lens is none, and neither is another head."""
    head = number_of("signal:a/b:C/1/0")
    owner = np.full((2, 4), head, dtype=np.int64)
    owner[1, 2], owner[1, 3] = number_of(CAR), number_of("signal:a/b:C/0/0")
    albedo = np.full((2, 4, 3), 0.02, dtype=np.float16)
    glass = {(0, 1): "red", (0, 3): "green", (1, 0): "yellow", (1, 2): "red"}
    for place, name in glass.items():
        albedo[place] = GLASS[name]
    things = {head: Thing("signal:a/b:C/1/0", "traffic light")}
    plain = frame(9.0)
    seen_now = replace(plain, things=things, layers=Layers({"instance": owner, "albedo": albedo}))
    found = shining_lenses(seen_now, {"a/b:C": letters})
    assert {name: places.tolist() for name, places in found.items()} == shine
    assert shining_lenses(plain, {"a/b:C": letters}) == {}
