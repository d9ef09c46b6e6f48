"""Every key and every file of a scene that pixels hang on makes another key: nothing is kept
that would be rendered otherwise. Who adds a setting need not think of it: all are walked."""

import datetime as dt
import types
from dataclasses import replace
from fractions import Fraction
from numbers import Number
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
import pytest
from builders import write_scenario
from pydantic import BaseModel

from sumo3dviz_pt.job.cameras import ExposureSettings, FocusOn, ShutterSettings
from sumo3dviz_pt.job.overlays import ClockOverlay
from sumo3dviz_pt.job.settings import (
    CinematicCamera,
    EdgeStyle,
    EulerianCamera,
    KeyFrame,
    LagrangianCamera,
    LensSettings,
    OverlaySettings,
    Quality,
    SoundSettings,
    SunSettings,
)
from sumo3dviz_pt.job.surroundings import (
    FogSettings,
    RainSettings,
    RideEdit,
    SnowSettings,
    TrafficSettings,
    WeatherMoment,
    WeatherSettings,
    WindSettings,
)
from sumo3dviz_pt.job.values import OwnLook
from sumo3dviz_pt.library.vehicles.user_mesh import companions
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import ScenarioFiles
from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.worlds import _key_of

KEYS = [KeyFrame(time=4.0, position=(30, -22, 6), look_at=(5, -3, 0))]
KEYS.append(KeyFrame(time=9.0, position=(60, -30, 9), heading=300.0))
CAMERAS = {
    "post": EulerianCamera(mode="eulerian", position=(30, -22, 6), look_at=(5, -3, 0)),
    "other": EulerianCamera(mode="eulerian", position=(90, -22, 6), heading=10.0),
    "driver": LagrangianCamera(mode="lagrangian", vehicle="v0"),
    "flight": CinematicCamera(mode="cinematic", keyframes=tuple(KEYS)),
}

ELSEWHERE = {
    "scenario.sumocfg": "it names files, and they count by content",
    "scenario.folder": "likewise",
    "scenario.network": "files count by content: see below",
    "scenario.trajectories": "likewise",
    "scenario.signals": "likewise",
    "scenario.additional": "likewise",
    "scenario.vehicle_types": "likewise",
    "scenario.allow_misfit": "it lets a log pass, and changes nothing of it",
    "schema_version": "it says how the file is read",
    "template": "its keys are keys of the scene",
    "quality": "its values count: see below",
    "shots": "the window that is rendered counts, whoever asks for it",
    "output.fps": "it makes the times of the frames, and they count",
    "output.codec": "it acts on the film, not on its frames",
    "output.tone": "frames are developed with it, whenever that is",
    "output.glare": "likewise",
    "output.response": "likewise",
    "output.layers": "they lie beside the film",
    "output.sound": "its tables lie beside the film",
    "overlays": "they are drawn over developed pictures",
}
"""Keys that need not make another key by themselves, and why."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A shot, built once: keys are asked for with other settings, nothing is rendered."""
    place = write_scenario(tmp_path_factory.mktemp("keys"), vehicles=3, signals=True, trees=True)
    base = prepare(load_job(place), Request(camera="post"), frame_times(4, 5, 10))
    return replace(base, job=base.job.model_copy(update={"cameras": CAMERAS}))


# Settings ---------------------------------------------------------------------------------------


