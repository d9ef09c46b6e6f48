"""How frames are finished is stored with them."""

import json

import numpy as np
import pytest

from sumo3dviz_pt.model.scene import Haze
from sumo3dviz_pt.pipeline.films.traced import _finishing_of, _finishing_text
from sumo3dviz_pt.render.passes.finish import Finishing

HORIZON = np.full((8, 3), 0.25, np.float32)


def how(haze=None, **more):
    return Finishing("fast", True, 0.2, haze, HORIZON, **more)


@pytest.mark.parametrize(
    "finishing",
    [how(), how(Haze()), how(Haze((1e-4, 2e-4, 3e-4), falls=0.0045), grainy_sky=True)],
    ids=["no haze", "haze", "snowfall by night"],
)
def test_it_is_read_as_it_was_written(finishing):
    found = _finishing_of(_finishing_text(finishing))
    assert found.haze == finishing.haze
    assert (found.denoiser, found.guided, found.raw_share) == ("fast", True, 0.2)
    assert found.grainy_sky == finishing.grainy_sky
    np.testing.assert_array_equal(found.horizon, HORIZON)


def test_only_what_is_there_is_written():
    said = json.loads(_finishing_text(how(Haze())))
    assert said.keys() == {"denoiser", "guided", "raw_share", "haze", "horizon"}
