"""Contact sheets: every exhibit in a picture of its own."""

import matplotlib.image
import numpy as np
import pytest
from builders import box, diffuse

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.inspection.catalogue import (
    SKIES,
    SheetOrder,
    _exposed,
    _view_of,
    draw_sheet,
    sheet_files,
    sheet_names,
)
from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.progress import Doing, ProgressEvent, heard_by
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.shot import showroom
from sumo3dviz_pt.shot.showroom import Exhibit, still_life
from sumo3dviz_pt.world.sky import build_sky

SIZE = (96, 54)


def block(title, colour, *, low=(-4.0, -1.0, 0.0), high=(0.0, 1.0, 1.5)):
    return Exhibit(title, (Part(box(low, high), title),), {title: diffuse(*colour)})


def two_blocks():
    yield block("red", (0.7, 0.05, 0.05))
    yield block("blue", (0.05, 0.05, 0.7))


def test_sheets_have_names():
    assert {"vehicles", "levels", "people", SKIES} <= set(sheet_names())


def test_sheets_go_into_a_folder_or_one_into_a_picture(tmp_path):
    assert sheet_files([])[SKIES].name == "sheet_skies.png"
    assert sheet_files(["people"], into=tmp_path) == {"people": tmp_path / "sheet_people.png"}
    new = tmp_path / "new.folder"
    assert sheet_files(["people"], into=new) == {"people": new / "sheet_people.png"}
    assert sheet_files(["people"], into=tmp_path / "x.PNG") == {"people": tmp_path / "x.PNG"}


@pytest.mark.parametrize(
    ("chosen", "name", "words"),
    [
        ([], "x.png", "one sheet only; name one of vehicles"),
        (["people", "trees"], "x.png", "one sheet only; name one of people, trees"),
        (["people"], "x.jpg", "must end in .png"),
        (["people"], "no/x.png", "create it first"),
    ],
)
def test_a_picture_holds_one_sheet(chosen, name, words, tmp_path):
    with pytest.raises(ConfigError, match=words):
        sheet_files(chosen, into=tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((-4.0, -1.0, 0.0), (0.0, 1.0, 1.5)),
        ((-60.0, -1.5, 0.0), (0.0, 1.5, 4.0)),
        ((-0.2, -0.2, 0.0), (0.2, 0.2, 12.0)),
        ((-4.0, -4.0, 0.0), (4.0, 4.0, 0.05)),
    ],
    ids=["car", "train", "post", "slab"],
)
def test_the_whole_exhibit_is_in_the_picture_and_fills_it(low, high):
    at = np.array([360.0, 0.0, 0.0])
    view = _view_of(block("red", (0.5,) * 3, low=low, high=high), at=at, aspect=9 / 16)
    mesh = Transform.from_pose(at).mesh(box(low, high))
    local = np.linalg.inv(view.world_from_camera.matrix)
    corners = mesh.vertices @ local[:3, :3].T + local[:3, 3]
    assert (corners[:, 0] > 0.0).all()
    across = np.abs(corners[:, 1] / corners[:, 0]) / view.lens.half_width
    upward = np.abs(corners[:, 2] / corners[:, 0]) / view.lens.half_width * 16 / 9
    assert 0.6 < max(across.max(), upward.max()) <= 1.0
    assert view.position[2] >= 0.4


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_still_life_stands_before_the_eye(yaw):
    life = still_life(yaw)
    assert {part.material for part in life.parts} <= set(life.materials)
    ahead = np.array([np.cos(yaw), np.sin(yaw)])
    for part in life.parts:
        if part.material not in ("ground_grass", "asphalt", "line"):
            places = part.mesh.vertices[:, :2] @ ahead
            assert places.min() > 5.0 and places.max() < 60.0
            assert part.mesh.bounds[0, 2] > -2.5


@pytest.mark.parametrize("name", [n for n in catalog.template_names("sky") if "night" in n])
@pytest.mark.parametrize("light", [1e-7, 1e-3])
def test_nights_are_exposed_by_what_is_seen(name, light):
    sky = build_sky(SkySettings(preset=name))
    picture = _exposed(np.full((4, 4, 3), light, np.float32), sky)
    assert 20 < picture.mean() < 130


@pytest.mark.slow
def test_a_sheet_shows_each_exhibit_with_its_title(tmp_path, monkeypatch):
    monkeypatch.setitem(showroom.FAMILIES, "blocks", two_blocks)
    path = tmp_path / "new" / "sheet.png"
    seen = []
    with heard_by(seen.append):
        draw_sheet(SheetOrder("blocks", path, SIZE, "draft"))
    assert seen == [ProgressEvent(Doing.DRAW, done, 2, "blocks") for done in (1, 2)]
    picture = matplotlib.image.imread(path)[..., :3]
    left, right = (part.reshape(-1, 3).mean(axis=0) for part in np.array_split(picture, 2, axis=1))
    assert left[0] - left[2] > right[0] - right[2] + 0.1


def test_unknown_sheets_are_refused(tmp_path):
    path = tmp_path / "sheet.png"
    with pytest.raises(ConfigError, match="did you mean 'people'"):
        draw_sheet(SheetOrder("peple", path))
    assert not path.exists()
