"""Flow and flicker, on worlds of boxes whose depth pictures are known exactly."""

import numpy as np
import pytest
from builders import (
    box,
    constant_sky,
    cube,
    diffuse,
    frame_of,
    joined,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)

from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.library.materials import matt
from sumo3dviz_pt.model.geometry import Mesh, Transform
from sumo3dviz_pt.model.scene import Mover, Part, Prototype, Slots
from sumo3dviz_pt.report.films.flicker import (
    Flow,
    SeenFrame,
    body_bounds,
    flicker,
    flow_between,
    warped,
)

SIZE = (64, 36)
BODIES = body_bounds({"cube": cube()})
GREY = (0.5, 0.5, 0.5)


def cast(view, movers=(), *, ground=True, size=SIZE):
    """Distance to the ground z = 0 and to cubes of 2 m, exactly; and what was hit.

    Returns:
        Distance, (h, w) [m], and the hit mover's index, -1 for the ground, -2 for sky.
    """
    rays = view.directions(size)
    with np.errstate(divide="ignore", invalid="ignore"):
        down = -view.position[2] / rays[..., 2]
        depth = np.where(ground & (down > 0), down, np.inf)
        hit = np.where(np.isfinite(depth), -1, -2)
        for index, one in enumerate(movers):
            body_from_world = np.linalg.inv(one.world_from_body.matrix)
            eye = body_from_world[:3, :3] @ view.position + body_from_world[:3, 3]
            towards = rays @ body_from_world[:3, :3].T
            low, high = BODIES["cube"]
            first, second = (low - eye) / towards, (high - eye) / towards
            near = np.minimum(first, second).max(axis=-1)
            far = np.maximum(first, second).min(axis=-1)
            closer = (near > 0) & (near <= far) & (near < depth)
            depth, hit = np.where(closer, near, depth), np.where(closer, index, hit)
    return depth, hit


def seen(view, movers=(), *, ground=True, size=SIZE, far=()):
    """A frame with its exact depth."""
    depth = cast(view, (*movers, *far), ground=ground, size=size)[0]
    return SeenFrame(frame_of(view, movers=movers, far=far), depth)


def place_of(view, points, size=SIZE):
    """Row and column of world points, (..., 3), by the pinhole's formula [px]."""
    local = (points - view.position) @ view.world_from_camera.matrix[:3, :3]
    focal = size[0] / 2 / view.lens.half_width
    row = (size[1] - 1) / 2 - focal * local[..., 2] / local[..., 0]
    return np.stack([row, (size[0] - 1) / 2 - focal * local[..., 1] / local[..., 0]])


def points_of(one):
    """World points that a frame shows, (h, w, 3)."""
    size = one.depth.shape[::-1]
    return one.frame.view.position + one.frame.view.directions(size) * one.depth[..., None]


def identity(size=SIZE):
    return np.indices(size[::-1]).astype(float)


def still_flow(size=SIZE):
    return Flow(identity(size), np.ones(size[::-1], dtype=bool))


# Flow --------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(64, 36), (1, 1), (8, 8), (3, 20)])
@pytest.mark.parametrize("pitch", [-30, 0, 60, 90])
def test_nothing_moves_where_nothing_moves(pitch, size):
    """Whatever the camera looks at: ground, horizon, sky, zenith."""
    one = seen(view_at([1000.3, -2000.7, 2], heading=37, pitch=pitch), size=size)
    flow = flow_between(one, one, {})
    assert flow.valid.all()
    np.testing.assert_allclose(flow.places, identity(size), atol=1e-6)


@pytest.mark.parametrize("step", [(0.5, 0, 0), (0, 0.3, 0), (0.4, -0.2, 0.1)])
@pytest.mark.parametrize("turn", [0, 3])
def test_the_ground_moves_by_its_homography(step, turn):
    """Hartley and Zisserman, 2004, section 13.1: H = K (R - t n^T / d) K^-1."""
    now = seen(view_at([5, 6, 3], heading=20 + turn, pitch=-25), ground=True)
    before = seen(view_at(np.subtract([5, 6, 3], step), heading=20, pitch=-25))
    flow = flow_between(now, before, {})
    focal = SIZE[0] / 2 / np.tan(np.radians(30))
    to_pixels = np.array(
        [[(SIZE[0] - 1) / 2, -focal, 0], [(SIZE[1] - 1) / 2, 0, -focal], [1, 0, 0]]
    )
    view, past = now.frame.view, before.frame.view
    axes, past_axes = (v.world_from_camera.matrix[:3, :3] for v in (view, past))
    # A ground point p of the camera's frame fulfils n.p = -height, n the world's up.
    normal, height = axes.T @ [0, 0, 1], view.position[2]
    moved = past_axes.T @ (axes - np.outer(view.position - past.position, normal) / height)
    homography = to_pixels @ moved @ np.linalg.inv(to_pixels)
    rows, columns = identity()
    column, row, weight = np.moveaxis(
        np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ homography.T, -1, 0
    )
    assert flow.valid.mean() > 0.7
    expected = np.stack([row / weight, column / weight])
    error = np.abs(flow.places - expected)[:, flow.valid]
    assert error.max() < 0.01


