"""What lies in a camera's view, in its picture and in its mirrors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.model.camera import CameraPath, in_mirrors, in_picture, in_view
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.shot import crowd

PLAIN = View(Transform.from_pose((5.0, 0.0, 1.2)), Lens.of_degrees(60.0))
MIRRORS = replace(PLAIN, mirrors=np.array([-1.0, 0.0, 0.0]))
PLACES = {
    "ahead": (200.0, 0.0, 0.0),
    "behind": (-200.0, 0.0, 0.0),
    "behind in the next lane": (-100.0, 4.0, 0.0),
    "near": (-20.0, 0.0, 0.0),
    "aside": (5.0, 200.0, 0.0),
    "far behind": (-700.0, 0.0, 0.0),
}
POINTS = np.array(list(PLACES.values()))


def path_of(*views):
    return CameraPath.of(views, aspect=9 / 16)


def found(which, path):
    seen = which(path, POINTS, radius=1.0).any(axis=1)
    return {name for name, there in zip(PLACES, seen, strict=True) if there}


def test_mirrors_show_what_is_behind():
    assert found(in_view, path_of(PLAIN)) == {"ahead", "near"}
    assert found(in_view, path_of(MIRRORS)) == set(PLACES) - {"aside", "far behind"}
    assert found(in_mirrors, path_of(MIRRORS)) == {
        "behind",
        "behind in the next lane",
        "near",
        "far behind",
    }
    assert found(in_picture, path_of(MIRRORS)) == {"ahead"}


def test_without_mirrors_a_path_is_what_it_was():
    path = path_of(PLAIN, PLAIN)
    assert path.behind is None and path.slice(slice(1)).behind is None
    assert found(in_mirrors, path) == set()
    assert CameraPath.all_round(POINTS).behind is None


def test_only_the_views_with_mirrors_see_behind():
    seen = in_view(path_of(PLAIN, MIRRORS), POINTS[1:2], radius=1.0)
    assert seen.tolist() == [[False, True]]


def test_what_only_mirrors_show_looks_farther_away():
    plain, mirrors = path_of(PLAIN), path_of(MIRRORS)
    away = [path.away(POINTS[:, None, :])[:, 0] for path in (plain, mirrors)]
    ahead, behind, _, near, *_ = (away[1] / away[0]).tolist()
    assert ahead == near == 1.0
    assert behind == pytest.approx((60.0 + 2.5 * 145.0) / 205.0, rel=1e-3)


@pytest.mark.parametrize(("view", "drawn"), [(PLAIN, False), (MIRRORS, True)])
def test_a_car_behind_is_drawn_for_mirrors_alone(view, drawn):
    alive = np.ones((1, 1), dtype=bool)
    chosen = crowd.choose(path_of(view), alive, POINTS[1:2, None], limit=10)
    assert bool((chosen.near | chosen.far).any()) is drawn
