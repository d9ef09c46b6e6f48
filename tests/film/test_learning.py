"""An episode of a gymnasium environment becomes a film, as the manual says."""

from __future__ import annotations

import numpy as np
import pytest
from needed import package

package("libsumo", "needs the extra sumo")
checks = package("gymnasium.utils.env_checker")

pytestmark = pytest.mark.slow


def test_the_light_is_an_environment_as_gymnasium_wants_it():
    from examples.crossing.agent import TrafficLight

    light = TrafficLight(end=40)
    checks.check_env(light, skip_render_check=True)
    light.close()


def test_one_seed_is_one_day():
    from examples.crossing.agent import TrafficLight

    def rewards(seed):
        light = TrafficLight(end=90)
        light.reset(seed=seed)
        found, over = [], False
        while not over:
            _, reward, _, over, _ = light.step(0)
            found.append(reward)
        light.close()
        return found

    assert rewards(3) == rewards(3) != rewards(4)


def test_what_was_learnt_becomes_a_film(tmp_path):
    from examples.crossing.agent import TrafficLight, film, learn

    worth = learn(TrafficLight(end=60), 2)
    assert np.isfinite(worth).all() and worth.min() < 0.0
    path = film(worth, tmp_path, end=60, seconds=0.2, size=(64, 36), quality="draft")
    assert path.stat().st_size > 500
    assert {"fcd.xml.gz", "signals.xml.gz"} <= {file.name for file in tmp_path.iterdir()}