@pytest.mark.parametrize("degrees", [-4.0, 0.5, 4.0])
def test_the_sky_turns_with_the_camera(degrees):
    """The middle of the picture moves by f tan(angle), however far the camera went."""
    size = (65, 37)
    now = seen(view_at([100, 0, 5], heading=90, pitch=0), ground=False, size=size)
    before = seen(view_at([0, 50, 5], heading=90 - degrees, pitch=0), ground=False, size=size)
    flow = flow_between(now, before, BODIES)
    focal = size[0] / 2 / np.tan(np.radians(30))
    expected = 32 + focal * np.tan(np.radians(degrees))
    np.testing.assert_allclose(flow.places[:, 18, 32], [18, expected], atol=1e-9)
    assert flow.valid[18, 32]
    left_out = flow.valid.size - flow.valid.sum()
    assert 0 < left_out < 8 * size[1]


@pytest.mark.parametrize("far", [False, True])
@pytest.mark.parametrize("yaw", [0.0, 0.4])
def test_pixels_of_a_mover_follow_it(yaw, far):
    """Also when it turns, is scaled, and the camera moves at the same time."""
    now_place = Transform.from_pose([16, 0.5, 0], yaw=yaw, scale=[1.5, 1, 0.8])
    past_place = Transform.from_pose([15.2, 0.3, 0], yaw=yaw - 0.05, scale=[1.5, 1, 0.8])
    one, past = (Mover("a", "cube", place, GREY) for place in (now_place, past_place))
    views = view_at([5, 0.2, 2], heading=90, pitch=-5), view_at([4.7, 0, 2], heading=91, pitch=-5)
    name = "far" if far else "movers"
    now, before = seen(views[0], **{name: (one,)}), seen(views[1], **{name: (past,)})
    flow = flow_between(now, before, BODIES)
    motion = past_place.matrix @ np.linalg.inv(now_place.matrix)
    with np.errstate(invalid="ignore"):
        points = points_of(now)
        carried = Transform(motion).points(points)
        expected = {0: place_of(views[1], carried), -1: place_of(views[1], points)}
    hit = cast(views[0], (one,))[1]
    for index, places in expected.items():
        own = flow.valid & (hit == index)
        # A strip of about 1 px along the silhouette is left out.
        assert own.sum() > 0.6 * (hit == index).sum() > 50
        assert np.abs(flow.places - places)[:, own].max() < 0.01
    assert np.median(np.abs(expected[0] - expected[-1])[1][hit == 0]) > 0.2


def test_who_was_not_there_before_is_left_out():
    view = view_at([0, 0, 2], heading=90, pitch=-5)
    new = mover("new", [9, 0, 0], GREY)
    now, before = seen(view, [new]), seen(view)
    flow = flow_between(now, before, BODIES)
    hit = cast(view, [new])[1]
    assert not flow.valid[hit == 0].any()
    assert flow.valid[hit != 0].all()
    # Not even where the depth happens to agree.
    same = SeenFrame(before.frame, now.depth)
    assert not flow_between(now, same, BODIES).valid[hit == 0].any()


def test_what_was_hidden_before_is_left_out():
    view = view_at([0, 0, 2], heading=90, pitch=-5)
    one, past = mover("a", [9, -1.5, 0], GREY), mover("a", [9, 1.5, 0], GREY)
    now, before = seen(view, [one]), seen(view, [past])
    flow = flow_between(now, before, BODIES)
    hit, past_hit = cast(view, [one])[1], cast(view, [past])[1]
    uncovered = (past_hit == 0) & (hit != 0)
    # Road at the foot of the body lies as far away as the body did.
    assert uncovered.sum() > 50 and flow.valid[uncovered].mean() < 0.08
    assert flow.valid[(past_hit != 0) & (hit == -1)].all()


