"""Writes files as this version makes them, for later ones to read: python tests/make_corpus.py

They go into `tests/corpus/vVERSION`: scene files of all modes with what they mean, a film with its
record and a frame, a study's folder, a farm's plan, and a recording if SUMO is there. A folder is
made once, when a version is published, and never again: later code has to read what lies there.
"""

from __future__ import annotations

import contextlib
import json
import shutil
import tempfile
from pathlib import Path

from any_network.programs import call
from builders import write_scenario

from sumo3dviz_pt import __version__
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.pipeline.provenance import with_files
from sumo3dviz_pt.pipeline.scene_file import load_job

CORPUS = Path(__file__).resolve().parent / "corpus"

HEAD = """scenario:
  network: ../town/net.net.xml
  trajectories: ../town/fcd.xml
  signals: ../town/tls.xml
  additional: [../town/trees.add.xml]
  vehicle_types: ../town/types.add.xml
"""

SCENES = {
    "eulerian": """seed: 7
template: city_day
quality: preview
sky: {sun: {date: 2026-06-21, time: "17:30", zone: Europe/Berlin, place: [52.5, 13.4]}}
weather: {preset: drizzle, wind: {speed: 5 m/s, from: 200}, season: autumn}
ground: {texture: ground_grass, scale: 2, planting: none, horizon: hills, areas: none}
roads:
  surface: asphalt
  marking_style: european
  lane_width: 3.4
  per_edge: {"w*": {colour: "#404040", markings: false}}
lights: on
cameras:
  post:
    mode: eulerian
    position: [30, -22, 6]
    look_at: [5, -3, 0]
    lens: {focal_length: 35 mm, sensor: 36 mm, f_number: 2.8, focus: 12 m, vignetting: 0.3}
    shutter: {time: 1/50 s, rolling: 15 ms}
    exposure: {mode: manual, iso: 200}
    clear_view: false
shots: [{camera: post, from: 4, to: 5, speed: 0.5}]
output: {size: [640, 360], fps: 30000/1001, codec: h265_10, tone: agx, glare: 0.02, half: false,
  exposure: 0.5, layers: [depth, ids, boxes2d], sound: {play: binaural, murmur: 30}}
""",
    "lagrangian": """template: abstract
vehicles:
  passenger: [hatchback, estate]
  colours: ["#c00000", "#f0f0f0"]
  by_id: {v0: {model: hatchback, colour: "#0000c0"}, "v[1-3]": {colour: "#00c000"}}
  types: {car: passenger}
  full_models: 4
objects: {trees: {scale: 1.2, variation: 0.1}, detectors: true}
signals: {design: countdown, yellow: auto, yellow_time: 4}
street: {fronts: none, town: none, lamps: none, signs: none, furniture: none}
motion: {smoother: hermite, heading: tractrix, suspension: false}
traffic: {share: 0.8, leave_out: [p0]}
cameras:
  driver: {mode: lagrangian, vehicle: v0, view: driver, heading: 10, pitch: -3,
    reflections: true, exposure: auto}
  behind: {mode: lagrangian, vehicle: v1, view: chase, eye_height: 2.5,
    lens: {fov: 70, distortion: -0.1}}
shots: [{camera: driver, from: 4, to: 6}, {camera: behind, from: 5, to: 7, speed: 2}]
overlays:
  text: [{text: A drive, place: top_left, to: 1}]
  speed: {place: bottom_left, unit: mph}
  clock: {form: seconds}
  labels: [{ids: v*, text: "{id} {speed}", reach: 80}]
  map: {place: bottom_right, north_up: true}
  fade: {in: 0.2, out: 0.2}
  captions: [{text: The light changes, from: 0.5, to: 1}]
textured: false
""",
    "cinematic": """sky: {preset: sky_blue, rotation: 30}
weather:
  fog: {visibility: 400 m}
  course: [{time: 0, wetness: 0}, {time: 10, wetness: 1, snow: {depth: 2 cm, roads: tracked}}]
cameras:
  flight:
    mode: cinematic
    keyframes:
      - {time: 0, position: [-60, -20, 12], look_at: [0, 0, 0], fov: 50}
      - {time: 6, position: [-20, -25, 8], heading: 40, pitch: -12, roll: 2}
      - {time: 12, position: [20, -20, 10], look_at: [10, 0, 1]}
    lens: {projection: fisheye, fov: 180}
  plan: {mode: eulerian, position: [0, 0, 80], heading: 0, pitch: -90,
    lens: {projection: orthographic, width: 120 m}}
shots: [{camera: flight, from: 0, to: 12, speed: 10}]
output: {size: [320, 320], response: dashcam}
quality: draft
""",
}

FILM = """template: abstract
quality: draft
seed: 3
cameras:
  post: {mode: eulerian, position: [30, -22, 6], look_at: [5, -3, 0], lens: {fov: 60}}
  driver: {mode: lagrangian, vehicle: v0, view: driver}
shots: [{camera: post, from: 4, to: 4.2}]
output: {size: [32, 18], fps: 10}
"""

