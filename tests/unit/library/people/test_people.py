"""Every look of the catalogue: people who stand and walk."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from sumo3dviz_pt.catalog import data_root, find, names
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.people.people import (
    PHASES,
    TOE_OFF,
    figure,
    measures,
    standing,
    stride_length,
    walking,
)
from sumo3dviz_pt.library.people.posture import BONES, joints, matrices

LOOKS = names("people")


@cache
def built(name: str, level: str):
    return figure(find("people", name).meta["recipe"], level)


def body_of(name: str):
    return measures(find("people", name).meta["recipe"])


def test_there_are_many_and_they_ship_no_mesh():
    assert len(LOOKS) >= 12
    folder = data_root("assets") / "people"
    assert {path.name for path in folder.rglob("*.*")} == {"asset.yaml"}
    kinds = [find("people", name).meta["recipe"]["body"] for name in LOOKS]
    assert {round(body.get("woman", 0)) for body in kinds} == {0, 1}
    assert any(body.get("child", 0) == 1 for body in kinds)


@pytest.mark.parametrize("name", LOOKS)
class TestEveryLook:
    def test_says_what_it_is(self, name):
        meta = find("people", name).meta
        assert (meta["kind"], meta["licence"]) == ("person", "BSD-3-Clause")
        assert meta["height"] == meta["recipe"]["body"]["height"]
        assert meta["share"] > 0

    @pytest.mark.parametrize(("level", "most"), [("middle", 5700), ("far", 300)])
    def test_keeps_its_budget(self, name, level, most):
        parts, poses = built(name, level)
        assert most / 3 < sum(len(part.mesh.faces) for part in parts) <= most
        count = sum(len(part.mesh.vertices) for part in parts)
        assert poses.vertices.shape == poses.normals.shape == (PHASES + 1, count, 3)

    @pytest.mark.parametrize("level", ["middle", "far"])
    def test_is_made_of_known_materials_and_wears_its_own_colour(self, name, level):
        parts, _ = built(name, level)
        assert {part.material for part in parts} <= set(MATERIALS)
        for part in parts:
            if part.tint is not None:
                assert part.tint.min() > 0
                assert part.tint.max() <= (1.3 if part.role == "own" else 0.85)

    @pytest.mark.parametrize("level", ["middle", "far"])
    def test_has_no_empty_faces_and_normals_point_outward(self, name, level):
        parts, poses = built(name, level)
        faces, first = [], 0
        for part in parts:
            faces.append(part.mesh.faces + first)
            first += len(part.mesh.vertices)
        corners = np.concatenate(faces)
        np.testing.assert_allclose(np.linalg.norm(poses.normals, axis=2), 1.0, atol=1e-6)
        for points, normals in zip(poses.vertices, poses.normals, strict=True):
            a, b, c = (points[corners[:, k]] for k in range(3))
            flat = np.cross(b - a, c - a)
            size = np.linalg.norm(flat, axis=1)
            assert size.min() > 1e-10
            agree = (flat[:, None] * normals[corners]).sum(axis=2) > 0
            assert agree.mean() > (0.96 if level == "middle" else 0.9)

    def test_closed_pieces_enclose_a_volume(self, name):
        """The whole body has the volume of a body: nothing is turned inside out."""
        parts, _ = built(name, "middle")
        volume = 0.0
        for part in parts:
            a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
            volume += (a * np.cross(b, c)).sum() / 6.0
        # A person weighs 22 times the square of the stature and is as dense as water.
        expected = 0.022 * body_of(name).height ** 2
        assert 0.6 * expected < volume < 3.5 * expected

    @pytest.mark.parametrize("level", ["middle", "far"])
    def test_stands_on_the_ground_in_every_pose(self, name, level):
        _, poses = built(name, level)
        np.testing.assert_allclose(poses.vertices[..., 2].min(axis=1), 0.0, atol=1e-9)

    def test_is_as_tall_as_it_says(self, name):
        _, poses = built(name, "middle")
        tops = poses.vertices[..., 2].max(axis=1)
        height = find("people", name).meta["height"]
        assert height - 0.03 < tops[0] < height + 0.06
        # Walking, people are lower by a few centimetres and bob by as much.
        assert (tops[1:] < tops[0] + 0.005).all()
        assert 0.01 < np.ptp(tops[1:]) < 0.06

    def test_poses_differ_and_the_last_leads_to_the_first(self, name):
        _, poses = built(name, "middle")
        ring = np.concatenate([poses.vertices[1:], poses.vertices[1:2]])
        steps = np.linalg.norm(np.diff(ring, axis=0), axis=2)
        assert (steps.max(axis=1) > 0.1).all()
        assert steps[-1].max() < 1.3 * steps[:-1].max()

    def test_a_standing_foot_does_not_slide(self, name):
        """What is on the ground in two phases has moved back by what the body walked."""
        _, poses = built(name, "middle")
        walked = stride_length(find("people", name).meta["recipe"]) / PHASES
        ring = np.concatenate([poses.vertices[1:], poses.vertices[1:2]])
        for before, after in pairwise(ring):
            down = (before[:, 2] < 0.004) & (after[:, 2] < 0.004)
            assert down.any()
            slip = (after - before)[down] + [walked, 0.0, 0.0]
            assert np.linalg.norm(slip[:, :2], axis=1).max() < 0.03

    def test_arms_swing_against_the_legs(self, name):
        body = body_of(name)
        posed = matrices(body, walking(body, 0.0))
        rest = joints(body)

        def where(joint: str) -> float:
            matrix = posed[BONES.index(joint)]
            return float((matrix[:, :3] @ rest[joint] + matrix[:, 3])[0])

        assert where("foot_r") > 0.1 > -0.1 > where("foot_l")
        assert where("hand_r") < where("hand_l")


@pytest.mark.parametrize("phase", np.linspace(0.0, 0.96, 9))
def test_bones_keep_their_lengths_and_knees_bend_forward(phase):
    body = body_of("man_jacket")
    rest = joints(body)
    for posture in (walking(body, phase), standing(body)):
        posed = dict(zip(BONES, matrices(body, posture), strict=True))
        for side in "lr":
            thigh, shank, foot = (posed[f"{n}_{side}"] for n in ("thigh", "shank", "foot"))
            for matrix in (thigh, shank, foot):
                np.testing.assert_allclose(matrix[:, :3] @ matrix[:, :3].T, np.eye(3), atol=1e-9)
            knee = rest[f"shank_{side}"]
            joined = thigh[:, :3] @ knee + thigh[:, 3]
            np.testing.assert_allclose(joined, shank[:, :3] @ knee + shank[:, 3], atol=1e-9)
            x, _, z = thigh[:, :3].T @ shank[:, 0]
            bend = np.degrees(np.arctan2(-z, x))
            assert -1.0 < bend < 75.0


def test_the_knee_moves_as_measured():
    """Winter 1991, natural cadence: 16 to 24 deg in stance, 60 to 68 deg in swing."""
    body = body_of("man_jacket")
    bends = []
    for phase in np.linspace(0.0, 1.0, 25, endpoint=False):
        posed = matrices(body, walking(body, phase))
        thigh, shank = posed[BONES.index("thigh_r")], posed[BONES.index("shank_r")]
        cosine = float(thigh[:, 2] @ shank[:, 2])
        bends.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    knee = np.array(bends)
    swing = round(TOE_OFF * 25)
    assert 8.0 < knee[2:6].max() < 28.0
    assert 55.0 < knee[swing:].max() < 72.0
    assert knee[0] < 14.0
    assert knee[7:11].min() < 12.0


def test_building_is_quick_and_the_same_every_time():
    recipe = find("people", LOOKS[0]).meta["recipe"]
    one, two = figure(recipe), figure(recipe)
    assert one[1].vertices.tobytes() == two[1].vertices.tobytes()
    for a, b in zip(one[0], two[0], strict=True):
        assert a.mesh.faces.tobytes() == b.mesh.faces.tobytes()


@pytest.mark.parametrize("key", ["top", "bottom"])
def test_unknown_garments_are_errors(key):
    recipe = {**find("people", LOOKS[0]).meta["recipe"], key: {"cut": "toga"}}
    with pytest.raises(ConfigError, match="toga"):
        figure(recipe)
