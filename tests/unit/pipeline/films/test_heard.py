"""How tracks become sources of sound, and walls screens."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import OutputSettings
from sumo3dviz_pt.job.surroundings import SoundSettings
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Motion, Trajectory
from sumo3dviz_pt.pipeline.films.heard import _Cast, _evened, _onward, _presence, _runs
from sumo3dviz_pt.pipeline.films.screens import Screens, _drawn, _walls
from sumo3dviz_pt.pipeline.films.sound import Nearby
from sumo3dviz_pt.sound.emission import Emission
from sumo3dviz_pt.sound.propagation import Building
from sumo3dviz_pt.sound.render import Source


def alive(first, last, count=60):
    return (np.arange(count) >= first) & (np.arange(count) <= last)


def test_who_appears_and_vanishes_fades_within_its_time():
    there = _presence(alive(20, 40), (10, 50))
    assert (there[:21] == 0).all() and (there[40:] == 0).all()
    assert (there[25:36] == 1).all() and np.abs(np.diff(there)).max() < 0.4


def test_who_is_there_in_the_first_and_last_picture_was_and_stays():
    assert (_presence(alive(8, 55), (10, 50)) == 1).all()
    assert (_presence(alive(8, 30), (10, 50))[:25] == 1).all()


def test_gaps_part_a_road_user_and_places_go_straight_on():
    found = list(_runs(alive(3, 10) | alive(20, 20) | alive(30, 59)))
    assert found == [slice(3, 11), slice(30, 60)]
    places = np.column_stack([np.arange(60.0), np.zeros(60), np.ones(60)])
    spoilt = np.where(alive(3, 10)[:, None], places, 0.0)
    assert _onward(spoilt, alive(3, 10)) == pytest.approx(places)


def test_speeds_are_evened_out_without_shift():
    steps = np.where(np.arange(100) < 50, 0.0, 2.0)
    smooth = _evened(steps)
    assert len(smooth) == 100 and smooth[0] == 0.0 and smooth[-1] == pytest.approx(2.0)
    assert np.diff(smooth).max() < 0.2 and smooth[50] == pytest.approx(1.0, abs=0.1)


class Steady:
    """Drives east at 10 m/s from 1 s to 3 s; its front is at 0 at 1 s."""

    begin, end = 1.0, 3.0

    def sample(self, times):
        x = 10.0 * (times - 1.0)
        places = np.column_stack([x, 0 * x, 0 * x])
        return Motion(np.ones(len(x), bool), places, 0 * x, 0 * x, 0 * x + 10.0, x)


def sources_of(kind, ridden=None):
    times = 0.02 * np.arange(200)
    ride = Trajectory("a/b", "vehicle", kind.id, (Steady(),))
    around = Nearby((ride,), (kind,), None)
    return times, list(_Cast(around, {}, times, (75, 120), ridden).sources())


def test_a_long_train_is_several_sources_of_its_power_together():
    times, parts = sources_of(VehicleType("t", "tram", 50.0, 2.6, 3.4))
    _, (short,) = sources_of(VehicleType("t", "tram", 12.5, 2.6, 3.4))
    assert len({part.name for part in parts}) == len(parts) == 3
    at = 100  # 2 s
    assert [part.places[at, 0] for part in parts] == pytest.approx([10 - 50 / 6, -15, 10 - 250 / 6])
    powers = [10 ** (0.1 * part.emission.rolling[at]) for part in parts]
    # It has four times as many axles as the short one.
    wanted = short.emission.rolling[at] + 10 * np.log10(4)
    assert 10 * np.log10(sum(powers)) == pytest.approx(wanted)
    # It was there before the film's first picture, at 1.5 s, as it drives on after its end.
    assert parts[0].there[10] == 1.0 and parts[0].places[10, 0] == pytest.approx(
        parts[0].places[at, 0] - 10 * (times[at] - times[10])
    )


def test_only_who_sits_in_a_closed_vehicle_hears_it_from_inside():
    for vclass, inside in (("passenger", True), ("motorcycle", False), ("tram", True)):
        _, found = sources_of(VehicleType("t", vclass, 4.0, 1.8, 1.5), "vehicle:a/b")
        assert [source.own for source in found] == [inside]
    assert sources_of(VehicleType("t", "pedestrian", 0.2, 0.5, 1.7))[1] == []


def box(x, y, *, size=4.0, top=9.0, material="wall"):
    """Four walls of a building, of two triangles each."""
    ring = np.array([[x, y], [x + size, y], [x + size, y + size], [x, y + size]])
    low = np.column_stack([ring, np.zeros(4)])
    high = np.column_stack([ring, np.full(4, top)])
    faces = [(k, (k + 1) % 4, 4 + k) for k in range(4)]
    faces += [((k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    return StaticPart(f"homes/{material}", "homes", Part(
        Mesh(np.concatenate([low, high]), np.array(faces)), material))  # fmt: skip


def test_walls_become_plans_with_tops():
    import shapely

    heard = shapely.Point(0, 0).buffer(50)
    others = [box(20, 0, material="sign"), box(200, 0)]
    found = sorted(_drawn([box(5, 0), box(12, 0, top=5.0), *others], heard), key=lambda p: p[1])
    assert [top for _, top in found] == pytest.approx([5.0, 9.0])
    for plan, _ in found:  # walls have a thickness
        assert 4.0**2 < plan.area < 4.8**2 * 1.05
    lines, tops = _walls(box(5, 0))
    assert len(lines) == 4 and (tops == 9.0).all()


def test_a_source_that_drives_behind_a_house_gets_softer():
    count = 200
    eyes = np.tile([0.0, 0.0, 1.5], (count, 1))
    places = np.column_stack([np.full(count, 30.0), np.linspace(-40, 40, count), np.ones(count)])
    quiet = np.full((count, 8), 60.0)
    source = Source("a", places, np.ones(count), Emission(quiet, quiet, np.zeros(count)))
    house = Building(np.array([[10.0, -4], [14, -4], [14, 4], [10, 4]]), 12.0)
    taken = Screens((house,), 100.0).before(source, eyes).screens
    assert (taken[[0, -1]] == 0).all() and taken[count // 2, 7] > 15
    assert np.abs(np.diff(taken, axis=0)).max() < 3.0
    assert Screens((house,), 20.0).before(source, eyes).screens is None


def test_sound_is_not_asked_for_by_default():
    assert OutputSettings().sound is None and SoundSettings().play == "none"
    with pytest.raises((ConfigError, ValueError), match="play"):
        SoundSettings(play="loud")
