"""Pictures of the land near a camera and far from it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.render.backend import choose_backend

CAR, GROUND = 0.8, 0.1  # reflectances


@pytest.fixture
def aerial(tmp_path: Path) -> Path:
    """64 m x 32 m of even ground with a car of 4 m x 2 m in the middle, 8 pixels a metre."""
    image = np.full((256, 512, 3), GROUND)
    image[120:136, 240:272] = CAR
    code = np.where(image <= 0.0031308, image * 12.92, 1.055 * image ** (1 / 2.4) - 0.055)
    file = tmp_path / "aerial.png"
    Image.fromarray(np.round(255 * code).astype(np.uint8)).save(file)
    return file


def seen(file: Path, *, distance: float) -> Floats:
    """Reflectance over the middle 32 m x 16 m, (80, 160), from a distance [m]."""
    choose_backend()
    import drjit as dr
    import mitsuba as mi

    from sumo3dviz_pt.render.draped import draped_texture, register_draped

    register_draped()
    texture = mi.load_dict(draped_texture({"filename": str(file), "metres": (64.0, 32.0)}))
    x, y = np.meshgrid(np.linspace(0.25, 0.75, 160), np.linspace(0.25, 0.75, 80))
    si = dr.zeros(mi.SurfaceInteraction3f, x.size)
    si.uv = mi.Point2f(x.ravel().astype(np.float32), y.ravel().astype(np.float32))
    si.t = mi.Float(distance)
    return np.array(texture.eval_3(si, True), dtype=np.float64)[1].reshape(x.shape)


def test_far_away_the_picture_is_shown_as_it_is(aerial: Path) -> None:
    far = seen(aerial, distance=80.0)
    assert far[40, 80] == pytest.approx(CAR, abs=0.01)
    assert far[5, 5] == pytest.approx(GROUND, abs=0.005)


def test_near_the_camera_cars_fade_and_the_brightness_stays(aerial: Path) -> None:
    near, far = seen(aerial, distance=5.0), seen(aerial, distance=80.0)
    assert near.max() < 0.3 * CAR
    assert near.mean() == pytest.approx(far.mean(), rel=0.1)
    assert near.std() > 0.05 * near.mean(), "it has grain"


def test_in_between_it_changes_without_a_step(aerial: Path) -> None:
    over = np.array([seen(aerial, distance=d)[40, 80] for d in np.arange(10.0, 76.0, 2.0)])
    assert np.abs(np.diff(over)).max() < 0.05
    assert (np.diff(over) >= -1e-6).all()
