"""Bodies, colours and places of road users."""

import logging
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import (
    Model,
    ModelChoice,
    PlainChoice,
    choose,
    drawn_class,
    models_for,
)
from sumo3dviz_pt.cast.colours import CLOTHES, SUMO_YELLOW
from sumo3dviz_pt.cast.fitting import model_scale
from sumo3dviz_pt.cast.fleet import build_fleet, find_rider
from sumo3dviz_pt.cast.lamps import VehicleLights, _Log
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.library.paints import EUROPEAN, SOBER
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traffic import Trace, VehicleType
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS

CAR = VehicleType("car", "passenger", 5.0, 1.8, 1.5)
BUS = VehicleType("bus", "bus", 12.0, 2.5, 3.4)
WALKER = VehicleType("ped", "pedestrian", 0.215, 0.478, 1.719)
TYPES = {kind.id: kind for kind in (CAR, BUS, WALKER)}
CARS = frozenset(["passenger"])
MODELS = (
    Model("micro", CARS, (3.2, 1.6, 1.5)),
    Model("hatch", CARS, (4.2, 1.8, 1.5), gui_shapes=("passenger/hatch",)),
    Model("limousine", CARS, (5.2, 1.9, 1.5)),
)


def trajectory_of(name, *, begin=0.0, count=5, kind="vehicle", type_id="car", slope=0.0, yaw=0.0):
    times = begin + np.arange(count)
    along = 5.0 * np.arange(count)
    positions = np.column_stack([along * np.cos(yaw), along * np.sin(yaw), 0 * along])
    ones, none = np.ones(count), np.full(count, -1)
    trace = Trace(
        name, kind, type_id, times, positions, yaw * ones, 5 * ones, slope * ones, none, none
    )
    return smooth(trace, smoother="paper_symmetric", step=1.0)


def fleet_of(*trajectories, seed=0, **settings):
    return build_fleet(trajectories, TYPES, VehicleSettings(**settings), seed=seed)


def test_chance_is_stable_and_even():
    assert share_of(1, "a") == share_of(1, "a")
    assert share_of(1, "a") != share_of(2, "a") != share_of(1, "b")
    shares = np.array([share_of(0, str(k)) for k in range(4000)])
    assert shares.min() >= 0 and shares.max() < 1
    assert np.abs(np.histogram(shares, 10, (0, 1))[0] - 400).max() < 100


def test_pick_follows_the_weights():
    assert [pick((1, 0, 3), share) for share in (0.0, 0.24, 0.26, 0.999999)] == [0, 0, 2, 2]
    assert pick((2.0,), 0.99) == 0


@pytest.mark.parametrize("palette", [EUROPEAN, SOBER, CLOTHES])
def test_palettes_have_sixteen_possible_colours(palette):
    assert len(set(palette.colours)) == len(palette.colours) == len(palette.shares) == 16
    assert np.min(palette.colours) > 0.005 and np.max(palette.colours) <= 0.85


def test_three_quarters_of_cars_have_no_colour():
    colours = np.array([EUROPEAN.draw(5, str(k)) for k in range(3000)])
    grey = np.ptp(colours, axis=1) < 0.08 * colours.max(axis=1) + 0.005
    assert 0.68 < grey.mean() < 0.82


@pytest.mark.parametrize(
    ("kind", "drawn"),
    [
        (CAR, "passenger"),
        (BUS, "bus"),
        (VehicleType("x", "taxi", 4.5, 1.8, 1.5), "taxi"),
        (VehicleType("x", "passenger", 12.0, 2.5, 3.0), "truck"),
        (VehicleType("x", "passenger", 2.0, 0.8, 1.5), "motorcycle"),
        (VehicleType("x", "passenger", 7.1, 2.4, 2.4, "truck/semitrailer"), "truck"),
        (VehicleType("x", "passenger", 5.0, 1.8, 1.5, "passenger/van"), "passenger"),
        (VehicleType("x", "passenger", 5.0, 1.8, 1.5, "unheard-of"), "passenger"),
        # Bologna: cars that may use bus lanes, and a delivery van of a car's size.
        (VehicleType("x", "bus", 4.5, 1.8, 3.4, "passenger/hatchback"), "passenger"),
        (VehicleType("x", "passenger", 5.0, 1.8, 1.5, "delivery"), "passenger"),
        (VehicleType("x", "delivery", 6.5, 2.16, 2.86, "delivery"), "delivery"),
        (VehicleType("x", "emergency", 6.5, 2.16, 2.86, "delivery"), "emergency"),
        (VehicleType("x", "tram", 22.0, 2.4, 3.2, "rail/railcar"), "tram"),
    ],
)
def test_drawn_class(kind, drawn):
    assert drawn_class(kind) == drawn


