"""Law 3 of lamps: a scene by day has none that light it; by night whoever drives is lit."""

from dataclasses import replace

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.model.scene import Slots
from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.render.lights.running import Beams, GlowingLenses
from sumo3dviz_pt.report.stress.stress import under_sky
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS

pytestmark = pytest.mark.slow

LIT = sorted(
    set(CLASS_DEFAULTS) - {"pedestrian", "wheelchair", "container", "ship", "aircraft", "drone"}
)
DAYS = ("highway_day", "highway_golden_hour", "city_day", "village_day", "overcast", "abstract")
NIGHTS = ("city_dusk", "city_night")


def types_xml(length):
    """A type for each class that has lamps, `length` times as long as usual."""
    rows = [
        f'<vType id="{name}" vClass="{name}" length="{length * CLASS_DEFAULTS[name].length:.2f}"/>'
        for name in LIT
    ]
    return f"<additional>{''.join(rows)}</additional>"


def fcd_xml():
    """One vehicle of each class, in a row, for two seconds."""
    steps = []
    for time in range(13):
        rows = [
            f'<vehicle id="{name}" x="{4.0 * k - 60 + 2 * time:.2f}" y="-4.8" angle="90"'
            f' type="{name}" speed="2" lane="w_0"/>'
            for k, name in enumerate(LIT)
        ]
        steps.append(f'<timestep time="{time}.00">{"".join(rows)}</timestep>')
    return f"<fcd-export>{''.join(steps)}</fcd-export>"


def parade(folder, *, length=1.0, **overrides):
    """A shot past one vehicle of every class that has lamps."""
    scene = write_scenario(folder, signals=True)
    (folder / "types.add.xml").write_text(types_xml(length), encoding="utf-8")
    (folder / "fcd.xml").write_text(fcd_xml(), encoding="utf-8")
    return prepare(load_job(scene, overrides), Request(camera="post"), frame_times(4, 4.1, 10))


def shining(data, frame):
    """Keys of the vehicles whose lamps of a role can be seen, by role."""
    found = {}
    for mover in (*frame.movers, *frame.far, *frame.deforming):
        for lamp in data.prototypes[mover.prototype].lamps:
            if lamp.role in mover.lit and lamp.role in data.running.intensity:
                found.setdefault(lamp.role, set()).add(mover.id)
    return found


@pytest.mark.parametrize("template", DAYS)
def test_by_day_nothing_lights_the_scene_but_the_sky(tmp_path, template):
    shot = parade(tmp_path, template=template).shot
    data = shot.data
    assert not shot.dark
    assert not any(lamps.sampled for lamps in data.lamps)
    assert all(lamps.radiance is None for lamps in data.lamps), "street lamps or windows"
    assert {lamps.id for lamps in data.lamps} == {"signals"}
    running = data.running
    assert running is not None, "brake lamps are seen by day"
    assert running.beam is None and not running.sampled
    assert not {"head", "tail", "sign"} & set(running.intensity)


@pytest.mark.parametrize("length", [1.0, 2.3], ids=["models", "odd lengths"])
@pytest.mark.parametrize("template", NIGHTS)
def test_by_night_whoever_drives_is_lit(tmp_path, template, length):
    shot = parade(tmp_path, template=template, length=length).shot
    data, frame = shot.data, shot.frame_at(4.0)
    assert shot.dark and data.running.sampled and data.running.beam is not None
    assert all(lamps.sampled for lamps in data.lamps if lamps.radiance is None)
    there = {mover.id for mover in (*frame.movers, *frame.far, *frame.deforming)}
    assert len(there) == len(LIT), "all of them are in view"
    plain = [name for name in data.prototypes if name.split()[0] in CLASS_DEFAULTS]
    assert (length == 1.0) or len(plain) > 4, "no models are that long"
    found = shining(data, frame)
    assert found["head"] == there and found["tail"] == there


def test_lamps_are_drawn_at_every_level(tmp_path):
    """Whoever has a slot has places for its lamps: near, from far, in full detail, opened."""
    data = parade(tmp_path, template="city_night", **{"shots": "[]"}).shot.data
    for level in ("near", "far"):
        names = [name for name, body in data.prototypes.items() if body.lamps]
        slots = Slots(**{level: dict.fromkeys(names, 1)})
        scene = replace(data, slots=slots)
        lamps = sum(len(data.prototypes[name].lamps) for name in names)
        lenses = GlowingLenses(scene, data.running, far=level == "far", floor=-1.0)
        assert lenses.count - 1 == lamps
        assert Beams(scene, data.running.beam, data.running.heads).count > 0


def test_the_lamps_of_a_driver_at_night_light_its_road(tmp_path):
    """Also when the camera sits in the vehicle, whose body is then another one."""
    scene = write_scenario(tmp_path)
    job = load_job(scene, {"template": "city_night"})
    shot = prepare(job, Request(camera="driver"), frame_times(4, 4.1, 10)).shot
    frame = shot.frame_at(4.0)
    own = [mover for mover in frame.movers if mover.id == "vehicle:v0"]
    assert any("head" in shining(shot.data, frame) and "head" in mover.lit for mover in own)
    assert "vehicle:v0" in shining(shot.data, frame)["head"]


@pytest.mark.parametrize(("lights", "dark"), [("on", True), ("off", False)])
def test_the_scene_file_has_the_last_word(tmp_path, lights, dark):
    made = parade(tmp_path, template="city_night" if lights == "off" else "city_day", lights=lights)
    assert made.shot.dark is dark and (made.shot.data.running.beam is not None) is dark
    night = made.job.sky.model_copy(update={"preset": "sky_night3"})
    assert under_sky(made, night).shot.dark is dark


def test_lamps_go_on_with_another_sky(tmp_path):
    made = parade(tmp_path, template="city_day")
    night = made.job.sky.model_copy(update={"preset": "sky_night3"})
    later = under_sky(made, night)
    assert later.shot.dark and later.shot.data.running.beam is not None
    np.testing.assert_array_equal(later.times, made.times)
    assert later.quality == made.quality