def plain(annotation: Any) -> Any:
    """An annotation without what only checks it, and without None."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) in (Union, types.UnionType):
        return plain(next(a for a in get_args(annotation) if a is not type(None)))
    return annotation


def literals(annotation: Any) -> list[Any]:
    """All words that an annotation allows."""
    if get_origin(annotation) is Literal:
        return list(get_args(annotation))
    return [word for part in get_args(annotation) for word in literals(part)]


SAMPLES: dict[Any, Any] = {
    Path: Path("other.file"),
    str: "#123456",
    float: 0.5,
    int: 7,
    bool: True,
    Fraction: Fraction(1, 2),
    dt.date: dt.date(2026, 6, 21),
    dt.time: dt.time(17, 30),
    SunSettings: SunSettings(azimuth=200.0, elevation=30.0),
    LensSettings: LensSettings(fov=31.0),
    ShutterSettings: ShutterSettings(angle=90.0),
    ExposureSettings: ExposureSettings(ev=0.5),
    FocusOn: FocusOn(vehicle="v0"),
    EdgeStyle: EdgeStyle(),
    OwnLook: OwnLook(colour="#123456"),
    OverlaySettings: OverlaySettings(clock=ClockOverlay()),
    SoundSettings: SoundSettings(),
    TrafficSettings: TrafficSettings(share=0.5),
    RideEdit: RideEdit(delay=1.0),
    WeatherSettings: WeatherSettings(wetness=0.5),
    FogSettings: FogSettings(visibility=200.0, height=60.0),
    RainSettings: RainSettings(rate=5.0),
    SnowSettings: SnowSettings(depth=0.03),
    WindSettings: WindSettings(speed=3.0),
    WeatherMoment: WeatherMoment(time=4.0),
}
"""A value of each kind; who adds a kind of setting adds one."""


def sample(annotation: Any) -> Any:
    """Some value that an annotation allows."""
    kind = plain(annotation)
    if get_origin(kind) is Literal:
        return get_args(kind)[0]
    if get_origin(kind) is tuple:
        items = get_args(kind)
        return tuple(sample(item) for item in items if item is not Ellipsis)
    if get_origin(kind) is dict:
        return {"x": sample(get_args(kind)[1])}
    return SAMPLES[kind]


def other(value: Any, annotation: Any) -> Any:
    """Another value than a setting has; None if there is only one."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, Number):
        return type(value)(value + 1)
    if isinstance(value, str):
        words = literals(annotation)
        return next((w for w in words if w != value), None) if value in words else f"{value}x"
    if isinstance(value, Path):
        return Path("other.file")
    if isinstance(value, tuple) and value and all(isinstance(each, int | float) for each in value):
        return (*value[:-1], value[-1] + 1)
    if isinstance(value, tuple) and value:
        return (*value, *sample(annotation))
    assert not value, f"no other value is known than {value!r}"
    return sample(annotation)


def changes(model: BaseModel, path: str = ""):
    """Every key below a model with a model in which only that key has another value."""
    for name, field in type(model).model_fields.items():
        found = list(changed_values(getattr(model, name), field.annotation, f"{path}{name}"))
        assert found or len(literals(field.annotation)) == 1, f"{path}{name} is not walked"
        for key, changed in found:
            yield key, model.model_copy(update={name: changed})


def changed_values(value: Any, annotation: Any, here: str):
    """Every key at or below a value with a value in which only that key differs."""
    below = dict(enumerate(value)) if isinstance(value, tuple) else value
    if isinstance(value, BaseModel):
        yield from changes(value, f"{here}.")
        if type(None) in get_args(annotation):
            yield here, None
    elif isinstance(below, dict) and any(isinstance(item, BaseModel) for item in below.values()):
        for key, item in below.items():
            for inner, changed in changed_values(item, None, f"{here}.{key}"):
                whole = {**below, key: changed}
                yield inner, tuple(whole.values()) if isinstance(value, tuple) else whole
    else:
        yield from changed_value(value, annotation, here)


def changed_value(value: Any, annotation: Any, here: str):
    """A value that holds no settings of its own, with another one."""
    changed = other(value, annotation)
    if changed is not None:
        yield here, changed
        if isinstance(changed, dict) and isinstance(changed.get("x"), BaseModel):
            for inner, again in changes(changed["x"], f"{here}.x."):
                yield inner, {"x": again}


