"""Layers that are wanted are traced, whatever the quality needs, or refused by name."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from builders import RAW, box, diffuse, frame_of, scene_of, session_of, static, view_at

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.render.backend import choose_backend

SIZE = (8, 6)
WALL = scene_of([static("wall", box((-9, 20, -9), (9, 21, 9)), "red")], {"red": diffuse(0.5)})


@pytest.fixture(autouse=True)
def back_to_llvm() -> Iterator[None]:
    yield
    choose_backend("llvm")


def traced(*layers: str, variant: str = "llvm") -> Layers:
    """What a quality without haze, cap and denoiser finds of a wall 20 m ahead."""
    with session_of(WALL, size=SIZE, variant=variant, layers=layers) as session:
        return session.render(frame_of(view_at([0, 0, 0], fov=30))).layers


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["llvm", "scalar"])
def test_distances_are_traced_where_nothing_needs_them(variant: str) -> None:
    found = traced("radiance", "depth", "hit", variant=variant)
    np.testing.assert_allclose(found["depth"][2:4, 3:5], 20.0, rtol=0.01)
    np.testing.assert_array_equal(found["hit"], 1.0)
    np.testing.assert_array_equal(
        found["radiance"], traced("radiance", variant=variant)["radiance"]
    )


@pytest.mark.slow
def test_surfaces_are_traced_where_nothing_needs_them() -> None:
    if not choose_backend("llvm").jit:
        pytest.skip("scalar variants do not trace them")
    found = traced("normal", "albedo", "radiance")
    assert list(found) == ["normal", "albedo", "radiance"]
    np.testing.assert_allclose(found["normal"], np.broadcast_to([0, -1, 0], (6, 8, 3)), atol=1e-5)
    np.testing.assert_allclose(found["albedo"], 0.5, atol=1e-5)
    np.testing.assert_array_equal(found["radiance"], traced("radiance")["radiance"])


@pytest.mark.slow
def test_layers_that_are_wanted_do_not_change_the_denoised_picture() -> None:
    quality = RAW.model_copy(update={"denoise": "fast", "guides": False})
    frame = frame_of(view_at([0, 0, 0], fov=60))
    found = []
    for layers in (("radiance",), ("radiance", "normal", "albedo")):
        if layers[1:] and not choose_backend("llvm").jit:
            pytest.skip("scalar variants do not trace them")
        with session_of(WALL, size=(32, 24), quality=quality, layers=layers) as session:
            found.append(session.render(frame).radiance)
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize(
    ("layer", "variant", "hint"),
    [
        ("normals", "llvm", "did you mean 'normal'"),
        ("glow", "llvm", "known: "),
        ("albedo", "scalar", "known: capped, depth, hit, lost, radiance"),
    ],
)
def test_what_cannot_be_traced_is_refused(layer: str, variant: str, hint: str) -> None:
    if variant == "llvm" and not choose_backend(variant).jit:
        pytest.skip("scalar variants know fewer layers")
    with pytest.raises(ConfigError, match=f"{layer!r}.*{hint}"):
        traced("radiance", layer, variant=variant)
