"""White furnace of wet, flooded and snowy materials: none of them makes light.

Every material of the house lies on balls and plates in a closed sky of radiance 1.
"""

from dataclasses import replace

import numpy as np
import pytest
from builders import RAW, ball, frame_of, plane, scene_of, session_of, static, view_at
from significance import sidak_z

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.materials import MATERIALS, principled, surface_bsdf
from sumo3dviz_pt.model.geometry import UNWORN, Mesh
from sumo3dviz_pt.model.trajectory import TyreTracks
from sumo3dviz_pt.model.weather import Rain, Snow, Weather, WeatherCourse

pytestmark = pytest.mark.slow

GAIN = 1.02
"""Most that `principled` may add at a base colour of 0.85; see `test_furnace.py`."""

WEATHERS = {
    "wet": Weather(wetness=1.0),
    "half wet": Weather(wetness=0.5, puddles=0.5),
    "flooded": Weather(wetness=1.0, puddles=1.0),
    "rain": Weather(wetness=1.0, puddles=1.0, rain=Rain(30.0)),
    **{
        f"{roads} snow": Weather(snow=Snow(0.06, roads), season="winter")
        for roads in ("cleared", "tracked", "covered")
    },
    "thin snow": Weather(snow=Snow(0.012, "covered"), season="winter"),
}
NAMES = ["asphalt", "paving", "ground_grass", "white", "silver", "rough white"]
SPACING = 6.0


def textured(mesh: Mesh) -> Mesh:
    wear = np.tile(UNWORN, (len(mesh.vertices), 1))
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, 0.5 * mesh.vertices[:, :2], wear)


@pytest.mark.parametrize("weather", WEATHERS)
@pytest.mark.parametrize("pitch", [-90.0, -12.0])
def test_no_weather_makes_light(weather: str, pitch: float) -> None:
    materials = {
        **MATERIALS,
        **{name: surface_bsdf(catalog.find("surfaces", name)) for name in NAMES[:3]},
        "white": principled((0.85, 0.85, 0.85), roughness=0.35),
        "silver": principled((0.8, 0.7, 0.6), roughness=0.2, metallic=1.0),
        "rough white": principled((0.85, 0.85, 0.85), roughness=1.0),
    }
    parts = []
    for number, name in enumerate(NAMES):
        x = SPACING * (number - 2.5)
        parts.append(static(f"ball {name}", textured(ball((x, 3.0, 0.0), 1.0)), name))
        flat = plane(2.0, centre=(x, -2.0))
        parts.append(static(f"plate {name}", textured(flat), name))
    ways = TyreTracks(np.array([[-20.0, -2.0]] * 2), np.array([[20.0, -2.0]] * 2))
    course = WeatherCourse((0.0,), (WEATHERS[weather],))
    shown = replace(scene_of(parts, materials), weather=course, tracks=ways)
    away = 45.0
    angle = np.radians(pitch)
    eye = (0.0, -away * np.cos(angle), -away * np.sin(angle))
    quality = RAW.model_copy(update={"spp": 64, "pass_spp": 64, "max_depth": 12})
    with session_of(shown, size=(160, 60), quality=quality) as session:
        state = frame_of(view_at(eye, pitch=pitch, fov=45))
        image = session.render(replace(state, weather=course.at(0.0))).radiance
    blocks = image.reshape(12, 5, 16, 10, 3).swapaxes(1, 2).reshape(-1, 50, 3).astype(np.float64)
    mean, error = blocks.mean(axis=1), blocks.std(axis=1) / np.sqrt(50)
    assert image.min() >= 0.0
    assert (mean < 0.98).any(), "nothing is in the picture"
    assert (mean <= GAIN + sidak_z(mean.size, sides=1) * error + 1e-5).all()