def same_keys(made, camera):
    """Keys of the scene file that do not act, of all that there are."""
    base = replace(made, camera=camera)
    found = {key: replace(base, job=job).key for key, job in changes(base.job)}
    assert len(found) > 120, "the walk has lost its way"
    return {key for key, changed in found.items() if changed == base.key}


def rides(key):
    return key.startswith("cameras.driver.")


@pytest.mark.slow
def test_every_key_of_a_scene_counts(made):
    same = {key for key in same_keys(made, "post") if not rides(key)}
    reasons = {key: [a for a in ELSEWHERE if f"{key}.".startswith(f"{a}.")] for key in same}
    assert not [key for key, found in reasons.items() if not found]
    assert {reason for found in reasons.values() for reason in found} == set(ELSEWHERE)


@pytest.mark.slow
@pytest.mark.parametrize("camera", ["driver", "flight"])
def test_every_key_of_a_camera_counts(made, camera):
    same = same_keys(made, camera)
    assert not {key for key in same if key.startswith(f"cameras.{camera}.")}


@pytest.mark.slow
def test_cameras_that_ride_elsewhere_do_not_count(made):
    """They clear nothing; standing and flying ones do, in every shot."""
    same = same_keys(made, "post")
    assert {key for key in same if key.startswith("cameras.")} == {
        f"cameras.driver.{name}" for name in LagrangianCamera.model_fields if name != "mode"
    }
    cameras = {name: each for name, each in CAMERAS.items() if name != "other"}
    job = made.job.model_copy(update={"cameras": cameras})
    assert replace(made, job=job).key != made.key
    hidden = CAMERAS["other"].model_copy(update={"clear_view": False})
    job = made.job.model_copy(update={"cameras": {**cameras, "other": hidden}})
    assert (
        replace(made, job=job).key
        == replace(made, job=made.job.model_copy(update={"cameras": cameras})).key
    )


def test_every_value_of_a_preset_counts(made):
    same = {
        key
        for key, quality in changes(made.quality)
        if replace(made, quality=quality).key == made.key
    }
    assert same == {"purpose"} and len(Quality.model_fields) > 10


def test_what_is_asked_for_and_what_was_planned_counts(made):
    shot = made.shot
    slots = replace(shot.data.slots, far={"sedan": 99})
    keys = [
        made.key,
        replace(made, camera="other").key,
        replace(made, times=made.times[:-1]).key,
        replace(made, times=made.times + 0.5).key,
        replace(made, shot=replace(shot, limit=shot.limit - 1)).key,
        replace(made, shot=replace(shot, full_models=frozenset(["sedan"]))).key,
        replace(made, shot=replace(shot, data=replace(shot.data, slots=slots))).key,
        replace(made, shot=replace(shot, data=replace(shot.data, static=shot.data.static[1:]))).key,
    ]
    assert len(set(keys)) == len(keys)
    # What traces stands beside the key: its frames are of one film, and are not mixed unasked.
    assert replace(made, variant="scalar").key == replace(made, job=made.job).key == made.key


def test_a_shot_its_part_and_a_still_have_three_keys(made):
    """Each is built for its own window: the flight of an example had 822, 956 and 737
    thousand triangles, and one key."""
    windows = ([4.0], frame_times(4, 6, 10), frame_times(4, 9, 10))
    job = made.job
    keys = {prepare(job, Request(camera="flight"), np.array(some)).key for some in windows}
    assert len(keys) == 3


# Files ------------------------------------------------------------------------------------------


