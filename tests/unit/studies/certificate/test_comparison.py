"""Two frames compared pixel by pixel."""

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.model.scene import LENS_THAT_SHINES
from sumo3dviz_pt.studies.certificate.acts import ROAD_LIFT, WATER_TILT, Acts
from sumo3dviz_pt.studies.certificate.comparison import compare, differing_things, pixel_verdict
from sumo3dviz_pt.studies.certificate.evidence import Evidence, compared_frames

ROAD, CAR, TREE = 1, 2, 3
CAR_MAY_LOOK = Acts(looks=("vehicle:car",))


def frame(*, noise=0):
    """A road with a car, 6 x 8 pixels."""
    things = np.full((6, 8), ROAD)
    things[2:4, 2:5] = CAR
    rng = np.random.default_rng(noise)
    return Evidence(
        things,
        {0: "sky", ROAD: "edge:e", CAR: "vehicle:car", TREE: "tree:1"},
        {"edge:e": "road", "vehicle:car": "car", "tree:1": "vegetation"},
        {
            "depth": np.full((6, 8), 20.0, np.float32),
            "normals": np.tile(np.float32([0, 0, 1]), (6, 8, 1)),
            "albedo": np.full((6, 8, 3), 0.3, np.float32),
        },
        rng.uniform(0.4, 0.6, (6, 8, 3)).astype(np.float32),
        np.full((6, 8, 3), 120, np.uint8),
        np.tile([0.8, 0.0, -0.6], (6, 8, 1)),
    )


def altered(base, layer, where, value):
    """The same frame with other values in a layer."""
    changed = np.array(base.layers[layer])
    changed[where] = value
    return replace(base, layers={**base.layers, layer: changed})


def verdict(one, other, acts):
    return pixel_verdict([compare(0, one, other, acts)], acts)


def test_equal_frames_have_no_faults():
    found = verdict(frame(), frame(), CAR_MAY_LOOK)
    assert not found.faults and found.differing == found.wrong == 0 and not found.things


def test_colour_may_differ_where_the_factor_acts_and_only_there():
    red = altered(frame(), "albedo", np.s_[2:4, 2:5], 0.7)
    found = verdict(frame(), red, CAR_MAY_LOOK)
    assert not found.faults and found.differing == 6 / 48
    assert [(thing.name, thing.acts, thing.paint) for thing in found.things] == [
        ("vehicle:car", "colour", 6)
    ]
    (fault,) = verdict(frame(), red, Acts(looks=("vehicle:other",))).faults
    assert "in 6 pixels of 1 frame," in fault and "vehicle:car" in fault


@pytest.mark.parametrize(("layer", "value"), [("depth", 20.01), ("normals", 0.5), ("albedo", 0.32)])
def test_shape_and_paint_must_be_the_same_elsewhere(layer, value):
    other = altered(frame(), layer, np.s_[5, 7], value)
    (fault,) = verdict(frame(), other, CAR_MAY_LOOK).faults
    assert "in 1 pixel of" in fault and "edge:e" in fault


def test_a_spoke_is_the_same_seen_from_its_back():
    """Two films of `examples/crossing` met either side of a spoke: 7.555035 m and 7.5550356 m."""
    one = altered(frame(), "normals", np.s_[5, 7], (-0.8296, -0.0917, -0.5513))
    back = altered(frame(), "normals", np.s_[5, 7], (0.8447, 0.0933, 0.5269))
    assert not verdict(one, back, CAR_MAY_LOOK).faults
    across = altered(frame(), "normals", np.s_[5, 7], (0.5269, 0.0933, -0.8447))
    assert verdict(one, across, CAR_MAY_LOOK).faults


def test_a_lamp_that_shines_is_another_body_where_light_is_the_factor():
    night = altered(frame(), "albedo", np.s_[2, 2], LENS_THAT_SHINES)
    night = altered(night, "depth", np.s_[2, 2], 19.93)
    night = altered(night, "normals", np.s_[2, 2], (-0.97, 0.25, 0.0))
    night.things[1, 2] = CAR  # it stands out beyond the car's edge
    night = altered(night, "albedo", np.s_[1, 2], LENS_THAT_SHINES)
    assert not verdict(frame(), night, Acts(light=True)).faults
    assert verdict(frame(), night, Acts(looks=("vehicle:car",))).faults
    # What is painted otherwise is no lamp.
    painted = altered(night, "albedo", np.s_[2, 2], 0.001)
    assert verdict(frame(), painted, Acts(light=True)).faults


def test_the_car_keeps_its_shape_if_only_its_looks_may_differ():
    nearer = altered(frame(), "depth", np.s_[2:4, 2:5], 19.0)
    assert verdict(frame(), nearer, CAR_MAY_LOOK).faults
    assert not verdict(frame(), nearer, Acts(things=("vehicle:car",))).faults


