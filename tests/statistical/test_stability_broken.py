"""NaN and Inf are counted, reported and fatal; crooked input stays finite."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from builders import (
    RAW,
    ball,
    box,
    constant_sky,
    cube,
    diffuse,
    frame_of,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
    write_scenario,
)

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.library.materials import MATERIALS, matt
from sumo3dviz_pt.model.geometry import Mesh, Transform
from sumo3dviz_pt.model.scene import LampSet, Sky, Slots
from sumo3dviz_pt.pipeline.live import render_still
from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

MATERIALS_HERE = {**MATERIALS, "grey": diffuse(0.5)}
GROUND = static("ground", plane(40), "grey")
EYE = view_at([0, 0, 2], pitch=-10)
DENOISED = RAW.model_copy(update={"cap": 40.0, "denoise": "high"})


def spoilt_sky(value):
    """One texel of an image sky."""
    image = np.full((16, 32, 3), 0.3, dtype=np.float32)
    image[3, 4] = value
    return scene_of([GROUND], MATERIALS_HERE, sky=Sky(None, image=image)), {}


def spoilt_lamp(value):
    """A lamp on the ground."""
    lamp = LampSet("signals", "signals", plane(1, centre=(0, 10), z=0.5), [0, 0], ("a",))
    scene = scene_of([GROUND], MATERIALS_HERE, lamps=[lamp])
    return scene, {"lamps": {"signals": np.full((1, 3), value)}}


def spoilt_tint(value):
    """The colours of a painted box."""
    tint = np.full((12, 3), value)
    crate = static("box", box((-2, 8, 0), (2, 10, 2)), "paint", tint)
    return scene_of([crate, GROUND], MATERIALS_HERE), {}


@pytest.mark.parametrize(
    ("value", "quality"), [(np.nan, RAW), (np.inf, DENOISED)], ids=["raw", "capped and denoised"]
)
@pytest.mark.parametrize("spoilt", [spoilt_sky, spoilt_lamp, spoilt_tint])
def test_a_scene_that_makes_nan_or_inf_is_refused(spoilt, quality, value, caplog):
    """The error gives their number; the log warns; no picture comes out."""
    scene, more = spoilt(value)
    with (
        session_of(scene, quality=quality) as session,
        caplog.at_level(logging.WARNING),
        pytest.raises(RenderError, match=r"\d+ pixel values of 1 passes are NaN or infinite"),
    ):
        session.render(frame_of(EYE, **more))
    assert "pixel values were not finite" in caplog.text


def speck(*, pixels, size):
    """A broken lamp that fills some pixels of a row, and nothing else."""
    lens = EYE.lens.half_width * 2 * 10 / size[0]
    middle = np.array([0.5 * lens, 10.0, 2.0 + 0.5 * lens])
    corners = [
        np.add(middle, (x * lens, 0.0, z * lens))
        for x, z in ((-0.4, -0.4), (pixels - 0.6, -0.4), (pixels - 0.6, 0.4), (-0.4, 0.4))
    ]
    mesh = Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))
    lamp = LampSet("signals", "signals", mesh, [0, 0], ("a",))
    return scene_of([], MATERIALS_HERE, lamps=[lamp])


@pytest.mark.parametrize(("pixels", "fails"), [(1, False), (2, True)])
def test_one_broken_pixel_in_a_hundred_thousand_is_the_limit(pixels, fails, caplog):
    """It is black, counted and logged; a second one is an error."""
    size = (400, 270)  # 1e-5 of them is 1.08
    frame = frame_of(view_at([0, 0, 2]), lamps={"signals": np.full((1, 3), np.nan)})
    quality = RAW.model_copy(update={"spp": 4, "pass_spp": 4, "max_depth": 2})
    with session_of(speck(pixels=pixels, size=size), size=size, quality=quality) as session:
        if fails:
            with pytest.raises(RenderError, match="2 pixel values of 1 passes"):
                session.render(frame)
            return
        with caplog.at_level(logging.WARNING):
            rendered = session.render(frame)
    assert rendered.tally.nonfinite == 1 and "1 pixel values were not finite" in caplog.text
    assert np.isfinite(rendered.radiance).all()
    assert (rendered.radiance == 0).all(axis=-1).sum() == 1


# Crooked geometry ---------------------------------------------------------------------------


def crooked(kind):
    """A ball with something wrong."""
    mesh = ball((0, 9, 1), 1.0)
    vertices, faces, normals = mesh.vertices.copy(), mesh.faces.copy(), mesh.normals.copy()
    if kind == "faces without area":
        faces[::3, 1] = faces[::3, 0]
    elif kind == "nothing but faces without area":
        return Mesh(vertices, np.repeat(faces[:, :1], 3, axis=1))
    elif kind == "normals of no length":
        normals[:] = 0.0
    elif kind == "normals that are not numbers":
        normals[500:900] = np.nan
    elif kind == "a vertex nowhere":
        vertices[600] = np.nan
    elif kind == "a vertex at the end of the world":
        vertices[600] = 1e30
    return Mesh(vertices, faces, normals)


KINDS = (
    "faces without area",
    "nothing but faces without area",
    "normals of no length",
    "normals that are not numbers",
    "a vertex nowhere",
    "a vertex at the end of the world",
)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_crooked_meshes_stay_finite_in_every_material(kind):
    """Side by side, one ball of each of the trickiest materials."""
    mesh = crooked(kind)
    parts = [GROUND]
    for number, name in enumerate(("grey", "chrome", "glass", "paint", "leaf")):
        tint = np.full((len(mesh.faces), 3), 0.4) if name in ("paint", "leaf") else None
        moved = Mesh(np.add(mesh.vertices, (2.5 * number - 5, 0, 0)), mesh.faces, mesh.normals)
        parts.append(static(name, moved, name, tint))
    with session_of(scene_of(parts, MATERIALS_HERE), quality=RAW) as session:
        rendered = session.render(frame_of(view_at([0, 0, 2], pitch=-5)))
    tally = rendered.tally
    assert (tally.nonfinite, tally.negative) == (0, 0)
    # Far from the balls nothing has changed: ground of 0.5, seen in a white sky.
    assert rendered.radiance[-2:].mean() == pytest.approx(0.5, rel=0.05)
    assert rendered.radiance[0].mean() == pytest.approx(1.0, rel=1e-3) or "end" in kind


SHAPE = 'shape="-200.00,-4.80 -2.00,-4.80"'
CROOKED_LANES = {
    "doubled points": 'shape="-200.00,-4.80 -200.00,-4.80 -90,-4.8 -90,-4.8 -2.00,-4.80 -2,-4.8"',
    "no length": 'shape="-200.00,-4.80 -200.00,-4.80"',
    "hardly any length": 'shape="-2.0001,-4.80 -2.00,-4.80"',
    "there and back": 'shape="-200.00,-4.80 -2.00,-4.80 -100.00,-4.80 -2.00,-4.80"',
    "a hairpin of a millimetre": 'shape="-200,-4.8 -2,-4.8 -200,-4.801"',
}


@pytest.mark.slow
@pytest.mark.parametrize("shape", CROOKED_LANES.values(), ids=CROOKED_LANES.keys())
def test_crooked_lanes_build_finite_roads(tmp_path, shape):
    place = write_scenario(tmp_path, vehicles=2)
    net = tmp_path / "net.net.xml"
    text = net.read_text(encoding="utf-8")
    assert SHAPE in text
    net.write_text(text.replace(SHAPE, shape), encoding="utf-8")
    job, request = load_job(place), Request(camera="post", size=(32, 18), spp=2)
    production = prepare(job, request, frame_times(4, 5, 5))
    for part in production.shot.data.static:
        assert np.isfinite(part.part.mesh.vertices).all(), part.id
        normals = part.part.mesh.normals
        assert normals is None or np.isfinite(normals).all(), part.id
    still = render_still(job, request, 4.0)
    assert np.isfinite(still.radiance).all() and still.radiance.max() > 0
    assert still.rendered.tally.nonfinite == 0


def test_a_mover_without_size_is_not_seen_and_harms_nobody():
    """A scale of zero flattens a body to a point."""
    materials = {"grey": diffuse(0.5), "matt_tint": matt({"type": "tint"})}
    scene = scene_of(
        [GROUND],
        materials,
        sky=constant_sky(),
        prototypes=[cube()],
        slots=Slots({"cube": 1}),
    )
    point = replace(
        mover("vehicle:0", (0, 8, 0), (0.5, 0.5, 0.5)),
        world_from_body=Transform.from_pose((0, 8, 0), scale=1e-9),
    )
    with session_of(scene) as session:
        rendered = session.render(frame_of(EYE, movers=[point]))
    assert rendered.tally.nonfinite == 0
    assert rendered.radiance[-4:].mean() == pytest.approx(0.5, rel=0.05)
