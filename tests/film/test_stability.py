"""Extreme scenes give finite, non-negative frames."""

import numpy as np
import pytest
from builders import SCENE, write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

pytestmark = pytest.mark.slow

SUN = "sky={{sun: {{azimuth: 120, elevation: {0}}}}}"


def still(place, *more, time=4.5, size="64x36"):
    """Render one frame through the command; its radiance."""
    target = place.parent / "still.exr"
    arguments = ["still", str(place), "--time", str(time), "--camera", "post", "--size", size]
    assert main([*arguments, "--spp", "2", "--overwrite", "-o", str(target), *more]) == 0
    picture = read_exr(target)[0]
    assert np.isfinite(picture).all() and (picture >= 0).all()
    return picture


def test_empty_road(tmp_path):
    """The log has one car, but not at this time."""
    text = SCENE.format(files="", x0=30, y0=-22, x1=5, y1=-3)
    place = write_scenario(tmp_path, vehicles=1, end=3.0, scene=text)
    log = tmp_path / "fcd.xml"
    steps = "".join(f'<timestep time="{t}.00"></timestep>' for t in range(4, 20))
    log.write_text(
        log.read_text(encoding="utf-8").replace("</fcd-export>", steps + "</fcd-export>"),
        encoding="utf-8",
    )
    assert still(place, time=12).max() > 0


@pytest.mark.parametrize("elevation", [-90, -4, 0.2, 90])
def test_every_sun(tmp_path, elevation):
    """By night there are no lamps but signals; the sky alone lights the road."""
    place = write_scenario(tmp_path, vehicles=4, signals=elevation < 0)
    picture = still(place, "--set", SUN.format(elevation))
    assert picture.max() > 0


def test_light_at_midday_is_more_than_at_dusk(tmp_path):
    place = write_scenario(tmp_path, vehicles=4)
    means = [still(place, "--set", SUN.format(e)).mean() for e in (60, 5, -3)]
    assert means[0] > 3 * means[1] > 9 * means[2]


@pytest.mark.parametrize("vehicles", [300, 2000])
def test_crowds(tmp_path, vehicles):
    place = write_scenario(tmp_path, vehicles=vehicles, end=8.0, step=2.0, spacing=0.3)
    assert still(place, time=5.0).max() > 0
    shot = prepare(load_job(place), Request(camera="post"), frame_times(4, 5, 5)).shot
    frame = shot.frame_at(4.4)
    assert len({m.id for m in frame.movers}) <= shot.limit and len(frame.users) > 50


@pytest.mark.parametrize("size", ["8x8", "1x1", "64x8", "9x64"])
def test_tiny_pictures(tmp_path, size):
    place = write_scenario(tmp_path, vehicles=4)
    width, height = map(int, size.split("x"))
    assert still(place, size=size).shape == (height, width, 3)


@pytest.mark.parametrize("offset", [(5e6, 5e6), (-5e6, 5e6)])
def test_far_coordinates(tmp_path, offset):
    place = write_scenario(tmp_path, offset=offset, vehicles=4)
    assert still(place).max() > 0


@pytest.mark.parametrize("quality", ["draft", "preview", "standard", "study", "reference"])
def test_every_preset(tmp_path, quality):
    place = write_scenario(tmp_path, vehicles=4, persons=1)
    assert still(place, "--quality", quality, size="16x9").max() > 0


@pytest.mark.parametrize("view", ["driver", "passenger", "hood", "chase", "top"])
def test_every_view_rides_along(tmp_path, view):
    place = write_scenario(tmp_path, vehicles=4)
    assert still(place, "--camera", "driver", "--set", f"cameras.driver.view={view}").max() > 0
