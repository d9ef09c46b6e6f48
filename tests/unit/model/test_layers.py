"""Layers are asked for by name; channels say where they lie."""

import numpy as np
import pytest

from sumo3dviz_pt.model.layers import Channels, Layers, merged


def picture(channels, size=(4, 3)):
    return np.arange(size[0] * size[1] * channels, dtype=np.float32).reshape(*size[::-1], channels)


def test_layers_are_read_only_and_what_was_given_is_not():
    mine = picture(3)
    layers = Layers({"radiance": mine})
    with pytest.raises(ValueError, match="read-only"):
        layers["radiance"][0, 0] = 0.0
    mine[0, 0] = 7.0
    assert (layers["radiance"][0, 0] == 7.0).all(), "nothing is copied"


def test_layers_of_different_size_are_refused():
    with pytest.raises(ValueError, match="differ in size"):
        Layers({"radiance": picture(3), "depth": np.zeros((3, 5), np.float32)})


def test_layers_are_a_mapping_with_a_size():
    layers = Layers({"radiance": picture(3), "depth": picture(1)[..., 0]})
    assert list(layers) == ["radiance", "depth"] and len(layers) == 2
    assert layers.size == (4, 3) and layers.get("albedo") is None and "depth" in layers
    assert len(Layers()) == 0


def test_later_layers_win():
    old, new = picture(3), picture(3) + 1
    layers = Layers({"radiance": old, "normal": old}) | {"radiance": new, "albedo": old}
    assert list(layers) == ["radiance", "normal", "albedo"]
    assert np.array_equal(layers["radiance"], new) and np.array_equal(layers["normal"], old)


def test_pictures_are_merged_layer_by_layer():
    one = Layers({"radiance": picture(3), "depth": picture(1)[..., 0]})
    total = merged([one, one, one], lambda *arrays: sum(arrays))
    assert list(total) == list(one)
    assert all(np.array_equal(total[name], 3 * one[name]) for name in one)


def test_channels_name_what_was_traced():
    distance = Channels({"depth": slice(0, 1), "hit": slice(3, 4)}, 4)
    channels = distance + Channels.in_order(albedo=3, ids=1)
    traced = picture(8)
    layers = channels.layers(traced)
    assert np.array_equal(layers["depth"], traced[..., 0])
    assert np.array_equal(layers["hit"], traced[..., 3])
    assert np.array_equal(layers["albedo"], traced[..., 4:7])
    assert np.array_equal(layers["ids"], traced[..., 7])


@pytest.mark.parametrize("count", [7, 9])
def test_a_picture_with_other_channels_is_refused(count):
    with pytest.raises(ValueError, match=f"{count} channels, not 8"):
        Channels.in_order(radiance=3, lost=3, depth=1, hit=1).layers(picture(count))
