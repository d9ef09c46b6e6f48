"""The pictures by which looks are judged, and figures of colour and detail that they are held to.

Run from the repository's root; every picture is developed to a PNG, to be looked at in full size:

    python tests/bench/looks.py -o looks [--only driver corner] [--size 960x540] [--plans]

Figures of a picture: saturation of greens (at most .35), luminance that 5 % of the pixels are below
(at least 10 codes of 255), and the half-width of foliage's autocorrelation (at most 1.6 px): how
wide blotches are of which crowns consist. Pictures by night have no greens to speak of. `--plans`
also compares a moment's picture with the same frame of a drive of 20 s (FLIP at most .03), for
what is built hangs on what a shot shows.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.image.metrics import flip
from sumo3dviz_pt.model.layers import LUMINANCE

AIMS = {"greens": (0.0, 0.35), "dark_codes": (10.0, 255.0), "half_width_px": (0.0, 1.6)}
PLANS_AIM = 0.03
_PATCH = 24
"""Side of the squares in which foliage is looked at [px]."""

RONDA, CROSSING = "examples/ronda/scene.yaml", "examples/crossing/scene.yaml"


@dataclass(frozen=True)
class Picture:
    """What is rendered.

    Attributes:
        scene: Its scene file.
        time: SUMO's [s].
        camera: In the scene file.
        template: Sky and season; empty keeps the scene file's.
        more: Further settings that differ from the scene file.
    """

    scene: str
    time: float
    camera: str = "driver"
    template: str = ""
    more: dict[str, Any] = field(default_factory=dict)

    @property
    def changes(self) -> dict[str, Any]:
        """What differs from the scene file."""
        return {**({"template": self.template} if self.template else {}), **self.more}


def _seat(vehicle: str, view: str) -> dict[str, Any]:
    return {"cameras.driver.vehicle": vehicle, "cameras.driver.view": view}


PICTURES = {
    "driver": Picture(RONDA, 462.0),
    "chase": Picture(RONDA, 470.0, more={"cameras.driver.view": "chase"}),
    "overview": Picture(RONDA, 488.0, "overview"),
    "golden": Picture(RONDA, 462.0, template="highway_golden_hour"),
    "night": Picture(RONDA, 462.0, template="city_night"),
    "corner": Picture(CROSSING, 458.0, "corner", "city_day"),
    "crossing_driver": Picture(CROSSING, 497.0, template="village_day"),
    "overcast": Picture(CROSSING, 458.0, "corner", "overcast"),
    "rain": Picture(CROSSING, 458.0, "corner", "overcast", {"weather.preset": "rain"}),
    "dusk": Picture(CROSSING, 458.0, "corner", "city_dusk"),
    "night_rain": Picture(CROSSING, 497.0, "driver", "city_night", {"weather.preset": "rain"}),
    "snowfall": Picture(CROSSING, 497.0, "driver", "overcast", {"weather.preset": "snowfall"}),
    "bus_seat": Picture(CROSSING, 470.0, more=_seat("line_10N.4", "bus_passenger")),
    "cyclist": Picture(CROSSING, 470.0, more=_seat("bicycle_E_W.13", "cyclist")),
}


def luma(pixels: np.ndarray) -> np.ndarray:
    """Luminance of 8-bit pixels, (h, w) in codes."""
    return np.asarray(pixels @ LUMINANCE)


def is_green(pixels: np.ndarray) -> np.ndarray:
    """Where a picture shows foliage or grass, (h, w): green above all, and not bright."""
    red, green, blue = np.moveaxis(pixels.astype(float), -1, 0)
    return (green > red) & (green > blue) & (luma(pixels) < 110.0)


def greens(pixels: np.ndarray) -> float:
    """Mean saturation of what is green, as in HSV; NaN where nothing is."""
    mask = is_green(pixels)
    some = pixels[mask].astype(float)
    most = np.maximum(some.max(axis=-1, initial=1.0), 1.0)
    return float(((most - some.min(axis=-1, initial=255.0)) / most).mean()) if len(some) else np.nan


def half_width(pixels: np.ndarray) -> float:
    """Where the autocorrelation of foliage's luminance falls to a half [px]; NaN without any.

    Its mean over all squares of which nine tenths are green, after a slope and the mean are taken
    away: what remains are leaves, or the blotches that stand for them.
    """
    light, mask = luma(pixels), is_green(pixels)
    total = np.zeros((_PATCH, _PATCH))
    y, x = np.mgrid[:_PATCH, :_PATCH]
    plane = np.stack([np.ones(_PATCH**2), x.ravel(), y.ravel()], axis=1)
    taper = np.outer(np.hanning(_PATCH), np.hanning(_PATCH))
    for top in range(0, light.shape[0] - _PATCH + 1, _PATCH // 2):
        for left in range(0, light.shape[1] - _PATCH + 1, _PATCH // 2):
            at = slice(top, top + _PATCH), slice(left, left + _PATCH)
            if mask[at].mean() < 0.9:
                continue
            values = light[at].ravel()
            rest = values - plane @ np.linalg.lstsq(plane, values, rcond=None)[0]
            power = np.abs(np.fft.fft2(rest.reshape(_PATCH, _PATCH) * taper)) ** 2
            total += np.fft.ifft2(power).real / max(power.mean(), 1e-9)
    if not total.any():
        return float("nan")
    row = 0.5 * (total[0] + total[:, 0])[: _PATCH // 2] / total[0, 0]
    after = int(np.argmax(row < 0.5))
    return float(after - (0.5 - row[after]) / (row[after - 1] - row[after]))


def figures(pixels: np.ndarray) -> dict[str, float]:
    """All figures of a developed picture, (h, w, 3)."""
    return {
        "greens": round(greens(pixels), 3),
        "dark_codes": round(float(np.percentile(luma(pixels), 5)), 1),
        "half_width_px": round(half_width(pixels), 2),
    }


def of_plan(scene: Any, picture: Picture, alone: np.ndarray, **choices: Any) -> float:
    """FLIP between a moment's picture and the same moment as the first frame of 20 s."""
    end = picture.time + 20.0
    shown = scene.frames(camera=picture.camera, start=picture.time, end=end, fps=2, **choices)
    first = next(iter(shown)).develop()
    return round(flip(first / 255.0, alone / 255.0), 4)


def main() -> None:
    """Render, measure, write."""
    from PIL import Image

    import sumo3dviz_pt as sv

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*", choices=PICTURES, default=list(PICTURES))
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--quality", default="standard")
    parser.add_argument("--plans", action="store_true")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    choices = {"quality": given.quality, "size": (width, height)}
    given.out.mkdir(parents=True, exist_ok=True)
    found: dict[str, dict[str, float]] = {}
    for name in given.only:
        picture = PICTURES[name]
        with sv.load(picture.scene, picture.changes) as scene:
            made = scene.still(time=picture.time, camera=picture.camera, **choices)
            pixels = made.develop()
            found[name] = figures(pixels)
            if given.plans:
                found[name]["flip_of_plan"] = of_plan(scene, picture, pixels, **choices)
        Image.fromarray(pixels).save(given.out / f"{name}.png")
        print(name, found[name], flush=True)
        text = json.dumps(
            {"aims": AIMS, "plans": PLANS_AIM, **choices, "pictures": found}, indent=1
        )
        (given.out / "looks.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