def test_the_road_below_a_body_stays():
    """The shadow under a car does not drive; the flow of the ground is that of a still camera."""
    view = view_at([0, 0, 2], heading=90, pitch=-10)
    depth = cast(view)[0]
    here, there = (frame_of(view, movers=[mover("a", [x, 0, 0], GREY)]) for x in (9.0, 8.0))
    flow = flow_between(SeenFrame(here, depth), SeenFrame(there, depth), BODIES)
    assert flow.valid.all()
    np.testing.assert_allclose(flow.places, identity(), atol=1e-6)


def test_a_camera_inside_its_own_body():
    """The rider's vehicle stays where it is on screen, the road runs by."""
    places = [Transform.from_pose([x, 0, 0], scale=[4, 2, 2]) for x in (10.0, 9.5)]
    ego = [Mover("ego", "cube", place, GREY) for place in places]
    views = [view_at([x - 4, 0, 2], heading=90, pitch=-35) for x in (10.0, 9.5)]
    depths = [cast(view)[0].copy() for view in views]
    for depth in depths:
        depth[:, :20] = 2.0
    now, before = (
        SeenFrame(frame_of(v, movers=[e]), d) for v, e, d in zip(views, ego, depths, strict=True)
    )
    flow = flow_between(now, before, BODIES)
    inside, road = np.s_[5:-5, 2:18], np.s_[12:, 30:]
    assert flow.valid[inside].all()
    np.testing.assert_allclose(flow.places[:, *inside], identity()[:, *inside], atol=1e-6)
    assert (flow.places[0] - identity()[0])[road].max() < -0.5