def test_choice_is_seeded_and_near_the_length():
    def drawn(kind, seed=0):
        options = {"models": MODELS, "own": {}, "seed": seed}
        return [choose(kind, name=str(k), **options).model.name for k in range(300)]

    assert drawn(CAR) == drawn(CAR)
    assert drawn(CAR) != drawn(CAR, seed=1)
    assert min(Counter(drawn(CAR)).values()) > 60
    assert set(drawn(VehicleType("m", "passenger", 3.3, 1.6, 1.5))) == {"micro"}
    named = VehicleType("n", "passenger", 5.0, 1.8, 1.5, "passenger/hatch")
    assert set(drawn(named)) == {"hatch"}


def test_without_models_cars_are_plain():
    choice = choose(CAR, name="a", models=(), own={}, seed=0)
    assert choice == PlainChoice("passenger", (5.0, 1.8, 1.5))


def test_car_keeps_its_proportions_under_sumos_default():
    scale = model_scale((4.2, 1.75, 1.46), wanted=(5.0, 1.8, 1.5))
    np.testing.assert_allclose(scale, 1.8 / 1.75)
    scale = model_scale((6.0, 1.75, 1.46), wanted=(5.0, 1.8, 1.5))
    np.testing.assert_allclose(scale, 5 / 6)


def test_car_takes_the_size_of_its_type():
    np.testing.assert_allclose(
        model_scale((4.0, 2.0, 1.5), wanted=(4.4, 1.8, 1.65)), [1.1, 0.9, 1.1]
    )
    scale = model_scale((4.0, 2.0, 1.5), wanted=(4.4, 1.8, 1.5))
    assert scale[2] == pytest.approx(np.sqrt(1.1 * 0.9))
    assert model_scale((4.0, 1.0, 1.0), wanted=(4.0, 2.0, 2.2)).max() == 1.25
    np.testing.assert_allclose(model_scale((4.5, 1.8, 1.5), wanted=(4.5, 1.8, 3.4)), 1.0)


def test_unknown_model_is_suggested():
    known = ["city_car", "coupe"]
    with pytest.raises(ConfigError, match=f"vehicles.passenger.*did you mean '{known[0]}'"):
        models_for({"passenger": [known[0] + "x"]})
    assert [
        car.name for car in models_for({"passenger": known[:1]}) if "passenger" in car.vclasses
    ] == [known[0]]


def test_every_car_of_the_catalogue_can_be_built():
    cars = [model for model in models_for({}) if model.vclasses & {"passenger", "taxi", "police"}]
    assert len(cars) >= 10
    for model in cars:
        body = build_body(ModelChoice(model, "passenger", model.size), {})
        low, high = _bounds(body.prototype)
        np.testing.assert_allclose(high[0], 0.0, atol=0.03)
        np.testing.assert_allclose(high[0] - low[0], model.size[0], atol=0.06)
        assert abs(low[2]) < 0.02
        assert body.prototype.far
        assert -3.5 < body.seat.eye[0] < body.seat.cowl[0] < 0
        assert body.seat.eye[2] >= 1.2


def _bounds(prototype):
    bounds = np.stack([part.mesh.bounds for part in prototype.parts])
    return bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)


def test_movers_exist_while_they_live():
    fleet = fleet_of(trajectory_of("a"), trajectory_of("b", begin=3.0))
    ids = [[mover.id for mover in fleet.movers_at(t)] for t in (-1, 0, 3.5, 6, 8)]
    assert ids == [[], ["vehicle:a"], ["vehicle:a", "vehicle:b"], ["vehicle:b"], []]
    assert set(fleet.prototypes) == {m.prototype for t in (0, 6) for m in fleet.movers_at(t)}


