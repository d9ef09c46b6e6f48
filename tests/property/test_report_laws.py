"""Laws of the error measures and of the flow."""

import numpy as np
from builders import frame_of, view_at
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from searching import tries

from sumo3dviz_pt.image.metrics import mean_bias, psnr, ssim
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import Mover, View
from sumo3dviz_pt.report.films.flicker import SeenFrame, flicker, flow_between

SHAPES = st.tuples(st.integers(1, 16), st.integers(1, 16), st.just(3))
PICTURES = hnp.arrays(np.float32, SHAPES, elements=st.floats(0, 1, width=32))
GREY = (0.5, 0.5, 0.5)


@settings(deadline=None)
@given(picture=PICTURES, seed=st.integers(0, 99), mix=st.floats(0, 1))
def test_ssim_is_bounded_symmetric_and_one_only_for_equals(picture, seed, mix):
    other = np.random.default_rng(seed).uniform(0, 1, picture.shape).astype(np.float32)
    other = np.float32(mix) * other + np.float32(1 - mix) * picture
    value = ssim(picture, other)
    assert -1 <= value <= 1
    assert abs(value - ssim(other, picture)) < 1e-12
    assert ssim(picture, picture) == 1
    inner = tuple(slice(5, -5) if side > 10 else slice(None) for side in picture.shape[:2])
    luma = (picture[inner].astype(float) - other[inner]) @ [0.2126, 0.7152, 0.0722]
    if np.abs(luma).max() > 0.02:
        assert value < 1


@given(picture=PICTURES, scale=st.floats(0.1, 10))
def test_scaling_is_bias(picture, scale):
    picture = picture + np.float32(0.1)
    assert abs(mean_bias(np.float32(scale) * picture, picture) - (scale - 1)) < 1e-5 * scale


@given(picture=PICTURES)
def test_psnr_of_equals_is_infinite(picture):
    assert psnr(picture, picture) == np.inf


COORDINATE = st.floats(-3000, 3000)
VIEWS = st.builds(
    lambda x, y, z, heading, pitch, fov: view_at([x, y, z], heading=heading, pitch=pitch, fov=fov),
    COORDINATE,
    COORDINATE,
    st.floats(0, 2000),
    st.floats(0, 360),
    st.floats(-90, 90),
    st.floats(5, 150),
)
DEPTHS = hnp.arrays(
    np.float64, (7, 9), elements=st.one_of(st.floats(0.1, 5000), st.just(float("inf")))
)


@settings(deadline=None)
@given(view=VIEWS, depth=DEPTHS, yaw=st.floats(-7, 7))
def test_flow_of_a_still_scene_is_the_identity(view, depth, yaw):
    """Whatever is seen, and wherever road users stand, as long as nothing moves."""
    place = view.position + 10 * view.forward
    one = Mover("a", "body", Transform.from_pose(place, yaw=yaw, scale=[2, 1, 1]), GREY)
    seen = SeenFrame(frame_of(view, movers=[one]), depth)
    flow = flow_between(seen, seen, {"body": np.array([[-4.0, -1, 0], [0, 1, 1.5]])})
    assert flow.valid.all()
    np.testing.assert_allclose(flow.places, np.indices((7, 9)), atol=1e-6)


@settings(deadline=None, max_examples=tries(50))
@given(
    seed=st.integers(0, 10**6),
    shift=st.tuples(COORDINATE, COORDINATE),
    turn=st.floats(-3, 3),
)
def test_flow_does_not_depend_on_the_frame_of_reference(seed, shift, turn):
    """The world with camera and road user moved rigidly gives the same flow."""
    rng = np.random.default_rng(seed)
    # A wall across the view, in part on the road user.
    depth = rng.uniform(5, 12) * (1 + 0.004 * np.indices((18, 32)).sum(axis=0))
    boxes = {"body": np.array([[-2.0, -1.5, 0], [2, 1.5, 3]])}
    flows = []
    for place in (Transform(np.eye(4)), Transform.from_pose([*shift, 0.0], yaw=turn)):
        frames = []
        for step in (0.0, 0.3):
            eye = Transform.from_pose([step / 3, 0.1, 1.5], pitch=-0.1)
            car = Transform.from_pose([8 + step, 0.4, 0.1], yaw=0.3)
            body = Mover("a", "body", place @ car, GREY)
            frames.append(frame_of(View(place @ eye, Lens(1.0)), movers=[body]))
        flows.append(flow_between(SeenFrame(frames[1], depth), SeenFrame(frames[0], depth), boxes))
    assert flows[0].valid.mean() > 0.3
    np.testing.assert_array_equal(flows[0].valid, flows[1].valid)
    np.testing.assert_allclose(flows[0].places, flows[1].places, atol=1e-6)


@given(picture=hnp.arrays(np.float32, (7, 9, 3), elements=st.floats(0, 1, width=32)))
def test_a_still_film_does_not_flicker(picture):
    view = view_at([0, 0, 2])
    seen = SeenFrame(frame_of(view), np.full((7, 9), 10.0))
    result = flicker(picture, picture, flow_between(seen, seen, {}))
    assert result.share == 1 and result.codes < 1e-3