STUDY = """scene: scene.yaml
factors:
  paint:
    about: colour of the first car
    better: last
    levels:
      red: {vehicles.by_id: {v0: {colour: "#c00000"}}}
      blue: {vehicles.by_id: {v0: {colour: "#0000c0"}}}
seed: 4
question: {text: How safe is that?, low: not at all, high: very}
playlists: {order: latin, repeat: 2}
tools: {write: [psychds]}
report: {write: false}
calibration: null
about: {title: Paint, authors: [Ada Lovelace], date: 2026-11-30, licence: CC-BY-4.0,
  keywords: [paint]}
"""

NODES = """<nodes><node id="a" x="-200" y="0"/><node id="m" x="0" y="0" type="traffic_light"/>
<node id="b" x="200" y="0"/></nodes>
"""

EDGES = """<edges><edge id="w" from="a" to="m" numLanes="2" speed="13.9"/>
<edge id="e" from="m" to="b" numLanes="2" speed="13.9"/></edges>
"""

CONFIGURATION = """<configuration><input><net-file value="net.net.xml"/>
<route-files value="rou.xml"/></input><time><begin value="0"/><end value="6"/></time>
</configuration>
"""

ROUTES = """<routes><vType id="car" vClass="passenger"/>
<vehicle id="v0" type="car" depart="0" departPos="150"><route edges="w e"/></vehicle></routes>
"""


def run(*words: object) -> None:
    """Run a command; none may fail."""
    if main([*map(str, words), "-q"]) != 0:
        raise SystemExit(f"failed: {words}")


def write_scenes(folder: Path) -> None:
    """Write scene files, and beside each the settings that it means, with its defaults."""
    folder.mkdir()
    for name, text in SCENES.items():
        path = folder / f"{name}.yaml"
        path.write_text(HEAD + text, encoding="utf-8")
        meant = with_files(load_job(path).model_dump(by_alias=True, mode="json"), lambda f: f.name)
        text = json.dumps(named(meant), indent=1, ensure_ascii=False)
        path.with_suffix(".json").write_text(text + "\n", encoding="utf-8")


def named(value: object) -> object:
    """Return settings as JSON in which files of the simulation stand by their names."""
    if isinstance(value, dict):
        return {key: named(item) for key, item in value.items()}
    if isinstance(value, list):
        return [named(item) for item in value]
    return Path(value).name if isinstance(value, str) and value.endswith(".xml") else value


def write_plan(scene: Path, folder: Path) -> None:
    """Write a farm's plan, without the film that it made."""
    folder.mkdir()
    run("farm", scene, "-o", folder / "film.mp4", "--workers", 1)
    shutil.move(folder / "film.farm" / "plan.json", folder)
    for path in [*folder.glob("film.*")]:
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def write_recording(folder: Path) -> None:
    """Write a recording, where SUMO is there."""
    with tempfile.TemporaryDirectory() as name:
        source = Path(name)
        (source / "own.nod.xml").write_text(NODES, encoding="utf-8")
        (source / "own.edg.xml").write_text(EDGES, encoding="utf-8")
        words = ["-n", "own.nod.xml", "-e", "own.edg.xml", "-o", "net.net.xml", "--no-turnarounds"]
        call("netconvert", words, folder=source)
        (source / "rou.xml").write_text(ROUTES, encoding="utf-8")
        (source / "own.sumocfg").write_text(CONFIGURATION, encoding="utf-8")
        run("record", source / "own.sumocfg", "-o", source / "recording")
        shutil.copytree(source, folder)


def write_corpus(folder: Path) -> None:
    """Write all of it into a new folder; commands run in it, so that they name no machine."""
    (folder / "town").mkdir(parents=True)
    write_scenario(folder / "town", signals=True, trees=True, persons=1, vehicles=3)
    (folder / "town" / "scene.yaml").unlink()
    write_scenes(folder / "scenes")
    with contextlib.chdir(folder):
        film, study = Path("film"), Path("study_file")
        for place in (film, study):
            place.mkdir()
            (place / "scene.yaml").write_text(HEAD + FILM, encoding="utf-8")
        run("render", film / "scene.yaml", "-o", film / "film.mp4")
        (study / "study.yaml").write_text(STUDY, encoding="utf-8")
        run("study", study / "study.yaml", "-o", "study", "--discard-frames")
        write_plan(film / "scene.yaml", Path("farm"))
        write_recording(Path("recording"))
    # Frames and layers need not be there: digests in records stand for them.
    for beside in [*(folder / "study" / "materials").glob("*.*/")]:
        shutil.rmtree(beside)


if __name__ == "__main__":
    write_corpus(CORPUS / f"v{'.'.join(__version__.split('.')[:2])}")
