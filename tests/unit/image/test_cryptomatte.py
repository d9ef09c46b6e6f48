"""Cryptomatte: ids, coverage and the manifest."""

import json

import numpy as np

from sumo3dviz_pt.image.layers import header, id_number, mattes
from sumo3dviz_pt.model.layers import murmur3

NAME = "CryptoThing"


def test_numbers_of_names_are_sound_floats():
    for number in range(3000):
        value = id_number(f"vehicle:{number}")
        assert np.isfinite(value)
        assert abs(value) >= np.finfo(np.float32).tiny
    # As the specification has it, unless exponents would be 0 or 255.
    assert id_number("hello").view(np.uint32) == murmur3(b"hello")


def test_shares_of_a_pixel_come_in_their_order():
    places = [[[1, 2, 0]], [[1, 1, 0]], [[2, 2, 0]], [[1, 2, 3]]]
    found = mattes([np.array(one) for one in places], ("", "a", "b", "c"))
    assert sorted(found) == [f"{NAME}{k:02d}.{c}" for k in (0, 1) for c in "ABGR"]
    a, b, c = (id_number(name) for name in "abc")
    np.testing.assert_array_equal(found[f"{NAME}00.R"], [[a, b, c]])
    np.testing.assert_array_equal(found[f"{NAME}00.G"], [[0.75, 0.75, 0.25]])
    np.testing.assert_array_equal(found[f"{NAME}00.B"], [[b, a, 0.0]])
    np.testing.assert_array_equal(found[f"{NAME}00.A"], [[0.25, 0.25, 0.0]])


def test_the_manifest_names_all_numbers():
    words = header(["tree:1", "vehicle:a"])
    assert {key.split("/")[0] for key in words} == {"cryptomatte"}
    assert {len(key.split("/")[1]) for key in words} == {7}
    manifest = json.loads(next(text for key, text in words.items() if key.endswith("manifest")))
    assert manifest == {n: f"{id_number(n).view(np.uint32):08x}" for n in ("tree:1", "vehicle:a")}