def write(path, text="x"):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def written(folder):
    """One file of every kind, some behind others; two logs of one name."""
    mesh = folder / "models"
    write(mesh / "car.yaml", "mesh: deep/car.obj\nscale: fit\n")
    write(mesh / "deep" / "car.obj", "mtllib car.mtl\nv 0 0 0\n")
    write(mesh / "deep" / "car.mtl", "newmtl a\nmap_Kd -s 1 1 1 paint.png\n")
    write(
        mesh / "bus.gltf", '{"buffers": [{"uri": "bus%20body.bin"}], "images": [{"uri": "b.png"}]}'
    )
    write(mesh / "van.ply", "ply\ncomment TextureFile van.png\nend_header\n")
    names = ("deep/paint.png", "bus body.bin", "b.png", "van.png", "tram.glb")
    for name in (*names, "truck.stl", "ground.png", "road.jpg", "edge.exr", "sky.hdr"):
        write(mesh / name)
    for name in ("net.xml", "day1/fcd.xml", "day2/fcd.xml", "tls.xml", "pois.xml", "types.xml"):
        write(folder / name)
    write(folder / "trees.add.xml")


def changed_scene(made, folder):
    """The shot with settings that name all of these files."""
    mesh = folder / "models"
    own = {
        name: mesh / name for name in ("car.yaml", "bus.gltf", "van.ply", "tram.glb", "truck.stl")
    }
    job = made.job
    style = EdgeStyle(surface=str(mesh / "edge.exr"))
    trees = job.objects.trees.model_copy(update={"file": folder / "trees.add.xml"})
    new = {
        "sky": job.sky.model_copy(update={"file": mesh / "sky.hdr", "preset": None}),
        "ground": job.ground.model_copy(update={"texture": str(mesh / "ground.png")}),
        "roads": job.roads.model_copy(
            update={"surface": str(mesh / "road.jpg"), "per_edge": {"w": style}}
        ),
        "vehicles": job.vehicles.model_copy(update={"user_models": own}),
        "objects": job.objects.model_copy(update={"trees": trees}),
    }
    files = ScenarioFiles(
        folder / "net.xml",
        (folder / "day1" / "fcd.xml", folder / "day2" / "fcd.xml"),
        (folder / "tls.xml",),
        (folder / "pois.xml",),
        (folder / "types.xml",),
    )
    return replace(made, job=job.model_copy(update=new), files=files)


def test_every_file_counts_by_its_content(made, tmp_path):
    written(tmp_path)
    base = changed_scene(made, tmp_path)
    paths = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    assert len(paths) == 22
    same, whole = [], base.key
    for path in paths:
        before = path.read_bytes()
        path.write_bytes(before + b"\n# changed\n" if path.suffix == ".yaml" else before + b" ")
        if replace(base, job=base.job).key == whole:
            same.append(path.name)
        path.write_bytes(before)
    assert not same and replace(base, job=base.job).key == whole


def test_every_file_counts_for_the_world_but_those_of_light_and_road_users(made, tmp_path):
    written(tmp_path)
    base = changed_scene(made, tmp_path)
    moving = companions_of(base.job.vehicles.user_models.values())
    moving |= {*base.files.trajectories, *base.files.vehicle_types, base.job.sky.file}

    def key():
        return _key_of(base.job, base.files, (), Location())

    whole, counted = key(), set()
    paths = {path for path in tmp_path.rglob("*") if path.is_file()}
    for path in sorted(paths):
        before = path.read_bytes()
        path.write_bytes(before + b" and more")
        counted |= {path} if key() != whole else set()
        path.write_bytes(before)
        # What is kept of a file goes by its size and time; a later time is another file.
        whole = key()
    assert len(counted) == 7 and counted == paths - moving


def companions_of(models):
    """Models with the files behind them."""
    return {file for model in models for file in (model, *companions(model))}


def test_names_and_places_of_files_do_not_count(made, tmp_path):
    for place in ("here", "there"):
        written(tmp_path / place)
    one, two = (changed_scene(made, tmp_path / place) for place in ("here", "there"))
    assert one.key == two.key
    # Two logs in the other order are another simulation.
    write(tmp_path / "there" / "day1" / "fcd.xml", "y")
    log = two.files.trajectories
    two = replace(two, job=two.job)
    turned = replace(two, files=replace(two.files, trajectories=log[::-1]))
    assert len({one.key, two.key, turned.key}) == 3
