"""Which barrier a polyline becomes."""

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.model.network import Location, Network
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import FENCES, KINDS, Staging, kind_of
from sumo3dviz_pt.world.objects.lines import fence_model, line_parts
from sumo3dviz_pt.world.placement.surroundings import surroundings

KIND = next(kind for kind in KINDS if kind.name == "fences")
AROUND = surroundings(Network({}, {}, (), Location()), seed=1)


def line(type_):
    return Polygon("f", type_, np.array([(0.0, 0.0), (30.0, 0.0)]), False, None, "f.add.xml")


@pytest.mark.parametrize(
    ("type_", "model", "wanted"),
    [
        ("fence", (), "guard_rail"),
        ("fence", ("wooden",), "wooden"),
        ("noise_barrier", ("wooden",), "noise_barrier"),
        ("Concrete_Barrier", (), "concrete_barrier"),
        ("chain_link", (), "chain_link"),
    ],
)
def test_types_choose_a_model_and_settings_the_rest(type_, model, wanted):
    assert fence_model(line(type_), ObjectSettings(model=model)) == wanted
    assert kind_of(type_, "") == "fences"


@pytest.mark.parametrize(
    ("model", "tall"), list(zip(FENCES, (0.76, 0.81, 3.04, 1.55, 1.2), strict=True))
)
def test_every_model_is_built_at_its_height_and_can_be_painted(model, tall):
    for colour in (None, "#ff0000"):
        settings = ObjectSettings(colour=colour)
        parts = line_parts(KIND, settings, [line(model)], Staging(AROUND))
        top = max(part.mesh.vertices[:, 2].max() for part in parts)
        assert top == pytest.approx(tall, abs=0.07)
        assert ({part.material for part in parts} == {"sign"}) == (
            colour is not None or model == "concrete_barrier"
        )