WET = Acts(looks=("*",), light=True, tilt=WATER_TILT)


def test_rings_of_drops_are_no_steeper_than_the_rule_says():
    """By the model of the renderer: so many layers of rings, each with its steepest wave."""
    from sumo3dviz_pt.render.kernel.deposits import _RINGS, _STEEP

    off = np.linspace(-2, 2, 4001)
    steepest = _RINGS * _STEEP * np.abs(np.sin(2 * np.pi * off) * np.exp(-2 * off**2)).max()
    assert WATER_TILT - 1.5 < np.degrees(np.arctan(steepest)) < WATER_TILT


def test_water_lies_on_level_ground_and_leans_as_far_as_its_rings():
    rippled = altered(frame(), "normals", np.s_[5, 0], (0.45, 0.2, 0.87))
    assert not verdict(frame(), rippled, WET).faults
    # Not without water, not steeper, not on road users, and nothing moves.
    assert verdict(frame(), rippled, Acts(looks=("*",), light=True)).faults
    steep = altered(frame(), "normals", np.s_[5, 0], (0.6, 0.0, 0.8))
    assert verdict(frame(), steep, WET).faults
    assert verdict(frame(), altered(frame(), "normals", np.s_[2, 2], (0.45, 0.2, 0.87)), WET).faults
    assert verdict(frame(), altered(rippled, "depth", np.s_[5, 0], 20.1), WET).faults


def test_a_coloured_road_is_lower_by_its_wear_and_no_more():
    """Seen at 37 degrees: 2 mm of height are 3.3 mm along the ray."""
    road = Acts(looks=("edge:*",), lift=ROAD_LIFT)
    assert not verdict(frame(), altered(frame(), "depth", np.s_[5, 0], 20.0033), road).faults
    assert verdict(frame(), altered(frame(), "depth", np.s_[5, 0], 20.02), road).faults
    assert verdict(frame(), altered(frame(), "depth", np.s_[5, 0], 20.0033), CAR_MAY_LOOK).faults


def test_surfaces_in_one_plane_are_one_place():
    """A court and a sidewalk of `examples/crossing`: 15.477878 and 15.477879 m."""
    court = altered(frame(), "depth", np.s_[5, 0], 20.000001)
    court = replace(court, things=np.array(court.things), names={**court.names, 9: "court:1_2"})
    court.things[5, 0] = 9
    assert not verdict(frame(), court, CAR_MAY_LOOK).faults
    assert verdict(frame(), altered(court, "albedo", np.s_[5, 0], 0.4), CAR_MAY_LOOK).faults
    assert verdict(frame(), altered(court, "depth", np.s_[5, 0], 20.0004), CAR_MAY_LOOK).faults
    # Somebody in another's place is somebody else.
    taken = replace(frame(), things=np.array(frame().things), names={**court.names, 9: "vehicle:x"})
    taken.things[2, 2] = 9
    assert verdict(frame(), taken, Acts(looks=("vehicle:*",))).faults


def test_a_seam_of_a_pavement_has_either_colour_where_roundings_differ():
    """Two stones of `examples/crossing` at 640x360: 14.970139 m and 14.970138 m."""
    one = altered(frame(), "depth", np.s_[5, 0], 14.970139)
    stone = altered(altered(one, "albedo", np.s_[5, 0], 0.18), "depth", np.s_[5, 0], 14.970138)
    assert not verdict(one, stone, CAR_MAY_LOOK).faults
    # Paint that is changed leaves the depth as it is, and a seam is a pixel, no area.
    painted = altered(one, "albedo", np.s_[5, 0], 0.18)
    assert verdict(one, painted, CAR_MAY_LOOK).faults
    area = altered(stone, "albedo", np.s_[5, :2], 0.18)
    area = altered(area, "depth", np.s_[5, 1], 20.000002)
    assert verdict(one, area, CAR_MAY_LOOK).faults
    turned = altered(stone, "normals", np.s_[5, 0], (0.6, 0.0, 0.8))
    assert verdict(one, turned, CAR_MAY_LOOK).faults


def test_two_leaves_that_cross_at_one_depth_are_no_other_place():
    """Leaves of two trees lean otherwise, and last bits say which of them a ray meets."""
    names, labels = {9: "tree:2"}, {"tree:2": "vegetation"}
    one = replace(frame(), things=np.array(frame().things))
    one.things[5, 0:2] = TREE
    crossed = altered(one, "normals", np.s_[5, 0], (0.6, 0.0, 0.8))
    crossed = altered(crossed, "albedo", np.s_[5, 0], 0.34)
    crossed = altered(crossed, "depth", np.s_[5, 0], 20.000001)
    crossed = replace(crossed, things=np.array(crossed.things))
    crossed.things[5, 0] = 9
    crossed = replace(
        crossed, names={**crossed.names, **names}, labels={**crossed.labels, **labels}
    )
    assert not verdict(one, crossed, CAR_MAY_LOOK).faults
    # Two pixels of 48 are no chance.
    both = altered(crossed, "normals", np.s_[5, 0:2], (0.6, 0.0, 0.8))
    both.things[5, 1] = 9
    assert verdict(one, both, CAR_MAY_LOOK).faults
    assert verdict(one, altered(crossed, "depth", np.s_[5, 0], 20.01), CAR_MAY_LOOK).faults


