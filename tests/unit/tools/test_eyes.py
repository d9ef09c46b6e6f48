"""Every view of every kind of body shows the street: none is black."""

import pytest
from make_eyes import DARK, EYES, look, model_names, sheet, write_scene

from sumo3dviz_pt import catalog

KINDS = ("sedan", "rigid_truck", "bicycle", "cargo_ship", "man_shirt")
"""One model of each way to sit, ride, steer and walk."""


def test_the_sheet_shows_the_whole_library():
    assert set(catalog.names("people")) < set(model_names())
    assert {"sedan", "city_bus", "bicycle", "ship"} < set(model_names())


@pytest.mark.slow
def test_no_view_is_dark_by_day(tmp_path):
    scene = write_scene(tmp_path, KINDS)
    views = [name for name in catalog.template_names("camera") if name != "top"]
    found = list(
        look(scene, KINDS, template="city_day", views=views, size=(48, 27), quality="draft")
    )
    assert len(found) == len(KINDS) * len(views)
    dark = {(seen.model, seen.view): seen.luminance for seen in found if seen.luminance <= DARK}
    assert not dark
    picture = sheet([seen for seen in found if seen.view in EYES], models_in_row=2)
    assert picture.size == (2 * (4 * 48 + 6), 3 * (27 + 11))
