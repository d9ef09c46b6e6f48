"""What pages may ask for: nonsense is refused with its place."""

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.viewer import messages
from sumo3dviz_pt.viewer.messages import parsed


def test_orders_keep_what_was_asked():
    assert parsed({"do": "keys", "down": ["KeyW"], "id": 7}) == messages.Keys(
        do="keys", down=("KeyW",), id=7
    )
    assert parsed({"do": "time", "value": 492}).value == 492.0
    assert parsed({"do": "save", "name": "corner"}).name == "corner"
    assert parsed({"do": "leave"}) == messages.Leave(do="leave")


@pytest.mark.parametrize(
    ("raw", "place"),
    [
        ({}, "do"),
        ({"do": "dance"}, "dance"),
        ({"do": "time"}, "time.value"),
        ({"do": "time", "value": float("nan")}, "time.value"),
        ({"do": "drag", "dx": 1, "dy": 1, "width": 0}, "drag.width"),
        ({"do": "eye", "position": [1, 2], "heading": 0}, "eye.position"),
        ({"do": "eye", "position": [1, 2, float("inf")], "heading": 0}, "eye.position"),
        ({"do": "pick", "x": 1.5, "y": 0}, "pick.x"),
        ({"do": "exposure", "ev": 99}, "exposure.ev"),
        ({"do": "keys", "down": ["KeyW"] * 99}, "keys.down"),
        ({"do": "keyframe", "act": "burn"}, "keyframe.act"),
        ({"do": "leave", "now": True}, "leave.now"),
        ({"do": "save"}, "save.name"),
        ({"do": "save", "name": "x" * 201}, "save.name"),
    ],
)
def test_nonsense_is_refused_with_its_place(raw, place):
    with pytest.raises(ConfigError) as caught:
        parsed(raw)
    assert place in str(caught.value) and len(str(caught.value).splitlines()) == 1
