"""Street lamps, signs, letters and furniture as meshes."""

import numpy as np
import pytest

from sumo3dviz_pt.library.street import furniture, signs
from sumo3dviz_pt.library.street.lettering import GLYPHS, lettering
from sumo3dviz_pt.library.street.strokes import (
    arrow,
    disc,
    fan,
    regular,
    ribbon,
    ring,
)

BOARDS = [
    (3.0, signs.board(("NORD", "HAFEN"), "down")),
    (-3.0, signs.board(("A",), "exit")),
]
THINGS = {
    **{f"{name}/{level}": make(level) for name, make in furniture.FURNITURE.items()
       for level in (0, 1)},
    **{name: make() for name, make in signs.SIGNS.items()},
    "limit 30": signs.speed_limit(30),
    "limit 120": signs.on_post(signs.speed_limit(120)),
    "far sign": signs.on_post(signs.stop(), level=1),
    "exit": signs.exit_board(("EXIT",)),
    "portal": signs.gantry(6.0, -6.0, BOARDS, portal=True),
    "arm": signs.gantry(6.0, -6.0, BOARDS, portal=False),
}  # fmt: skip


def area(flat):
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def check(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    assert np.linalg.norm(flat, axis=1).min() > 1e-10
    assert ((flat[:, None] * mesh.normals[mesh.faces]).sum(axis=2) > 0).mean() > 0.999
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize("name", THINGS)
def test_faces_have_an_area_and_agree_with_their_normals(name):
    for part in THINGS[name]:
        check(part.mesh)
        if part.tint is not None:
            assert part.tint.min() >= 0.0 and part.tint.max() <= 0.85


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("height", [8.0, 10.0])
def test_lamps_hang_at_their_height_over_the_road(height, level):
    pole, head = furniture.pole(height, level=level), furniture.head(height, level=level)
    for mesh in (pole, head):
        check(mesh)
    lens = furniture.lens(height)
    check(lens)
    assert np.all(lens.vertices[:, 2] == height)
    assert head.bounds[0, 2] > height, "the lens hangs free below its case"
    assert head.bounds[0, 0] < lens.bounds[0, 0] and head.bounds[1, 0] > lens.bounds[1, 0]
    assert pole.bounds[0, 2] == pytest.approx(-0.5, abs=0.02)
    assert len(pole.faces) + len(head.faces) < (460, 130, 60)[level]


@pytest.mark.parametrize("character", [c for c in GLYPHS if c != " "])
def test_every_letter_is_drawn_within_its_height(character):
    flat = lettering(character, height=0.3)
    assert (area(flat) > 0).all()
    assert np.abs(flat[..., 1]).max() < 0.3 * (0.62 if character.isupper() else 0.86)
    assert 0.0016 < area(flat).sum() < 0.09


def test_text_is_centred_and_unknown_letters_are_errors():
    flat = lettering("NORD 5", height=0.3)
    u = flat[..., 0]
    assert u.min() == pytest.approx(-u.max())
    with pytest.raises(KeyError):
        lettering("?", height=1.0)


def test_flat_figures_have_their_area():
    assert area(disc(1.0, sides=64)).sum() == pytest.approx(np.pi, rel=0.01)
    assert area(fan(regular(1.0, sides=4))).sum() == pytest.approx(2.0)
    annulus = ring(regular(2.0, sides=4), regular(1.0, sides=4))
    assert area(annulus).sum() == pytest.approx(6.0)
    assert area(ribbon(np.array([(0.0, 0), (3, 0)]), 0.5)).sum() == pytest.approx(1.5)
    assert arrow(2.0, 1.0)[..., 1].max() == pytest.approx(1.0)
    assert (area(arrow(2.0, 1.0, turn=1.0)) > 0).all()


def test_signs_face_the_traffic_and_do_not_mirror_their_text():
    (post, *_, face) = signs.on_post(signs.speed_limit(120))
    assert (face.mesh.normals[:, 0] < 0).all()
    assert face.mesh.vertices[:, 0].max() < post.mesh.bounds[0, 0]
    dark = face.mesh.vertices[face.mesh.faces[face.tint[:, 0] < 0.1]]
    # The reader's left is +y: there stands the slim 1, at the right the wide 0.
    ys = dark[..., 1].reshape(-1)
    assert (ys > 0.1).sum() < (ys < -0.1).sum()


def test_gantries_leave_room_below():
    for name in ("portal", "arm"):
        for part in THINGS[name]:
            inside = part.mesh.vertices[np.abs(part.mesh.vertices[:, 1]) < 5.0]
            assert not len(inside) or inside[:, 2].min() > 4.7
    left = [p.mesh.vertices[p.mesh.vertices[:, 1] > 5.0] for p in THINGS["arm"]]
    assert min(v[:, 2].min() for v in left if len(v)) > 4.7


def test_furniture_reaches_into_the_ground_and_far_pieces_are_cheaper():
    for name in furniture.FURNITURE:
        near, far = THINGS[f"{name}/0"], THINGS[f"{name}/1"]
        low = min(part.mesh.bounds[0, 2] for part in near)
        assert low <= 0.0, name
        assert sum(len(p.mesh.faces) for p in far) <= sum(len(p.mesh.faces) for p in near)