@pytest.mark.slow
def test_three_hundred_movers_do_not_disturb_each_other():
    view = view_at([-5, 0, 8], heading=90, pitch=-15)
    spots = [(4.0 * (k // 15), 3.0 * (k % 15 - 7), 0.0) for k in range(300)]
    steps = np.random.default_rng(4).uniform(-0.4, 0.4, (300, 2))
    now = [mover(f"m{k}", spot, GREY) for k, spot in enumerate(spots)]
    past = [
        mover(f"m{k}", np.subtract(spot, (*step, 0)), GREY)
        for k, (spot, step) in enumerate(zip(spots, steps, strict=True))
    ]
    size = (160, 90)
    here, there = seen(view, now, size=size), seen(view, past, size=size)
    flow = flow_between(here, there, BODIES)
    hit = cast(view, now, size=size)[1]
    bodies = hit >= 0
    carried = points_of(here)[bodies]
    carried[:, :2] -= steps[hit[bodies]]
    own = flow.valid[bodies]
    error = np.abs(flow.places[:, bodies] - place_of(view, carried, size).reshape(2, -1))
    assert own.mean() > 0.5 and error[:, own].max() < 0.01


def test_bounds_hold_near_and_far_bodies():
    near, far = Part(box((-4, -1, 0), (0, 1, 1)), "a"), Part(box((-3, -1.2, 0.1), (0.2, 1, 2)), "a")
    nothing = Part(Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), "a")
    bodies = {"car": Prototype("car", (near, nothing), (far,)), "ghost": Prototype("ghost", (), ())}
    bounds = body_bounds(bodies)
    assert set(bounds) == {"car"}
    np.testing.assert_allclose(bounds["car"], [[-4, -1.2, 0], [0.2, 1, 2]])


def test_sizes_must_match():
    one, other = seen(view_at([0, 0, 2])), seen(view_at([0, 0, 2]), size=(32, 36))
    with pytest.raises(ValueError, match="against"):
        flow_between(one, other, {})
    picture = np.zeros((36, 64, 3), dtype=np.float32)
    with pytest.raises(ValueError, match="and a flow of"):
        flicker(picture, picture[:-1], still_flow())


# Flicker -----------------------------------------------------------------------------------


def noise(seed, sigma=0.03, size=(200, 150)):
    values = 0.5 + sigma * np.random.default_rng(seed).standard_normal((*size[::-1], 3))
    return values.astype(np.float32)


def test_equal_pictures_do_not_flicker():
    assert flicker(noise(1), noise(1), still_flow((200, 150))).codes == 0.0


def test_no_valid_pixel_gives_no_number():
    flow = Flow(identity(), np.zeros(SIZE[::-1], dtype=bool))
    result = flicker(noise(1, size=SIZE), noise(2, size=SIZE), flow)
    assert np.isnan(result.codes) and result.share == 0


@pytest.mark.parametrize("sigma", [0.005, 0.03])
@pytest.mark.parametrize("order", [0, 1, 3])
def test_white_noise_flickers_by_its_sigma(sigma, order):
    """E|a - b| = 2 sigma / sqrt(pi) for Gaussian a and b."""
    pictures = noise(1, sigma), noise(2, sigma)
    result = flicker(*pictures, still_flow((200, 150)), order=order)
    assert result.codes == pytest.approx(255 * 2 * sigma / np.sqrt(np.pi), rel=0.01)
    assert result.share == 1


@pytest.mark.parametrize(("order", "found"), [(0, 1.0), (1, 0.85), (3, 0.945)])
def test_noise_between_pixels_is_found_as_documented(order, found):
    """Places at random within pixels average the noise of the picture before."""
    size, sigma = (200, 150), 0.03
    places = identity(size) + np.random.default_rng(9).uniform(-0.5, 0.5, (2, *size[::-1]))
    flow = Flow(places, np.ones(size[::-1], dtype=bool))
    codes = flicker(noise(1, sigma), noise(2, sigma), flow, order=order).codes
    assert codes == pytest.approx(found * 255 * 2 * sigma / np.sqrt(np.pi), rel=0.01)


# Renderings --------------------------------------------------------------------------------


def boxes(count=300):
    """Boxes and slabs in two colours on both sides of a road to the east."""
    rng = np.random.default_rng(12)
    for number in range(count):
        x, y = rng.uniform(1, 60), rng.uniform(-12, 12)
        width, height = rng.uniform(0.3, 1.2), 0.05
        if abs(y) > 3:
            height = rng.choice([0.05, 0.5, 2.0])
        mesh = box((x, y, 0.0), (x + width, y + width, height))
        yield static(f"box{number}", mesh, "dark" if number % 2 else "light")


def striped_cube():
    """A red cube with bright bars on its rear."""
    bars = joined(*(box((-2.02, y, 0.1), (-1.99, y + 0.3, 1.9)) for y in (-0.8, -0.1, 0.5)))
    parts = (*cube().parts, Part(bars, "light"))
    return Prototype("cube", parts, parts)


@pytest.mark.slow
def test_a_rendered_film_is_followed():
    """Depth and cameras of the renderer fit the flow; a cube drives, the camera too."""
    materials = {"dark": diffuse(0.08, 0.1, 0.15), "light": diffuse(0.8), "road": diffuse(0.35)}
    scene = scene_of(
        [*boxes(), static("road", plane(100.0, centre=(30, 0)), "road")],
        materials | {"matt_tint": matt({"type": "tint"})},
        sky=constant_sky(0.7),
        prototypes=[striped_cube()],
        slots=Slots(near={"cube": 2}),
    )
    frames = [
        frame_of(
            view_at([x, 0.2, 1.8], heading=heading, pitch=-4),
            time=time,
            movers=[mover("a", [12 + step, step, 0], (0.7, 0.1, 0.1), yaw=step / 4)],
        )
        for time, x, heading, step in ((0.0, 0.0, 90.0, 0.0), (0.04, 0.4, 91.0, 0.5))
    ]
    size, quality = (96, 54), Quality(spp=64, pass_spp=64, max_depth=2, denoise="none")
    with session_of(scene, size=size, quality=quality) as session:
        shots = [session.samples(frame) for frame in frames]
    before, present = (
        SeenFrame(frame, shot.distance) for frame, shot in zip(frames, shots, strict=True)
    )
    then, now = (develop_float(shot.layers["radiance"]) for shot in shots)
    flow = flow_between(present, before, body_bounds(scene.prototypes))
    followed, unmoved = (
        flicker(now, then, flow),
        flicker(now, then, Flow(identity(size), flow.valid)),
    )
    assert followed.share > 0.8
    assert followed.codes < 0.5 * unmoved.codes
    own = flow.valid & (cast(frames[1].view, frames[1].movers, size=size)[1] == 0)
    assert own.sum() > 100
    carried, left = (np.abs(now - picture)[own].mean() for picture in (warped(then, flow), then))
    assert carried < 0.3 * left
