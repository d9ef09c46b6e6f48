"""Layers of films: in register with the pictures, with each other, and between films."""

from __future__ import annotations

import csv
import gzip
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from builders import write_scenario

import sumo3dviz_pt as sv
from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_channels, read_exr
from sumo3dviz_pt.model.layers import LABELS, number_of
from sumo3dviz_pt.model.numbers import LAYER_KINDS
from sumo3dviz_pt.pipeline.films.stored_layers import FrameLayers, read_frame
from sumo3dviz_pt.render.backend import choose_backend

pytestmark = pytest.mark.slow

SIZE = (192, 108)
CROSSING = data_root("examples") / "crossing"
ALL = [*LAYER_KINDS]
CHEAP = ["--fps", "5", "--spp", "1", "--size", "192x108", "--camera", "post", "--from", "4"]


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    if not choose_backend("llvm").jit:
        pytest.skip("only our own kernel has layers")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("layers")
    return write_scenario(folder, vehicles=4, persons=3, signals=True, trees=True)


def render(place: Path, film: Path, *more: str, layers: list[str], to: float = 4.4) -> int:
    """Render a film of two frames."""
    wanted = ["--set", f"output.layers={json.dumps(layers)}"]
    words = ["render", place, *CHEAP, "--to", to, *wanted, *more, "-o", film]
    return main([str(word) for word in words])