def test_mover_keeps_body_and_colour_and_stands_at_the_front_bumper():
    trajectory = trajectory_of("a", slope=0.2, yaw=2.0)
    fleet = fleet_of(trajectory)
    first, later = fleet.movers_at(0.5)[0], fleet.movers_at(3.5)[0]
    assert (first.prototype, first.colour) == (later.prototype, later.colour)
    assert first.colour in EUROPEAN.colours
    pose = trajectory.at(0.5)
    body = fleet.body("vehicle:a")
    expected = Transform.from_pose(pose.position, yaw=pose.yaw, pitch=pose.pitch, scale=body.scale)
    np.testing.assert_allclose(first.world_from_body.matrix, expected.matrix, atol=1e-12)


def test_seed_changes_colours():
    trajectories = [trajectory_of(str(k)) for k in range(40)]
    colours = [
        [mover.colour for mover in fleet_of(*trajectories, seed=seed).movers_at(1)]
        for seed in (0, 0, 1)
    ]
    assert colours[0] == colours[1] != colours[2]


def test_sumo_colours_and_own_colours():
    trajectory = trajectory_of("a")
    assert fleet_of(trajectory, colours="sumo").movers_at(1)[0].colour == SUMO_YELLOW
    red = VehicleType("car", "passenger", 5.0, 1.8, 1.5, colour=(1.0, 0.0, 0.0))
    fleet = build_fleet([trajectory], {"car": red}, VehicleSettings(colours="sumo"), seed=0)
    assert fleet.colours == ((0.8, 0.01, 0.01),)
    (colour,) = fleet_of(trajectory, colours=("#808080",)).colours
    np.testing.assert_allclose(colour, 0.2158605, rtol=1e-5)
    with pytest.raises(ConfigError, match=r"vehicles\.colours"):
        fleet_of(trajectory, colours=())


def test_positions_for_culling():
    fleet = fleet_of(trajectory_of("a"), trajectory_of("b", begin=3.0))
    alive, positions = fleet.positions(np.array([0.0, 2.0, 9.0]))
    assert alive.tolist() == [[True, True, False], [False] * 3]
    np.testing.assert_allclose(positions[0, 1], [10, 0, 0], atol=1e-9)
    assert np.isnan(positions[1]).all() and np.isnan(positions[0, 2]).all()
    assert fleet.sizes.shape == (2, 3)
    empty = fleet_of()
    assert empty.movers_at(0.0) == ()
    assert empty.sizes.shape == (0, 3)
    assert empty.positions(np.array([1.0]))[0].shape == (0, 1)


def test_cockpit_is_shown_only_to_the_camera_inside():
    fleet = fleet_of(trajectory_of("a"), trajectory_of("b"))
    ready = fleet.with_cockpit("vehicle:b")
    inside = View(Transform(np.eye(4)), Lens(1.0), rides_in="vehicle:b", cutaway=True)
    outside = View(Transform(np.eye(4)), Lens(1.0), rides_in="vehicle:b")
    shown = [mover.prototype for mover in ready.movers_at(1, view=inside)]
    assert shown[1] == f"{fleet.body('vehicle:b').prototype.name}~cockpit"
    assert "~" not in shown[0]
    assert shown[1] in ready.prototypes and shown[1] not in fleet.prototypes
    for other, view in ((ready, outside), (ready, None), (fleet, inside)):
        assert "~" not in other.movers_at(1, view=view)[1].prototype


def test_rider_is_found_by_id_or_key():
    person = trajectory_of("a", kind="person", type_id="ped")
    fleet = fleet_of(trajectory_of("a"), person)
    assert find_rider(fleet, "a").kind == "vehicle"
    assert find_rider(fleet, "person:a").kind == "person"