def test_two_leaves_of_one_tree_cross_in_single_pixels():
    """`study_weather.yaml` at 1280x720 met either leaf of a tree, 77.00827 m away in both films."""
    one = replace(frame(), things=np.array(frame().things))
    one.things[4:, :] = TREE
    other = altered(one, "normals", np.s_[5, 0], (0.6, 0.0, 0.8))
    assert not verdict(one, other, CAR_MAY_LOOK).faults
    assert not verdict(one, altered(other, "albedo", np.s_[5, 0], 0.34), CAR_MAY_LOOK).faults
    # A tree that leans otherwise does so in pixels beside each other; roads have no leaves.
    assert verdict(one, altered(other, "normals", np.s_[4, 1], (0.6, 0, 0.8)), CAR_MAY_LOOK).faults
    assert verdict(one, altered(other, "depth", np.s_[5, 0], 20.01), CAR_MAY_LOOK).faults
    assert verdict(one, altered(one, "normals", np.s_[0, 0], (0.6, 0, 0.8)), CAR_MAY_LOOK).faults


def test_what_is_drawn_over_a_film_must_be_the_same():
    text = np.array(frame().picture)
    text[0, 2:5] = 255
    one, other = replace(frame(), overlaid=text), replace(frame(), overlaid=frame().picture)
    assert not verdict(one, one, CAR_MAY_LOOK).faults
    (fault,) = verdict(one, other, CAR_MAY_LOOK).faults
    assert "drawn over the film, in 3 pixels of 1 frame" in fault
    assert verdict(one, frame(), CAR_MAY_LOOK).faults  # the other has no overlays at all
    assert not verdict(one, other, Acts(overlays=True)).faults


def test_a_missing_tree_is_found_behind_whatever_it_uncovers():
    without = frame()
    with_tree = replace(frame(), things=np.where(frame().things == CAR, CAR, ROAD))
    with_tree.things[0:2, 6:8] = TREE
    with_tree = altered(with_tree, "depth", np.s_[0:2, 6:8], 15.0)
    (fault,) = verdict(with_tree, without, CAR_MAY_LOOK).faults
    assert "in 4 pixels" in fault and "tree:1" in fault
    assert not verdict(with_tree, without, Acts(things=("label:vegetation",))).faults


def test_another_seed_is_found_by_its_light():
    (fault,) = verdict(frame(), frame(noise=1), CAR_MAY_LOOK).faults
    assert "differs in light by" in fault
    assert not verdict(frame(), frame(noise=1), Acts(light=True)).faults


def test_a_shadow_is_listed_and_is_no_fault():
    shaded = frame()
    radiance = np.array(shaded.radiance)
    radiance[5, :4] *= 0.4
    found = verdict(frame(), replace(shaded, radiance=radiance), CAR_MAY_LOOK)
    assert not found.faults
    assert [(thing.name, thing.light) for thing in found.things] == [("edge:e", 4)]


@pytest.mark.parametrize(("shift", "faults"), [(0, 0), (1, 0), (4, 1), (-4, 1)])
def test_a_brighter_or_darker_picture_is_found(shift, faults):
    shifted = np.clip(frame().picture.astype(int) + shift, 0, 255).astype(np.uint8)
    found = verdict(frame(), replace(frame(), picture=shifted), CAR_MAY_LOOK)
    assert len(found.faults) == faults
    assert not verdict(frame(), replace(frame(), picture=shifted), Acts(picture=True)).faults


def test_frames_that_are_gone_leave_light_out():
    gone = replace(frame(noise=3), radiance=None)
    assert not verdict(frame(), gone, CAR_MAY_LOOK).faults


def test_things_are_summed_over_frames():
    red = altered(frame(), "albedo", np.s_[2:4, 2:5], 0.7)
    both = [compare(n, frame(), red, CAR_MAY_LOOK) for n in (0, 4)]
    (thing,) = differing_things(both)
    assert (thing.pixels, thing.paint, thing.shape, thing.codes) == (12, 12, 0, 0.0)


@pytest.mark.parametrize(
    ("count", "wanted", "numbers"),
    [(3, 3, [0, 1, 2]), (3, 9, [0, 1, 2]), (75, 3, [0, 37, 74]), (75, 1, [37]), (1, 5, [0])],
)
def test_compared_frames_lie_evenly(count, wanted, numbers):
    assert compared_frames(count, wanted) == numbers
