"""The windscreen's reflection: where it is, that no light is gained, and nothing without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import RAW, box, diffuse, frame_of, scene_of, session_of, static, view_at

from sumo3dviz_pt.image.traced import packed, unpacked
from sumo3dviz_pt.model.falling import Pane, reflectance
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.traced import TracedFrame

pytestmark = pytest.mark.usefixtures("compiled")

SIZE = (48, 27)
VIEW = view_at((0.0, 0.0, 1.2), heading=90.0, fov=40)
LAYERS = ("radiance", "albedo", "normal", "hit", "depth", "ids", "first_depth")


def raked():
    """A pane that leans back over a dashboard by half a right angle."""
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1] = (0, 1, 0), np.array([-1, 0, 1]) / np.sqrt(2.0)
    frame[:3, 2] = np.cross(frame[:3, 0], frame[:3, 1])
    frame[:3, 3] = (1.5, 0.0, 0.5)
    return Pane(Transform(frame), (4.0, 2.0))


def rendered(view, *, dash, wall=0.5, denoise="none"):
    """Layers of a dashboard under the eye, behind a pane or not, and a wall far ahead."""
    parts = [
        static("dash", box((-1.0, -3.0, 0.0), (1.4, 3.0, 0.2)), "dash"),
        static("wall", box((30.0, -50.0, -30.0), (31.0, 50.0, 50.0)), "wall"),
    ]
    scene = scene_of(parts, {"dash": diffuse(dash, dash, dash), "wall": diffuse(wall, wall, wall)})
    quality = RAW.model_copy(update={"spp": 64, "pass_spp": 64, "denoise": denoise})
    with session_of(scene, size=SIZE, quality=quality, layers=LAYERS) as session:
        state = frame_of(view)
        samples = session.samples(state)
        return session.finish(samples, state), samples


@pytest.mark.slow
def test_a_pane_lays_the_dashboard_over_the_road_and_dims_it():
    """Straight ahead the ray turns straight down, by 45 degrees."""
    pale, _ = rendered(replace(VIEW, pane=raked()), dash=0.8)
    dark, _ = rendered(replace(VIEW, pane=raked()), dash=0.0)
    clear, _ = rendered(VIEW, dash=0.8)
    middle = (SIZE[1] // 2, SIZE[0] // 2)
    share = float(reflectance(np.array([np.sqrt(0.5)]))[0])
    assert dark[middle][0] == pytest.approx((1.0 - share) * clear[middle][0], rel=0.03)
    # A matt dashboard of 0.8 under an even sky that nothing hides shines with 0.8.
    assert pale[middle][0] - dark[middle][0] == pytest.approx(0.8 * share, rel=0.15)


@pytest.mark.parametrize("pane", [None, raked()])
def test_no_light_is_gained_in_a_white_world(pane):
    """Under an even sky, nothing that is white can become brighter than the sky."""
    picture, _ = rendered(replace(VIEW, pane=pane), dash=1.0, wall=1.0)
    assert picture.mean() <= 1.0 + 1e-3
    assert picture.max() <= 1.0 + 0.06, "but for noise"


@pytest.mark.slow
def test_without_a_pane_there_is_nothing_of_it():
    _, samples = rendered(VIEW, dash=0.5)
    assert not {"reflected", "passed"} & set(samples.layers)
    _, behind = rendered(replace(VIEW, pane=raked()), dash=0.5)
    np.testing.assert_array_equal(behind.layers["radiance"], samples.layers["radiance"])
    total = behind.layers["passed"].max()
    assert 0.0 <= behind.layers["passed"].min() < total <= 1.0


def test_stored_frames_keep_the_reflection():
    _, samples = rendered(replace(VIEW, pane=raked()), dash=0.5)
    kept, text = packed(TracedFrame(samples.apart, VIEW, 1.0, 64, samples.movers))
    again = unpacked(kept, text).layers
    for name in ("reflected", "passed"):
        np.testing.assert_array_equal(again[name], samples.layers[name])
