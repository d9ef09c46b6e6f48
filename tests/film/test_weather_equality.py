"""In every weather a frame alone, in another part and resumed is the film's, to the bit."""

from pathlib import Path

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.films.traced import FALLING, StoredFrame

pytestmark = pytest.mark.slow

TIMES = ["--from", "5", "--to", "5.3", "--fps", "10", "--quality", "draft", "--spp", "2"]
HOURS = {"day": "city_day", "night": "city_night"}
SHUTTER = ["--set", "cameras.driver.shutter={angle: 180, moments: 2}"]

WEATHERS = catalog.template_names("weather")
FILMS = [
    *((weather, hour, "post", []) for weather in WEATHERS for hour in HOURS),
    *((weather, "night", "driver", []) for weather in ("downpour", "dense_fog", "snowfall")),
    *((weather, "day", "driver", SHUTTER) for weather in ("rain", "snowfall")),
]
"""Weather, hour, camera and further words of each film: all weathers, rides, and shutters."""


def rendered(place: Path, film: Path, *words: str) -> dict[str, StoredFrame]:
    """Render a film, or a part of it; all its frames that there are by now."""
    assert main(["render", str(place), *TIMES, *words, "-o", str(film)]) == 0
    files = sorted(film.with_suffix(".frames").glob("*.exr"))
    return {path.name: StoredFrame.read(path) for path in files}


def assert_equal_frames(some: dict[str, StoredFrame], others: dict[str, StoredFrame]) -> None:
    """Assert that frames have the same layers, and the same before them that falls."""
    for name, frame in some.items():
        other = others[name]
        assert frame.strings.get(FALLING) == other.strings.get(FALLING)
        assert set(frame.layers) == set(other.layers)
        for layer, values in frame.layers.items():
            np.testing.assert_array_equal(values, other.layers[layer], err_msg=f"{name} {layer}")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("weather")
    return write_scenario(folder, signals=True, trees=True, vehicles=4, persons=1, end=20.0)


@pytest.mark.parametrize(("weather", "hour", "camera", "more"), FILMS)
def test_parts_alone_and_resumed_are_the_film(place, weather, hour, camera, more):
    words = ["--set", f"weather={{preset: {weather}}}", "--set", f"template={HOURS[hour]}"]
    words = [*words, *more, "--camera", camera]
    name = f"{weather}_{hour}_{camera}{len(more)}"
    whole, parts = (place.parent / f"{name}_{which}.mp4" for which in ("whole", "parts"))
    film = rendered(place, whole, *words)
    alone = rendered(place, parts, *words, "--frames", "2:3")
    assert list(alone) == ["000002.exr"] and len(film) == 3
    assert_equal_frames(alone, film)
    resumed = rendered(place, parts, *words, "--resume")
    assert set(resumed) == set(film)
    assert_equal_frames(resumed, film)
    assert whole.read_bytes() == parts.read_bytes()
