"""Names become numbers and classes."""

import pytest

from sumo3dviz_pt.model.layers import LABELS, Thing, murmur3, number_of, thing_named


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        # Values that other implementations of MurmurHash3_x86_32 with seed 0 give.
        (b"", 0),
        (b"test", 0xBA6BD213),
        (b"Hello, world!", 0xC0363E43),
        (b"The quick brown fox jumps over the lazy dog", 0x2E4FF723),
    ],
)
def test_numbers_are_hashes_that_others_know(data, expected):
    assert murmur3(data) == expected


def test_the_sky_is_nothing():
    assert number_of("sky") == 0
    assert thing_named("sky") == Thing("sky", "sky")


@pytest.mark.parametrize(
    ("name", "more", "label"),
    [
        ("tree:t0", {}, "vegetation"),
        ("house:1:2", {}, "building"),
        ("signal:C/0/0", {}, "traffic light"),
        ("edge:E1", {}, "road"),
        ("sidewalk::C_w1", {}, "sidewalk"),
        ("bench:1.0,2.0,0.0", {}, "static"),
        ("ground", {}, "terrain"),
        ("ground/woods", {}, "vegetation"),
        ("ground/far", {}, "terrain"),
        ("something/else", {}, "static"),
        ("vehicle:a", {"vclass": "passenger"}, "car"),
        ("vehicle:a", {"vclass": "tram"}, "train"),
        ("vehicle:a", {"vclass": "bicycle"}, "bicycle"),
        ("vehicle:a", {"vclass": "bus", "ego": True}, "ego vehicle"),
        ("person:a", {"vclass": "pedestrian"}, "person"),
    ],
)
def test_names_say_the_class(name, more, label):
    thing = thing_named(name, **more)
    assert thing.label == label
    assert thing.label_id == LABELS[label]
    assert thing.moves == name.startswith(("vehicle", "person"))
