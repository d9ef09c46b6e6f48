"""Lamps and beams as points that shine."""

import numpy as np
import pytest

from sumo3dviz_pt.model.scene import Beam, Lobe
from sumo3dviz_pt.render.lights.emitter import Glow, lobe_row
from sumo3dviz_pt.render.lights.standing import sources_of

LAMBERT = Lobe()
HERE = (np.zeros(3), np.zeros(3))


def glow(*radiances, lobe=LAMBERT):
    """Lamps of two faces each, ten metres apart, that shine to the north."""
    count = len(radiances)
    places = np.array([[10.0 * k, 5.0 + side, 0.0] for k in range(count) for side in (-1, 1)])
    return Glow(
        np.array(radiances, dtype=float)[:, None] * np.ones(3),
        np.tile([0.0, 1.0, 0.0], (count, 1)),
        np.tile(lobe_row(lobe), (count, 1)),
        np.full(2 * count, 0.25),
        np.repeat(np.arange(count), 2),
        places,
    )


def found(*glows, room=3, placed=None, beams=(), beam=None):
    """What shines."""
    return sources_of(glows, placed or {}, beams=beams, beam=beam, room=room, seen=HERE)


def test_a_lamp_is_a_point_in_the_middle_of_its_faces():
    shown = found(glow(2.0), room=1)
    assert shown.places[0] == pytest.approx([0.0, 5.0, 0.0])
    assert shown.colours[0] == pytest.approx([1.0] * 3)
    ways = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.8, 0.0]])
    assert shown.towards(ways[:, None, :])[:, 0] == pytest.approx([1.0, 0.0, 0.8])


def test_a_lobe_narrows_what_a_lamp_gives():
    lobe = Lobe(0.1, 20.0)
    shown = found(glow(2.0, lobe=lobe), room=1)
    way = np.array([[[0.6, 0.8, 0.0]]])
    assert shown.towards(way)[0, 0] == pytest.approx(0.8 * float(lobe.at(np.array(0.8))))
    rng = np.random.default_rng(3)
    ways = rng.normal(size=(200_000, 1, 3))
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    assert shown.towards(ways).mean() == pytest.approx(shown.mean[0], rel=0.02)


def test_the_strongest_are_kept_and_tables_have_one_size():
    shown = found(glow(1.0, 0.0, 5.0, 3.0), room=2)
    assert sorted(shown.colours[:, 0]) == pytest.approx([0.5, 2.5]) or len(shown.places) == 2
    assert len(found(glow(1.0), room=4).places) == 4
    assert found(glow(1.0), room=4).colours[1:].max() == 0.0


def test_beams_shine_where_their_pattern_does():
    pattern = np.zeros((8, 8), np.float32)
    pattern[4:, :] = 1.0
    beam = Beam(pattern, np.pi / 4, (1.0, 1.0, 1.0))
    spot = np.eye(4)
    spot[:3, 3] = (1.0, 2.0, 3.0)
    shown = found(
        room=1, placed={"b": (spot, np.array([2.0, 2.0, 2.0]))}, beams=("a", "b"), beam=beam
    )
    assert shown.beams == 2 and shown.places[2] == pytest.approx([1.0, 2.0, 3.0])
    below, above = [0.0, -0.3, 1.0], [0.0, 0.3, 1.0]
    ways = np.array([below, above, [0.0, 0.0, -1.0]])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    light = shown.towards(np.repeat(ways[:, None], 3, axis=1))
    assert light[:, 2] == pytest.approx([2.0, 0.0, 0.0]) and light[:, 1].max() == 0.0
