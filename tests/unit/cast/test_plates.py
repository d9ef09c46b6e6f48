"""Number plates: one vehicle, one plate, in every frame and every shot."""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.library.vehicles.plates import LETTER, LETTERS, letter, letter_phase, plate_text
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.pipeline.live import Ground
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.build import Shot, build_shot
from sumo3dviz_pt.world.build import World

PHASES = {letter_phase(c): c for c in "ABCDEFGHJKLMNPRSTUVWXYZ0123456789"}


def shot_of(folder, times) -> Shot:
    """Cars seen from a post beside the road."""
    job = load_job(write_scenario(folder, vehicles=6))
    ground = Ground.of(job)
    world = World.of(ground.scenario, job)
    camera = job.cameras["post"].model_copy(update={"position": (-12.0, -12.0, 3.0)})
    return build_shot(world, ground.trajectories, camera=camera, times=np.asarray(times))


def read(frame: FrameState) -> dict[str, set[str]]:
    """What all plates of each vehicle say."""
    found: dict[tuple[str, str], dict[int, str]] = defaultdict(dict)
    for mover in frame.deforming:
        if mover.prototype == LETTER:
            plate, _, place = mover.part.partition("letter")
            found[mover.id, plate][int(place)] = PHASES[mover.phase]
    said: dict[str, set[str]] = defaultdict(set)
    for (vehicle, _), letters in found.items():
        said[vehicle].add("".join(letters[k] for k in range(LETTERS)))
    return dict(said)


def test_every_plate_says_what_its_vehicle_is_called(tmp_path):
    """In each frame, in each shot, whoever else is there; and there is room for all letters."""
    seen: dict[str, set[str]] = defaultdict(set)
    for folder, times in (("a", [4.0, 4.1, 5.0]), ("b", [4.5, 5.0, 6.5])):
        (tmp_path / folder).mkdir()
        shot = shot_of(tmp_path / folder, times)
        for time in times:
            frame = shot.frame_at(time)
            count = Counter(mover.prototype for mover in frame.deforming)[LETTER]
            assert 0 < count <= shot.data.slots.deforming[LETTER]
            for vehicle, texts in read(frame).items():
                seen[vehicle] |= texts
    assert len(seen) >= 4
    assert seen == {vehicle: {plate_text(vehicle)} for vehicle in seen}
    assert len({text for texts in seen.values() for text in texts}) == len(seen)


def test_plates_stand_still_on_their_vehicle(tmp_path):
    """The same letters at the same places of the body, to a tenth of a millimetre."""
    shot = shot_of(tmp_path, [4.0, 4.1, 4.2])
    places: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for time in (4.0, 4.1, 4.2):
        frame = shot.frame_at(time)
        bodies = {m.id: m.world_from_body for m in frame.movers if not m.part}
        for mover in frame.deforming:
            local = np.linalg.inv(bodies[mover.id].matrix) @ mover.world_from_body.matrix
            places[mover.id, mover.part].append(local)
    assert places
    for some in places.values():
        np.testing.assert_allclose(np.ptp(np.array(some), axis=0), 0.0, atol=1e-4)


def test_twenty_thousand_vehicles_bear_twenty_thousand_plates():
    names = [f"vehicle:flow_{flow}.{k}" for flow in range(20) for k in range(1000)]
    assert len({plate_text(name) for name in names}) == len(names)


@pytest.mark.parametrize("character", ["A", "8", "1", "W"])
def test_the_body_of_a_letter_shows_that_letter(character):
    poses = letter().poses
    assert poses is not None
    count = len(poses.vertices) - 1
    shown = poses.vertices[1 + round(letter_phase(character) * count)]
    assert np.ptp(shown[:, 2]) == pytest.approx(1.0, abs=0.12)
    assert 0.3 < np.ptp(shown[:, 1]) <= 1.0
    assert np.abs(shown[:, 1:].min(axis=0) + shown[:, 1:].max(axis=0)).max() < 1e-9
