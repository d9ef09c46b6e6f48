"""What is gathered for overlays."""

from __future__ import annotations

from sumo3dviz_pt.job.overlays import OverlaySettings
from sumo3dviz_pt.pipeline.films.overlays import unknown_ids


def test_patterns_that_mean_nobody_are_named_once():
    overlays = {
        "labels": [{"ids": ["bus*", "car.1"]}],
        "highlights": [{"ids": "bus*"}, {"ids": "vehicle:car.*"}],
        "trails": [{"ids": "tram"}],
    }
    found = unknown_ids(OverlaySettings.model_validate(overlays), ["vehicle:car.1", "person:p"])
    assert found == ["bus*", "tram"]
