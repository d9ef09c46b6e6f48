"""Light of two frames, block by block."""

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.pipeline.films.stored_layers import StoredCamera
from sumo3dviz_pt.studies.certificate.acts import Acts
from sumo3dviz_pt.studies.certificate.comparison import compare, pixel_verdict
from sumo3dviz_pt.studies.certificate.evidence import SKY, Evidence, _radiance, _rays

SIZE = (90, 160)
ROAD, CAR, TREE = 1, 2, 3
PAINTED = Acts(looks=("vehicle:car",))
MOVED = Acts(things=("vehicle:car",))
FELLED = Acts(things=("tree:*",))


def frame():
    """A road below a sky, with a car 20 m ahead and a tree; light is noisy, as of few samples."""
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    up, left = (45 - rows) / 80.0, (80 - columns) / 80.0
    rays = np.stack([np.ones(SIZE), left, up], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    things = np.where(rows < 40, 0, ROAD)
    things[46:60, 75:95], things[20:60, 10:16] = CAR, TREE
    depth = np.where(things == 0, 0.0, 20.0)
    depth = np.where(
        (things == ROAD) & (up < -0.05), np.minimum(1.4 / -np.minimum(up, -0.05), 60), depth
    )
    noise = np.random.default_rng(1).gamma(0.7, 1 / 0.7, SIZE)
    light = np.where(things == 0, 0.8 + 0.2 * left, 0.4 * noise)
    return Evidence(
        things,
        {0: SKY, ROAD: "edge:e", CAR: "vehicle:car", TREE: "tree:1"},
        {SKY: SKY, "edge:e": "road", "vehicle:car": "car", "tree:1": "vegetation"},
        {
            "depth": depth.astype(np.float32),
            "normals": np.tile(np.float32([0, 0, 1]), (*SIZE, 1)),
            "albedo": np.full((*SIZE, 3), 0.3, np.float32),
        },
        np.repeat(light[..., None], 3, axis=-1).astype(np.float32),
        np.full((*SIZE, 3), 120, np.uint8),
        rays,
    )


def relit(factor, rows, columns):
    """The same frame with other light in a rectangle."""
    radiance = np.array(frame().radiance)
    radiance[rows, columns] *= factor
    return replace(frame(), radiance=radiance)


def shaded(factor, rows, columns):
    """The same frame with other light there, as it is traced: its noise is another, too."""
    radiance = np.array(frame().radiance)
    light = radiance[rows, columns]
    rng = np.random.default_rng(9)
    light[:] = (factor * 0.4 * rng.gamma(3.0, 1 / 3.0, light.shape[:2]))[..., None]
    return replace(frame(), radiance=radiance)


def faults(other, acts=PAINTED):
    return pixel_verdict([compare(0, frame(), other, acts)], acts).faults


TWO_PER_CENT = (slice(64, 81), slice(110, 127))
SEVEN_PER_CENT = (slice(60, 88), slice(110, 146))


@pytest.mark.parametrize("factor", [2.5, 1.3, 0.7])
def test_a_relit_fiftieth_of_the_picture_is_found(factor):
    fault, brushed = faults(relit(factor, *TWO_PER_CENT))
    assert "of the picture's blocks" in fault and fault.endswith("0.8% and 1.0% may")
    assert "changed by hand" in brushed


def test_what_moves_throws_a_shadow_and_no_more():
    shadow = (slice(60, 64), slice(70, 100))
    assert not faults(shaded(0.3, *shadow), MOVED)
    (fault,) = faults(shaded(2.5, *SEVEN_PER_CENT), MOVED)
    assert "light differs" in fault


def test_a_tree_opens_the_sky_around_it_and_not_far_away():
    """The tree stands 20 m away; what is farther off than it reaches must be lit the same."""
    assert not faults(shaded(3.0, slice(62, 88), slice(0, 60)), FELLED)
    far = frame()
    depth = np.where(far.things == ROAD, 100.0, far.layers["depth"]).astype(np.float32)
    far = replace(far, layers={**far.layers, "depth": depth})
    other = replace(far, radiance=shaded(3.0, slice(62, 88), slice(0, 60)).radiance)
    (fault,) = pixel_verdict([compare(0, far, other, FELLED)], FELLED).faults
    assert "15.0% and 1.0% may" in fault


def test_noise_of_paths_that_met_the_factor_is_no_other_light():
    """One pixel in three met the car and has drawn other samples since."""
    rng = np.random.default_rng(5)
    radiance = np.array(frame().radiance)
    met = (rng.random(SIZE) < 0.33) & (frame().things == ROAD)
    radiance[met] = 0.4 * rng.gamma(0.7, 1 / 0.7, (met.sum(), 1))
    assert not faults(replace(frame(), radiance=radiance))


def spoilt(change):
    """Two per cent of the picture changed by hand; the light that is changed, (h, w, 3)."""
    radiance = np.array(frame().radiance)
    change(radiance[TWO_PER_CENT])
    return replace(frame(), radiance=radiance)


def chequers(light):
    rows, columns = np.indices(light.shape[:2])
    light *= np.where((rows + columns) % 2, 1.5, 0.5)[..., None]


def grey(light):
    light[:] = (light @ (0.2126, 0.7152, 0.0722))[..., None]


def tint(light):
    light *= (1.1, 1.0, 0.8)


@pytest.mark.parametrize("change", [chequers, tint], ids=lambda each: each.__name__)
@pytest.mark.parametrize("acts", [PAINTED, MOVED, FELLED], ids=("painted", "moved", "felled"))
def test_what_a_brush_does_is_found_whatever_the_factor_throws(change, acts):
    """The means and medians of blocks stay what they are below chequers."""
    assert any("changed by hand" in fault for fault in faults(spoilt(change), acts))


def test_colour_that_is_gone_is_found_by_its_luminance_that_stayed():
    coloured = np.array(frame().radiance) * np.float32((1.1, 1.0, 0.7))
    one, other = replace(frame(), radiance=coloured), np.array(coloured)
    grey(other[TWO_PER_CENT])
    found = pixel_verdict([compare(0, one, replace(one, radiance=other), FELLED)], FELLED)
    assert any("changed by hand" in fault for fault in found.faults)


def test_a_hole_in_the_sky_is_found():
    radiance = np.array(frame().radiance)
    radiance[5:18, 100:125] *= 1.1  # the sky has no noise, and nothing lights it
    assert any("changed by hand" in each for each in faults(replace(frame(), radiance=radiance)))


def test_a_sky_that_is_turned_is_found_and_only_through_clear_air():
    radiance = np.array(frame().radiance)
    sky = frame().things == 0
    radiance[sky] = np.roll(radiance, 2, axis=1)[sky]
    turned = replace(frame(), radiance=radiance)
    assert any("the sky is another" in fault for fault in faults(turned))
    assert not faults(replace(turned, clear=False))
    assert not faults(turned, Acts(light=True))


def test_all_of_the_light_is_read_that_a_frame_stores(tmp_path):
    """Lamps that are seen directly are stored apart, where frames help each other."""
    folder = tmp_path / "film.frames"
    folder.mkdir()
    part = np.full((4, 6, 3), 0.25, np.float32)
    write_exr(folder / "000000.exr", {"radiance": part, "excess": 3 * part})
    whole = _radiance(tmp_path / "film.mp4", 0, 1.0)
    assert whole is not None and np.allclose(whole, 2.0)
    assert _radiance(tmp_path / "film.mp4", 1, 0.0) is None


def test_rays_go_through_the_centres_of_pixels():
    camera = StoredCamera((3, 3), 2.0, (1.0, 1.0), Transform(np.eye(4)))
    rays = _rays(camera)
    assert np.allclose(rays[1, 1], (1, 0, 0)) and rays[0, 1, 2] > 0 and rays[1, 0, 1] > 0
    assert np.allclose(np.linalg.norm(rays, axis=-1), 1.0)
