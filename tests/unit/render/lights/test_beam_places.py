"""Where the spots of head lamps lie: nothing of the own body stands in their light."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Prototype
from sumo3dviz_pt.render.lights.running import lamp_place

MODELS = {model.name: model for model in models_for({})}
DOWN = np.radians([-0.5, -1.0, -2.0, -4.0, -7.0, -12.0, -20.0])
ASIDE = np.radians([-45.0, -20.0, -5.0, 0.0, 5.0, 20.0, 45.0])
RAYS = np.array(
    [[np.cos(d) * np.cos(a), np.cos(d) * np.sin(a), np.sin(d)] for d in DOWN for a in ASIDE]
)


def hits(triangles: Floats, origin: Floats, rays: Floats) -> Floats:
    """Whether rays from a point hit any of some triangles, (r,): Moeller and Trumbore (1997)."""
    a = triangles[:, 0]
    first, second = triangles[:, 1] - a, triangles[:, 2] - a
    found = []
    for ray in rays:
        across = np.cross(ray, second)
        scale = (first * across).sum(axis=1)
        scale = np.where(np.abs(scale) < 1e-14, np.inf, scale)
        away = origin - a
        u = (away * across).sum(axis=1) / scale
        turned = np.cross(away, first)
        v, t = (turned @ ray) / scale, (turned * second).sum(axis=1) / scale
        found.append(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-9)).any())
    return np.array(found)


def bodies(name: str) -> list[Prototype]:
    """The first unit of a model."""
    model = MODELS[name]
    body = build_body(ModelChoice(model, sorted(model.vclasses)[0], model.size), {})
    return [body.prototype]


@pytest.mark.parametrize("name", sorted(MODELS))
def test_the_own_body_never_shades_the_own_beam(name: str) -> None:
    for body in bodies(name):
        place = lamp_place(body)
        if place is None:
            continue
        for parts in (body.parts, body.far):
            triangles = np.concatenate([p.mesh.vertices[p.mesh.faces] for p in parts])
            assert not hits(triangles, np.array(place), RAYS).any()
