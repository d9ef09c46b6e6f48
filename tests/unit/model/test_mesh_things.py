"""Meshes say what their faces belong to."""

import numpy as np
import pytest
from builders import box

from sumo3dviz_pt.model.geometry import Mesh, Transform, belonging, merge_meshes

ONE = box((0, 0, 0), (1, 1, 1))


def test_names_survive_merging_and_moving():
    named = belonging(ONE, "tree:a")
    moved = Transform.from_pose((1, 2, 3), yaw=1.0).mesh(named)
    assert merge_meshes([moved, ONE, named]).things == (("tree:a", 12), ("", 12), ("tree:a", 12))


def test_what_has_no_names_says_nothing():
    assert merge_meshes([ONE, ONE]).things == ()


def test_names_go_with_all_faces():
    with pytest.raises(ValueError, match="more or fewer faces"):
        Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]), things=(("a", 2),))