@pytest.fixture(scope="module")
def film(place: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film with all layers."""
    path = tmp_path_factory.mktemp("film") / "a.mp4"
    assert render(place, path, layers=ALL) == 0
    return path


@pytest.fixture(scope="module")
def plain(place: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same film without layers."""
    path = tmp_path_factory.mktemp("plain") / "a.mp4"
    assert render(place, path, layers=[]) == 0
    return path


@pytest.fixture(scope="module")
def seen(film: Path) -> FrameLayers:
    return read_frame(film.with_suffix(".layers"), 0)


def named(seen: FrameLayers) -> dict[str, np.ndarray]:
    """Pixels of each thing, by its name."""
    numbers = seen.layers["instance"]
    return {thing.name: numbers == number for number, thing in seen.things.items()}


def test_the_picture_does_not_know_of_layers(film: Path, plain: Path) -> None:
    assert not plain.with_suffix(".layers").exists()
    for path in sorted(film.with_suffix(".frames").glob("*.exr")):
        ours = read_exr(path)[0]
        np.testing.assert_array_equal(ours, read_exr(plain.with_suffix(".frames") / path.name)[0])


def test_everybody_and_everything_has_its_number(film: Path, seen: FrameLayers) -> None:
    found = named(seen)
    kinds = {name.partition(":")[0] for name in found}
    assert {"vehicle", "person", "tree", "edge", "marking", "sky"} <= kinds
    assert {"tree:t0", "edge:w", "edge:e"} <= set(found)
    for name in ("vehicle:v0", "vehicle:v1", "vehicle:v2", "vehicle:v3"):
        assert found[name].sum() > 10
    assert set(np.unique(seen.layers["instance"]).tolist()) == set(seen.things)
    for number, thing in seen.things.items():
        assert number == thing.number == number_of(thing.name)
        assert (seen.layers["semantic"][found[thing.name]] == LABELS[thing.label]).all()
    with (film.with_suffix(".layers") / "instances.csv").open(encoding="utf-8", newline="") as file:
        whole = {(int(row["number"]), row["name"], row["label"]) for row in csv.DictReader(file)}
    assert {(number, one.name, one.label) for number, one in seen.things.items()} <= whole


def test_films_lead_to_their_layers(film: Path, seen: FrameLayers) -> None:
    found = sv.read_layers(film, 0)
    np.testing.assert_array_equal(found.layers["instance"], seen.layers["instance"])
    with pytest.raises(sv.InputError, match="cannot be read"):
        sv.read_layers(film, 2)


def test_depth_is_the_sky_where_nothing_is(seen: FrameLayers) -> None:
    sky = named(seen)["sky"]
    np.testing.assert_array_equal(seen.layers["depth"] == 0.0, sky)
    length = np.linalg.norm(seen.layers["normals"], axis=-1)
    np.testing.assert_allclose(length[~sky], 1.0, atol=2e-3)
    assert (length[sky] == 0.0).all()
    assert (seen.layers["albedo"][~sky].max(axis=-1) > 0.0).mean() > 0.99


def world_points(seen: FrameLayers) -> np.ndarray:
    """What pixels show, from nothing but what the files say, (h, w, 3) [m]."""
    camera = seen.camera
    rows, columns = np.indices(seen.layers["depth"].shape)
    rays = np.ones((*rows.shape, 3))
    rays[..., 1] = (camera.centre[0] - columns) / camera.focal
    rays[..., 2] = (camera.centre[1] - rows) / camera.focal
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return camera.world_from_camera.points(rays * seen.layers["depth"][..., None])


def test_roads_lie_where_the_network_has_them(seen: FrameLayers) -> None:
    found, points = named(seen), world_points(seen)
    west, east = points[found["edge:w"]], points[found["edge:e"]]
    assert west[:, 0].max() < -1.9
    assert east[:, 0].min() > 1.9
    for road in (west, east):
        assert np.abs(road[:, 2]).max() < 0.03
        assert -6.5 < road[:, 1].min() < road[:, 1].max() < 0.1


def test_boxes_hold_every_pixel_and_touch_it_on_four_sides(seen: FrameLayers) -> None:
    found = named(seen)
    assert {"vehicle:v0", "tree:t0"} <= {box.name for box in seen.boxes2d}
    for box in seen.boxes2d:
        own = found[box.name]
        inside = own[box.top : box.bottom, box.left : box.right]
        assert inside.sum() == own.sum() == box.pixels
        assert all(edge.any() for edge in (inside[0], inside[-1], inside[:, 0], inside[:, -1]))


def test_boxes_in_space_hold_the_bodies_that_are_seen(film: Path, seen: FrameLayers) -> None:
    found, points = named(seen), world_points(seen)
    assert len({box.name for box in seen.boxes3d}) >= 6
    for box in seen.boxes3d:
        own = points[found[box.name]]
        inverse = np.linalg.inv(box.world_from_box.matrix)
        local = own @ inverse[:3, :3].T + inverse[:3, 3]
        assert (np.abs(local) < 0.5 * np.array(box.size) + 0.02).all()
    cars = [box for box in seen.boxes3d if box.name.startswith("vehicle")]
    for box in cars:
        assert box.size[0] == pytest.approx(4.6, abs=0.15)
    # KITTI's form says the same: its camera looks right, down, forward.
    lines = (film.with_suffix(".layers") / "kitti/000000.txt").read_text("utf-8").splitlines()
    assert len(lines) == len(seen.boxes3d)
    for line, box in zip(lines, seen.boxes3d, strict=True):
        words = line.split()
        assert words[0] == ("Car" if box.name.startswith("vehicle") else "Pedestrian")
        foot = box.world_from_box.points(np.array([[0.0, 0.0, -0.5 * box.size[2]]]))[0]
        world = seen.camera.world_from_camera.matrix
        forward, left, up = world[:3, :3].T @ (foot - world[:3, 3])
        np.testing.assert_allclose([*map(float, words[11:14])], [-left, -up, forward], atol=1e-3)


HIDING = ("pole:", "signal:")
"""Names of what stands before the cars of this scene."""


def test_flow_of_all_cars_leads_to_the_same_cars(film: Path, seen: FrameLayers) -> None:
    after = read_frame(film.with_suffix(".layers"), 1)
    assert "flow" not in after.layers
    flow, known = seen.layers["flow"], seen.layers["flow_valid"]
    assert known.mean() > 0.99
    rows, columns = np.indices(known.shape)
    then = np.rint(np.stack([rows, columns], axis=-1) + flow[..., ::-1]).astype(int)
    found, later = named(seen), named(after)
    for name in ("vehicle:v0", "vehicle:v1"):
        own = found[name]
        assert np.abs(flow[own]).max() > 2.0
        ends = then[own]
        inside = ((ends >= 0) & (ends < known.shape)).all(axis=1)
        there = tuple(ends[inside].T)
        # Poles and signals hide some of it by then.
        hidden = np.any([later[key][there] for key in later if key.startswith(HIDING)], axis=0)
        assert hidden.mean() < 0.3
        assert later[name][there][~hidden].mean() > 0.9
    road = found["edge:w"] | found["edge:e"] | found["sky"]
    assert np.abs(flow[road]).max() == 0.0  # the camera stands


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example, from within a car that turns where others drive and walk."""
    path = tmp_path_factory.mktemp("crossing") / "a.mp4"
    layers = json.dumps(["depth", "instance", "flow", "boxes3d"])
    words = ["render", str(CROSSING / "scene.yaml"), "--camera", "driver", "--fps", "5"]
    words += ["--from", "499", "--to", "499.4", "--size", "384x216", "--spp", "1"]
    words += ["--set", "textured=false", "--set", f"output.layers={layers}", "-o", str(path)]
    assert main(words) == 0
    return path


def in_picture(seen: FrameLayers, points: np.ndarray) -> np.ndarray:
    """Columns and rows of points in the network's coordinates, (n, 2) [px]."""
    inverse = np.linalg.inv(seen.camera.world_from_camera.matrix)
    forward, left, up = (points @ inverse[:3, :3].T + inverse[:3, 3]).T
    across, down = seen.camera.centre
    return np.stack(
        [across - seen.camera.focal * left / forward, down - seen.camera.focal * up / forward],
        axis=-1,
    )


def reprojected(now: FrameLayers, after: FrameLayers) -> dict[str, np.ndarray]:
    """How far flow leads from where things are in the next picture, by their names [px].

    What stands stays; rigid bodies move as their boxes do. Wheels turn besides, so of bodies
    what is higher than they are counts.
    """
    points, found = world_points(now), named(now)
    rows, columns = np.indices(now.layers["depth"].shape)
    ends = np.stack([columns, rows], axis=-1) + now.layers["flow"]
    then = {box.name: box for box in after.boxes3d}
    boxes = {box.name: box for box in now.boxes3d if box.name.startswith("vehicle")}
    errors = {}
    for thing in now.things.values():
        own = found[thing.name] & now.layers["flow_valid"]
        if thing.name in boxes and thing.name in then:
            box = boxes[thing.name]
            inverse = np.linalg.inv(box.world_from_box.matrix)
            local = points @ inverse[:3, :3].T + inverse[:3, 3]
            own &= local[..., 2] > 0.85 - 0.5 * box.size[2]
            places = then[thing.name].world_from_box.points(local[own])
        elif thing.moves or thing.name == "sky":
            continue
        else:
            places = points[own]
        if own.any():
            errors[thing.name] = np.linalg.norm(in_picture(after, places) - ends[own], axis=-1)
    return errors


@pytest.mark.parametrize("which", ["film", "crossing"])
def test_flow_reprojects_within_a_tenth_of_a_pixel(
    which: str, request: pytest.FixtureRequest
) -> None:
    folder = request.getfixturevalue(which).with_suffix(".layers")
    now = read_frame(folder, 0)
    errors = reprojected(now, read_frame(folder, 1))
    cars = {name for name in errors if name.startswith("vehicle")}
    assert len(cars) >= 4 and len(errors) - len(cars) > 15
    assert max(error.max() for error in errors.values()) < 0.1
    # No flow at all would be found out: cars move, and all that stands where the camera is ridden.
    found = named(now)
    length = np.linalg.norm(now.layers["flow"], axis=-1)
    moving = errors if which == "crossing" else cars
    assert sum(length[found[name]].max() > 2.0 for name in moving) >= 4


def inside(points: np.ndarray, at: tuple[float, float, float], box: tuple[float, ...]) -> Any:
    """Where points lie in an upright box about a place: behind and before it, its half width and
    from which height to which [m]; headings are SUMO's [deg].
    """
    x, y, angle = at
    turn = np.radians(angle)
    east, north, up = np.moveaxis(points - [x, y, 0.0], -1, 0)
    ahead = east * np.sin(turn) + north * np.cos(turn)
    beside = east * np.cos(turn) - north * np.sin(turn)
    behind, before, half, low, high = box
    return (
        ((-behind < ahead) & (ahead < before)) & (np.abs(beside) < half) & (low < up) & (up < high)
    )


def known_places(
    time: float,
) -> Iterator[tuple[str, tuple[float, float, float], tuple[float, ...]]]:
    """Names, places and cores of everything in the example whose place its files say."""
    cores = {
        "vehicle": (1.3, -0.2, 0.2, 0.3, 1.2),  # from the front bumper on
        "person": (0.15, 0.15, 0.15, 0.3, 1.2),
        "tree": (0.2, 0.2, 0.2, 1.0, 2.0),
        "home": (5.0, 5.0, 5.0, 1.0, 7.0),
    }
    log = ElementTree.fromstring(gzip.decompress((CROSSING / "fcd.xml.gz").read_bytes()))
    moment = next(step for step in log if float(step.get("time", "nan")) == time)
    for user in moment:
        where = tuple(float(user.get(key, "nan")) for key in ("x", "y", "angle"))
        yield f"{user.tag}:{user.get('id')}", where, cores[user.tag]
    for kind in ("tree", "home"):
        for poi in ElementTree.parse(CROSSING / f"{kind}s.add.xml").getroot().iter("poi"):
            where = (float(poi.get("x", "nan")), float(poi.get("y", "nan")), 0.0)
            yield f"{kind}:{poi.get('id')}", where, cores[kind]


def test_whatever_stands_or_moves_where_the_files_say_has_its_own_name(crossing: Path) -> None:
    """Trees and homes are merged with hundreds of others, and most cars are far."""
    now = read_frame(crossing.with_suffix(".layers"), 0)
    points, solid = world_points(now), now.layers["depth"] > 0.0
    seen: Counter[str] = Counter()
    for name, where, core in known_places(now.time):
        own = inside(points, where, core) & solid
        if own.any():
            assert {now.things[number].name for number in now.layers["instance"][own]} == {name}
            seen[name.partition(":")[0]] += 1
    assert all(seen[kind] >= 2 for kind in ("vehicle", "person", "tree", "home"))
    # Nothing is called by the part of the scene that it was merged into but the ground itself.
    nameless = {thing.name for thing in now.things.values() if ":" not in thing.name}
    assert nameless <= {"ground", "sky"}


def test_coco_lists_the_boxes_of_all_frames(film: Path, seen: FrameLayers) -> None:
    coco = json.loads((film.with_suffix(".layers") / "coco.json").read_text("utf-8"))
    assert [image["id"] for image in coco["images"]] == [0, 1]
    first = [one for one in coco["annotations"] if one["image_id"] == 0]
    assert len(first) == len(seen.boxes2d)
    for one, box in zip(first, seen.boxes2d, strict=True):
        x, y, width, height = one["bbox"]
        assert (x, y, x + width, y + height) == (box.left, box.top, box.right, box.bottom)
    assert len({one["id"] for one in coco["annotations"]}) == len(coco["annotations"])


def test_mattes_cover_what_instances_show(film: Path, seen: FrameLayers) -> None:
    channels, words = read_channels(film.with_suffix(".layers") / "ids/000000.exr")
    manifest = json.loads(next(text for key, text in words.items() if key.endswith("/manifest")))
    layers = [channels[f"CryptoThing{k:02d}.{pair}"] for k in (0, 1, 2) for pair in "RB"]
    shares = [channels[f"CryptoThing{k:02d}.{pair}"] for k in (0, 1, 2) for pair in "GA"]
    assert np.sum(shares, axis=0).max() <= 1.0
    for name in ("vehicle:v0", "tree:t0", "edge:w"):
        number = np.uint32(int(manifest[name], 16)).view(np.float32)
        cover = sum(
            np.where(ids == number, share, 0.0) for ids, share in zip(layers, shares, strict=True)
        )
        own = named(seen)[name]
        assert (cover[own] > 0.0).mean() > 0.97
        assert cover.sum() == pytest.approx(own.sum(), rel=0.2)


def test_lamps_say_which_signals_are_lit(film: Path, seen: FrameLayers) -> None:
    # The log says `Gr` until 6 s, and the yellow that it never shows is interpolated before that.
    lit = {lamp.rpartition("/")[2] for lamp in seen.lamps if lamp.startswith("signals:m/")}
    assert lit == {"yellow", "red"}
    table = (film.with_suffix(".layers") / "lamps.csv").read_text("utf-8").splitlines()
    assert table[0] == "frame,time,lamp"
    assert sum(line.startswith("0,") for line in table) == len(seen.lamps)


def test_numbers_are_the_same_in_another_film_of_the_place(
    place: Path, seen: FrameLayers, tmp_path: Path
) -> None:
    red = '{"v1": {"colour": "#ff0000"}}'
    more = ("--set", f"vehicles.by_id={red}", "--set", "seed=3")
    layers = ["instance", "depth", "albedo", "normals"]
    assert render(place, tmp_path / "b.mp4", *more, layers=layers, to=4.2) == 0
    other = read_frame(tmp_path / "b.layers", 0)
    for name in ("instance", "depth", "normals"):
        np.testing.assert_array_equal(seen.layers[name], other.layers[name])
    changed = (seen.layers["albedo"] != other.layers["albedo"]).any(axis=-1)
    assert changed.sum() > 20
    assert not (changed & ~named(seen)["vehicle:v1"]).any()


def test_layers_are_kept_and_completed_like_frames(place: Path, film: Path, tmp_path: Path) -> None:
    path, folder = tmp_path / "c.mp4", tmp_path / "c.layers"
    layers = ["instance", "flow"]
    assert render(place, path, "--frames", "1:2", layers=layers) == 0
    assert not (folder / "instances.csv").exists()
    assert render(place, path, "--resume", layers=layers) == 0
    names = ("frames/000000.exr", "frames/000001.exr", "flow/000000.png")
    whole = film.with_suffix(".layers")
    for name in names[2:]:
        assert (folder / name).read_bytes() == (whole / name).read_bytes()
    before = {name: (folder / name).read_bytes() for name in names}
    stamps = {name: (folder / name).stat().st_mtime_ns for name in names}
    (folder / "frames/000000.json").unlink()
    assert render(place, path, "--resume", layers=layers) == 0
    assert before == {name: (folder / name).read_bytes() for name in names}
    now = {name: (folder / name).stat().st_mtime_ns for name in names}
    assert now[names[0]] > stamps[names[0]]
    assert now[names[1]] == stamps[names[1]]


def test_where_nothing_compiles_there_are_no_layers(
    place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert render(place, tmp_path / "d.mp4", "--variant", "scalar", layers=["depth"]) == 2
    assert "output.layers" in capsys.readouterr().err
