"""Seeds one-line faults into a copy of the package and sees which test catches each.

    python tests/bench/seeded_faults.py [NAME ...]

Not run by pytest: it takes some minutes. A fault that no test catches makes the exit
code 1. The faults are applied one by one; the working tree is never touched.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, slots=True)
class Fault:
    """One change of one line.

    Attributes:
        file: Within the package.
        old: Text that occurs exactly once.
        new: What stands there instead.
        tests: Where a test should notice.
    """

    file: str
    old: str
    new: str
    tests: tuple[str, ...]


PICTURES = "tests/statistical/test_pictures.py"
FRAMES = "tests/unit/pipeline/films/test_frames.py"
LIGHT = "tests/statistical/test_stability_light.py"
PLACES = "tests/statistical/test_stability_places.py"
BROKEN = "tests/statistical/test_stability_broken.py"
DARK = "tests/unit/pipeline/test_day_and_night.py"
STIFF = "tests/unit/motion/test_stiff_cases.py"
DRIVES = "tests/unit/motion/test_stiff_drives.py"
MANOEUVRES = "tests/unit/motion/test_stiff_manoeuvres.py"
BY_DAY = "test_by_day_nothing_lights_the_scene_but_the_sky"

FAULTS = {
    "yaw turns clockwise": Fault(
        "model/geometry.py", "[[cy, -sy, 0.0], [sy, cy, 0.0]", "[[cy, sy, 0.0], [-sy, cy, 0.0]",
        (PICTURES,),
    ),
    "frame times are one frame late": Fault(
        "pipeline/production.py",
        "float(number * step) for number", "float((number + 1) * step) for number",
        (FRAMES,),
    ),
    "lamps are not recentred": Fault(
        "render/lights/standing.py", "key, each.mesh.vertices - origin)",
        "key, each.mesh.vertices)", (PICTURES,),
    ),
    "the cap ignores exempt pixels": Fault(
        "render/passes/samples.py",
        "within[self.exempt] += lost[self.exempt]", "within[self.exempt] += 0.0",
        ("tests/unit/render/passes/test_passes.py", LIGHT),
    ),
    "colour table is off by one": Fault(
        "render/paint.py", "return int(pointer[0]) & (TABLE_SIZE - 1)",
        "return (int(pointer[0]) + 1) & (TABLE_SIZE - 1)", (PICTURES,),
    ),
    "haze veils the sky": Fault(
        "render/passes/finish.py", "= (hit + sky * (fade * fade * fade)) * fade",
        "= fade + 0.5 * (1 - hit)",
        ("tests/unit/render/passes/test_haze.py",),
    ),
    "bodies stand half a metre ahead": Fault(
        "cast/axles.py", "matrices[:, :3, 3] = positions",
        "matrices[:, :3, 3] = positions + [0.5, 0, 0]", (FRAMES,),
    ),
    "teleports are driven across": Fault(
        "motion/samples.py", "(lengths > reach + slack) | thrown", "lengths > 1e9",
        ("tests/unit/motion/test_splitting.py", STIFF),
    ),
    "dashes begin without half a gap": Fault(
        "library/mesh/bands.py", "self.stations[0] + 0.5 * gap", "self.stations[0] + 0.9 * gap",
        ("tests/unit/library", "tests/unit/world/roads/test_roads.py"),
    ),
    "a signal shows its neighbour's letter": Fault(
        "world/signals/heads.py", "letter = state[link] if", "letter = state[link - 1] if",
        ("tests/unit/world/signals/test_aspects.py", "tests/unit/pipeline/test_leave_out.py"),
    ),
    "the seed of a frame forgets its time": Fault(
        "model/random.py", "words = [seed, microseconds % 2**32,", "words = [seed, 0,",
        ("tests/unit/render/passes/test_passes.py",),
    ),
    "the sun's azimuth is mirrored": Fault(
        "render/sky/weathered.py", "place = direction * SUN_DISTANCE",
        "place = direction * [-1, 1, 1] * SUN_DISTANCE", (PICTURES,),
    ),
    "new values do not reach recordings": Fault(
        "render/convert.py", 'if "scalar" in mi.variant():', "if key:", (PICTURES,),
    ),
    "far road users beyond the detailed ones are dropped": Fault(
        "shot/crowd.py", "shown & ~near, full, lettered)",
        "shown & ~near & (distance > NEAR_END), full, lettered)",
        ("tests/property/test_visibility_properties.py",),
    ),
    # Bodies on their path.
    "trailers follow a tangent, not the path": Fault(
        "cast/axles.py", "heading = _unit(ahead - behind)",
        "heading = _unit(ahead - _points(path, spacing, place - 0.5 * (second - first)))",
        ("tests/unit/cast/test_articulation.py",),
    ),
    "outer wheels turn no faster than inner ones": Fault(
        "cast/axles.py", "places = np.stack([_places(units, hub) for hub in hubs], axis=1)",
        "places = np.stack([units[:, hub.unit, :3, 3] for hub in hubs], axis=1)",
        ("tests/unit/cast/test_rolling.py",),
    ),
    "wheels roll backwards": Fault(
        "cast/drawing.py", "[[ct, 0.0, st], [0.0, 1.0, 0.0], [-st, 0.0, ct]]",
        "[[ct, 0.0, -st], [0.0, 1.0, 0.0], [st, 0.0, ct]]", ("tests/unit/cast/test_rolling.py",),
    ),
    "brake lamps have one threshold": Fault(
        "cast/lamps.py",
        "leaves = (change > -_RELEASES * lost)", "leaves = (change > -lost)",
        ("tests/unit/cast/test_derived_lamps.py",),
    ),
    "bodies roll into the bend": Fault(
        "cast/poses.py", "roll = springs.roll *", "roll = -springs.roll *",
        ("tests/unit/cast/test_sway.py",),
    ),
    "a block of frames shows its first time": Fault(
        "cast/poses.py", "column = int(np.searchsorted(block.times, time))", "column = 0",
        ("tests/unit/cast/test_presence.py",),
    ),
    # Law 3: what shines by day and by night.
    "lamps count as lit by day": Fault(
        "world/sky.py", "< np.sin(LIGHTING_UP)", "< 2.0", (f"{DARK}::{BY_DAY}",),
    ),
    "street lamps burn by day": Fault(
        "world/street/street.py", "lamp_sets(lamps, around) if dark else ()",
        "lamp_sets(lamps, around)",
        (f"{DARK}::{BY_DAY}",),
    ),
    "light paths aim at signals by day": Fault(
        "model/scene.py", "replace(some, sampled=dark) if", "replace(some, sampled=True) if",
        (f"{DARK}::{BY_DAY}",),
    ),
    "head lamps have beams by day": Fault(
        "cast/lamps.py", 'if not (dark and "head" in roles):',
        'if "head" not in roles:', (f"{DARK}::{BY_DAY}",),
    ),
    "moving vehicles are unlit by night": Fault(
        "cast/lamps.py", "_AT_NIGHT if self.dark else frozenset[str]()",
        "frozenset[str]()",
        (f"{DARK}::test_by_night_whoever_drives_is_lit",),
    ),
    "plain bodies have no lamps": Fault(
        "cast/bodies.py", "Prototype(name, made.parts, made.far, lamps)",
        "Prototype(name, made.parts, made.far)", (f"{DARK}::test_by_night_whoever_drives_is_lit",),
    ),
    "an opened vehicle loses its lamps": Fault(
        "library/vehicles/interior/cutaway.py", "(*prototype.lamps, *lamps)", "lamps",
        (f"{DARK}::test_the_lamps_of_a_driver_at_night_light_its_road",),
    ),
    "a night sky leaves a day's lamps off": Fault(
        "shot/build.py", "if is_dark(sky, lights) != self.dark:", "if False:",
        (f"{DARK}::test_lamps_go_on_with_another_sky",),
    ),
    # Guards of the stability suite.
    "the renderer does not recentre": Fault(
        "model/scene.py", "return np.round(self.position / ORIGIN_GRID) * ORIGIN_GRID",
        "return 0.0 * self.position", (PLACES,),
    ),
    "the renderer recentres on a grid of 2 km": Fault(
        "model/scene.py", "ORIGIN_GRID = 250.0", "ORIGIN_GRID = 2000.0",
        (f"{PLACES}::test_the_contact_shadow_stays_on_a_drive_of_2_km",),
    ),
    "dusk is as bright as a sun of 2 degrees": Fault(
        "render/sky/daylight.py",
        "coarse = model.sky() * (sky * fade)",
        "coarse = model.sky() * sky", (f"{LIGHT}::test_no_jump_between_neighbours",),
    ),
    "the cap does not know white": Fault(
        "render/settings.py", "cap * self.white", "cap",
        (f"{LIGHT}::test_the_cap_scales_with_white",),
    ),
    "there is no cap": Fault(
        "render/passes/by_path.py",
        "dr.minimum(1.0, self.limit / peak)", "dr.minimum(1.0, 1e30 / peak)",
        (f"{LIGHT}::test_the_cap_spares_the_disc_and_tames_its_mirror_image",),
    ),
    "NaN becomes black in Mitsuba's film": Fault(
        "render/passes/by_path.py", "lost = dr.select(sound, radiance - within, np.inf)",
        "lost = radiance - within", (BROKEN,),
    ),
    "slim triangles have no colour": Fault(
        "render/textures.py",
        "dr.select(sound, wear, mi.Color3f(*UNWORN))", "wear",
        ("tests/unit/render/test_untiled.py",),
    ),
    "broken pixels are counted but stay": Fault(
        "render/passes/samples.py",
        "light[broken] = gone[broken] = 0.0", "gone[broken] = 0.0", (BROKEN,),
    ),
    "broken pixels are painted over without an error": Fault(
        "render/passes/samples.py", "BAD_SHARE = 1e-5", "BAD_SHARE = 1.0", (BROKEN,),
    ),
    "paint lies at the height of the asphalt": Fault(
        "world/roads/layers.py", "_WEAR, _DETAILS, _PAINT, _RAILS = 0.002, 0.0035, 0.005, 0.01",
        "_WEAR, _DETAILS, _PAINT, _RAILS = 0.002, 0.0035, 0.0, 0.01",
        ("tests/statistical/test_stability_layers.py",),
    ),
    "what is 5 cm from the eye is cut open": Fault(
        "render/convert.py", "NEAR_CLIP = 0.001", "NEAR_CLIP = 0.05",
        ("tests/statistical/test_stability_cameras.py",),
    ),
    # Motion.
    "vehicles may roll back between samples": Fault(
        "motion/front.py", "return np.clip(slopes, 0.0, 3.0 * np.minimum(",
        "return slopes + 0.0 * np.clip(slopes, 0.0, 3.0 * np.minimum(", (STIFF, DRIVES),
    ),
    "Euler speeds are taken for rates": Fault(
        "motion/setting.py", "return off < _EXACT and off < 0.3 * even", "return False",
        (STIFF, DRIVES),
    ),
    "lanes are changed in half a second": Fault(
        "motion/path.py", "CHANGE_TIME = 4.0", "CHANGE_TIME = 0.5", (DRIVES,),
    ),
    "lanes are changed at walking pace as on a motorway": Fault(
        "motion/path.py", "\n_AHEAD = 4.0", "\n_AHEAD = 0.0", (DRIVES,),
    ),
    "places on lanes are measured on the map": Fault(
        "motion/lanes.py", "along = arc_length(shape)", "along = arc_length(shape[:, :2])",
        (MANOEUVRES,),
    ),
    "bodies follow their fronts at half their length": Fault(
        "motion/body.py", "chords(driven, setting.length)", "chords(driven, 0.5 * setting.length)",
        (MANOEUVRES,),
    ),
    "rear axles are at the rear bumper": Fault(
        "motion/driven.py", "_AXLE = 0.78", "_AXLE = 1.0", (MANOEUVRES,),
    ),
    "bodies turn as fast as corners do": Fault(
        "motion/manoeuvres.py", "FASTEST_TURN = np.radians(130.0)", "FASTEST_TURN = 1e4",
        (STIFF, MANOEUVRES),
    ),
    "corners are not rounded": Fault(
        "motion/lanes.py", "TIGHTEST, WIDEST = 2.25, 10.0", "TIGHTEST, WIDEST = 0.05, 0.1",
        (MANOEUVRES,),
    ),
    "who parks jumps aside": Fault(
        "motion/manoeuvres.py", "PARKING_TIME = 3.0", "PARKING_TIME = 0.1", (MANOEUVRES,),
    ),
    "who backs up turns round": Fault(
        "motion/manoeuvres.py", "_BACKING = 0.15", "_BACKING = 1e9", (MANOEUVRES,),
    ),
    "walls are driven up": Fault(
        "motion/driven.py", "STEEPEST = np.radians(30.0)", "STEEPEST = np.radians(89.0)",
        (MANOEUVRES,),
    ),
    "the margin of the window is too short": Fault(
        "motion/__init__.py", "MARGIN = 12.0", "MARGIN = 0.5",
        ("tests/property/test_motion_laws.py::test_the_asked_window_changes_nothing",),
    ),
    "stretched bodies lose their wheels": Fault(
        "cast/fitting.py", "replace(place, at=stretch.moved_point(place.at))", "place",
        ("tests/unit/cast/test_full_detail.py",),
    ),
    "roaming cameras run out of slots": Fault(
        "shot/build.py", "if self.places is not None:", "if False:",
        ("tests/unit/shot/test_roaming.py",),
    ),
    "parts of large pictures are mirrored": Fault(
        "render/convert.py", "part.column - middle", "middle - part.column",
        ("tests/film/test_quick.py",),
    ),
    "the error is that of a single sample": Fault(
        "viewer/client.py", "(shown[0] - shown[1]) / 2.0", "shown[0] - shown[1]",
        ("tests/unit/viewer/test_mean.py",),
    ),
    "eyes walk through the ground": Fault(
        "viewer/keyframes.py", "max(max(eye.position[2], lowest) + step[2], lowest)", "position[2]",
        ("tests/unit/viewer/test_walk.py",),
    ),
    "a house is remembered without its level of detail": Fault(
        "world/rows/houses.py", "own.tobytes(), level), make)", "own.tobytes()), make)",
        ("tests/unit/pipeline/test_worlds.py",),
    ),
    "another seed finds the old world": Fault(
        "pipeline/worlds.py",
        "json.dumps([settings, stamps, cameras]", "json.dumps([stamps, cameras]",
        ("tests/unit/pipeline/test_worlds.py",),
    ),
    "a block of land grows houses in two tiles": Fault(
        "world/rows/fronts.py", "if own and whole else", "if whole else",
        ("tests/unit/world/rows/test_fronts.py",),
    ),
    "furniture touches across tiles": Fault(
        "world/street/places.py", "depth(places) > radius + _GAP / 2.0", "depth(places) > -1.0",
        ("tests/unit/world/street/test_street.py",),
    ),
    "all tiles hold the houses of the first": Fault(
        "world/rows/fronts.py", "memory.of((SOURCE, tile)", "memory.of((SOURCE,)",
        ("tests/unit/world/rows/test_fronts.py",),
    ),
    "an open shutter shows where it opens": Fault(
        "model/camera.py", "(number + 0.5) * part", "number * part",
        ("tests/unit/model/test_shutter.py",),
    ),
    "rows of houses ignore other cameras": Fault(
        "world/placement/sightlines.py",
        "around.clearance.tracks, wide", "around.clearance.tracks[:0], wide",
        ("tests/unit/world/rows/test_fronts.py",),
    ),
    "a side joins a road's outline and its hole": Fault(
        "library/mesh/planar.py", "shapely.get_parts(shapely.boundary(list(areas)))",
        "shapely.boundary(list(areas))",
        ("tests/unit/world/plants/test_planting.py",),
    ),
    # Colours, lamps, keys; and twenty faults across the rooms.
    "labels say metres a second": Fault(
        "overlays/drawing.py", "{pose[5] * 3.6:.0f}",
        "{pose[5]:.0f}", ("tests/unit/overlays/test_drawn.py",),
    ),
    "the scale of colours says metres a second": Fault(
        "overlays/drawing.py", 'f"{speed * 3.6:.0f}" + (" km/h"',
        'f"{speed:.0f}" + (" km/h"', ("tests/unit/overlays/test_drawn.py",),
    ),
    "films have luma of BT.601": Fault(
        "video/encoder.py", "0.2126 * red + 0.7152 * green + 0.0722 * blue",
        "0.299 * red + 0.587 * green + 0.114 * blue", ("tests/unit/video/test_picture.py",),
    ),
    "visibility leaves 5 % of contrast": Fault(
        "model/weather.py", "-math.log(0.02)",
        "-math.log(0.05)", ("tests/unit/model/test_weather.py",),
    ),
    "rain is half as opaque": Fault(
        "model/weather.py", "0.312e-3 * self.rate",
        "0.156e-3 * self.rate", ("tests/unit/model/test_weather.py",),
    ),
    "flakes fall half as fast": Fault(
        "model/falling.py", "1.6 * (np.asarray(melted)",
        "0.8 * (np.asarray(melted)", ("tests/unit/model/test_precipitation.py",),
    ),
    "wind blows to where it comes from": Fault(
        "model/weather.py", "cls(-speed * math.sin(bearing), -speed * math.cos(bearing))",
        "cls(speed * math.sin(bearing), speed * math.cos(bearing))",
        ("tests/unit/model/test_weather.py",),
    ),
    "drivers sit on the kerb's side": Fault(
        "shot/cameras/riding.py", '(preset.side == "driver") != left_hand',
        '(preset.side == "driver") == left_hand', ("tests/unit/shot/cameras/test_cameras.py",),
    ),
    "dipped beams dazzle who comes towards them": Fault(
        "library/vehicles/lamps.py", "-across if left_hand else across",
        "across if left_hand else -across", ("tests/unit/library/vehicles/test_beam.py",),
    ),
    "rear fog lamps are on the kerb's side": Fault(
        "cast/lamps.py", "tails[0 if left_hand else -1]",
        "tails[-1 if left_hand else 0]", ("tests/unit/cast/test_lights.py",),
    ),
    "inner lines have the colour of outer ones": Fault(
        "world/roads/markings/lines.py", "cls(inner, outer) if left_hand else cls(outer, inner)",
        "cls(outer, inner) if left_hand else cls(inner, outer)",
        ("tests/unit/world/roads/test_style_markings.py",),
    ),
    "air lowers the sun": Fault(
        "world/sky.py", "elevation + (_refraction(elevation)",
        "elevation - (_refraction(elevation)", ("tests/unit/world/test_sun.py",),
    ),
    "green ends with the first of two lanes": Fault(
        "sumo/signals.py", '"G" if count > 0',
        '"G" if count > 1', ("tests/unit/sumo/test_sumo_signals.py",),
    ),
    "flow goes up": Fault(
        "image/layers.py", "row - rows]",
        "rows - row]", ("tests/unit/image/test_flow.py",),
    ),
    "the left eye sees what is right": Fault(
        "model/projections.py", "(-shift * sine, shift * cosine, 0.0)",
        "(shift * sine, -shift * cosine, 0.0)",
        ("tests/unit/model/test_projections.py",),
    ),
    "orders of trials forget the seed": Fault(
        "studies/designs/trials.py", '":".join([str(seed), *words])',
        '":".join(words)', ("tests/unit/studies/designs/test_designs.py",),
    ),
    "fog scatters backwards": Fault(
        "render/kernel/air.py", "1.0 + g * g - 2.0 * g * cosine",
        "1.0 + g * g + 2.0 * g * cosine", ("tests/unit/render/kernel/test_halos.py",),
    ),
    "red signals are a third as bright": Fault(
        "world/signals/signals.py", "RED: (1.5, 0.013, 0.008)",
        "RED: (0.5, 0.0043, 0.0027)", ("tests/unit/world/signals/test_signals.py",),
    ),
    "certificates forgive ten times the light": Fault(
        "studies/certificate/comparison.py", "TYPICAL_LIGHT = 0.02",
        "TYPICAL_LIGHT = 0.2", ("tests/unit/studies/certificate/test_comparison.py",),
    ),
    "measures of speed are in metres a second": Fault(
        "studies/measured/film.py", "_KMH = 3.6",
        "_KMH = 1.0", ("tests/unit/studies/measured/test_film.py",),
    ),
    "a worker that is alive counts as dead": Fault(
        "farm/state.py", "return now - self.beat < lease",
        "return now - self.beat > lease", ("tests/unit/farm/test_farm_state.py",),
    ),
    "red paint is blue": Fault(
        "library/paints.py", "(0.300, 0.013, 0.012)",
        "(0.012, 0.013, 0.300)", ("tests/contract/test_named_colours.py",),
    ),
    "steel blue has red and blue swapped": Fault(
        "library/paints.py", "(0.110, 0.190, 0.270)",
        "(0.270, 0.190, 0.110)", ("tests/contract/test_named_colours.py",),
    ),
    "street lamps are blue": Fault(
        "world/street/lamps.py", "_COLOUR = (1.0, 0.78, 0.56)",
        "_COLOUR = (0.56, 0.78, 1.0)", ("tests/unit/world/street/test_street.py",),
    ),
    "stained walls have red and blue swapped": Fault(
        "render/paint.py", 'enumerate(value["mean"])',
        'enumerate(value["mean"][::-1])', ("tests/unit/render/test_stained.py",),
    ),
    "one indicator is twice as bright": Fault(
        "cast/lamps.py", '"left":    _Light(200.0,',
        '"left":    _Light(400.0,', ("tests/unit/cast/test_lamp_photometry.py",),
    ),
    "lamps are twice as bright": Fault(
        "cast/lamps.py", "scale = light.candelas / CANDELAS_PER_UNIT",
        "scale = 2.0 * light.candelas / CANDELAS_PER_UNIT",
        ("tests/unit/cast/test_lamp_photometry.py",),
    ),
    "a place is kept without its signal files": Fault(
        "pipeline/worlds.py", "return (files.network, *files.signals, *files.additional)",
        "return (files.network, *files.additional)",
        ("tests/unit/pipeline/test_keys.py",),
    ),
    # Faults that no fast test caught.
    "glare grows with a picture's width": Fault(
        "image/optics.py", "size * exposed.shape[0])", "size * exposed.shape[1])",
        ("tests/unit/image/test_bloom.py",),
    ),
    "rolling rows are seen at one moment": Fault(
        "shot/road_users.py", "if span > 0.0 or shutter.rolling > 0.0 else 1",
        "if span > 0.0 else 1", ("tests/unit/shot/test_exposing.py",),
    ),
    "who is sharp lies on the road": Fault(
        "shot/road_users.py", "(0.0, 0.0, self.middle[2])", "(0.0, 0.0, 0.0)",
        ("tests/unit/shot/test_exposing.py",),
    ),
    "lamps are lit five degrees late": Fault(
        "world/sky.py", "np.radians(-1.0)", "np.radians(-6.0)",
        ("tests/unit/world/test_darkness.py",),
    ),
    "green lenses have red and blue swapped": Fault(
        "world/signals/signals.py", "GREEN: (0.006, 0.52, 0.18)", "GREEN: (0.18, 0.52, 0.006)",
        ("tests/unit/world/signals/test_signal_laws.py",),
    ),
    "brake lamps of low bodies lie above them": Fault(
        "library/vehicles/plain_bodies.py", "min(size[1], _LOWEST[narrow] * height)", "size[1]",
        ("tests/unit/library/vehicles/test_plain_lamps.py",),
    ),
}  # fmt: skip


def seeded(folder: Path, fault: Fault) -> None:
    """Copy what tests need and apply a fault."""
    for name in ("sumo3dviz_pt", "tests", "examples", "scene_templates", "assets"):
        shutil.copytree(
            ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.pyc")
        )
    shutil.copy(ROOT / "pyproject.toml", folder)
    path = folder / "sumo3dviz_pt" / fault.file
    text = path.read_text(encoding="utf-8")
    if text.count(fault.old) != 1:
        raise SystemExit(f"{fault.file} holds {text.count(fault.old)} times: {fault.old}")
    path.write_text(text.replace(fault.old, fault.new), encoding="utf-8")


def catcher(fault: Fault) -> str:
    """The first test that fails, or nothing."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seeded(folder, fault)
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-x",
            "-m",
            "not bench",
            "--no-header",
            "-p",
            "no:cacheprovider",
        ]
        done = subprocess.run(
            [*command, *fault.tests],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(folder)},
            capture_output=True,
            text=True,
            check=False,
        )
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if done.returncode and not failed:
        return f"pytest itself failed: {done.stdout[-300:]}{done.stderr[-300:]}"
    return failed[0].split(" - ")[0].removeprefix("FAILED ") if failed else ""


def main(names: list[str]) -> int:
    """Try all faults."""
    missed = 0
    for name in names or FAULTS:
        found = catcher(FAULTS[name])
        missed += not found
        sys.stdout.write(f"{name:52} {found or 'NOT CAUGHT'}\n")
        sys.stdout.flush()
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