def test_plain_bodies_share_prototypes_and_are_announced_once(caplog):
    types = {"long": VehicleType("long", "bus", 12.1, 2.5, 3.4), **TYPES}
    types["stub"] = VehicleType("stub", "rail", 5.0, 2.8, 3.6)
    trajectories = [
        trajectory_of("a", type_id="bus"),
        trajectory_of("b", type_id="long"),
        trajectory_of("c", kind="person", type_id="ped"),
        trajectory_of("d", kind="container", type_id="?"),
        trajectory_of("e", kind="person", type_id="?"),
        trajectory_of("f", type_id="stub"),
    ]
    with caplog.at_level(logging.WARNING):
        fleet = build_fleet(trajectories, types, VehicleSettings(), seed=0)
    assert "WARNING" in {record.levelname for record in caplog.records}
    assert "plain bodies stand for rail" in caplog.text
    for mover, size in zip(fleet.movers_at(1), fleet.sizes, strict=True):
        low, high = _bounds(fleet.prototypes[mover.prototype])
        scale = np.linalg.norm(mover.world_from_body.matrix[:3, :3], axis=0)
        drawn = (high - low) * scale
        assert drawn[0] == pytest.approx(size[0], rel=0.1, abs=0.35)
        assert drawn[2] == pytest.approx(size[2], rel=0.1)
    assert fleet.colours[0] in SOBER.colours
    assert fleet.colours[2] in CLOTHES.colours


def test_user_models_win_by_pattern(tmp_path):
    mesh = tmp_path / "box.obj"
    mesh.write_text("v 0 0 0\nv -2 1 0\nv -2 -1 3\nf 1 2 3\n", encoding="utf-8")
    trajectories = [
        trajectory_of("bus_1"),
        trajectory_of("x", type_id="car"),
        trajectory_of("bus_1", kind="person", type_id="car"),
    ]
    fleet = fleet_of(*trajectories, user_models={"bus_*": mesh})
    names = [mover.prototype for mover in fleet.movers_at(1)]
    assert names[0].startswith("box-")
    assert not any(name.startswith("box-") for name in names[1:])
    np.testing.assert_allclose(fleet.sizes[0], [2, 2, 3])
    by_type = fleet_of(trajectory_of("x"), user_models={"car": mesh})
    assert by_type.movers_at(1)[0].prototype == names[0]


def test_user_models_can_be_as_long_as_their_type(tmp_path):
    mesh = tmp_path / "box.obj"
    mesh.write_text("v 0 0 0\nv -2 1 0\nv -2 -1 3\nf 1 2 3\n", encoding="utf-8")
    options = tmp_path / "box.yaml"
    options.write_text("{mesh: box.obj, scale: fit}", encoding="utf-8")
    fleet = fleet_of(trajectory_of("a"), user_models={"a": options})
    np.testing.assert_allclose(fleet.sizes[0], [5.0, 5.0, 7.5])


def test_user_models_with_colours_bring_materials(tmp_path):
    import trimesh

    box = trimesh.creation.box((4, 2, 1))
    box.visual.face_colors = [255, 0, 0, 255]
    path = tmp_path / "red.ply"
    box.export(path)
    fleet = fleet_of(trajectory_of("a"), user_models={"a": path})
    (material,) = fleet.materials
    assert fleet.prototypes[fleet.movers_at(1)[0].prototype].parts[0].material == material
    np.testing.assert_allclose(
        fleet.materials[material]["bsdf"]["base_color"]["value"], [0.85, 0, 0]
    )


def test_nothing_shines_that_a_body_has_no_lamp_for():
    """Of every class that SUMO knows, though its log says that all brake, blink and flash."""
    classes = sorted(CLASS_DEFAULTS)
    types = {
        name: VehicleType(name, name, size.length, size.width, size.height)
        for name, size in CLASS_DEFAULTS.items()
    }
    log = {f"vehicle:{name}": _Log(np.arange(5.0), np.full(5, 0b100010001011)) for name in classes}
    lights = VehicleLights(log, dark=True, seed=0)
    trajectories = [trajectory_of(name, type_id=name) for name in classes]
    fleet = replace(build_fleet(trajectories, types, VehicleSettings(), seed=0), lights=lights)
    shown = {mover.id.partition(":")[2]: mover.lit for mover in fleet.movers_at(2.0)}
    for k, name in enumerate(classes):
        units = fleet.bodies[k].assembly.units
        has = {lamp.role for unit in units for lamp in unit.prototype.lamps}
        assert shown[name] <= has, name
    assert "brake" not in shown["bicycle"] and "brake" in shown["passenger"]
    assert "brake" in shown["trailer"] and "brake" in shown["bus"]
