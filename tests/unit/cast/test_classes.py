"""Every vClass and guiShape of SUMO shows a model of the right kind, at its vType's size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import (
    CAR_CLASSES,
    DEFAULT_CAR,
    Choice,
    FigureChoice,
    ModelChoice,
    OwnLooks,
    PlainChoice,
    UserChoice,
    choose,
    drawn_class,
    looks_for,
    models_for,
)
from sumo3dviz_pt.cast.colours import ARMY, paint_of
from sumo3dviz_pt.job.values import OwnLook
from sumo3dviz_pt.library.vehicles.plain_bodies import UNLIT
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS

MODELS, LOOKS = models_for({}), looks_for(())
CARS = {model.name for model in MODELS if "passenger" in model.vclasses}
RIDDEN = {"bicycle", "moped", "motorcycle", "scooter", "rickshaw", "wheelchair"}
BICYCLES = {"bicycle", "bicycle_shorts", "bicycle_sport", "bicycle_step", "bicycle_summer"}
SCOOTERS = {"e_scooter", "e_scooter_office"}
SEMITRAILERS = {"semitrailer_truck", "tanker_truck"}
TRAINS = {"passenger_train", "urban_train"}
CAR_SIZE = (4.6, 1.8, 1.5)

OF_CLASS = {
    # vClass: models at SUMO's default size
    **dict.fromkeys(sorted(CAR_CLASSES & set(CLASS_DEFAULTS) - {"taxi"}), CARS),
    "taxi": {"taxi"},
    "emergency": {"ambulance"},
    "bus": {"city_bus"},
    "coach": {"coach"},
    "delivery": {"delivery_van"},
    "truck": {"rigid_truck"},
    "trailer": SEMITRAILERS,
    "motorcycle": {"motorcycle"},
    "moped": {"moped"},
    "bicycle": BICYCLES,
    "tram": {"tram"},
    "rail_urban": {"urban_train", "tram"},
    "subway": {"urban_train", "tram"},
    "rail": TRAINS,
    "rail_electric": TRAINS,
    "rail_fast": TRAINS,
    "ship": {"ship"},
    "container": {"container"},
    "cable_car": {"cable_cabin"},
    "aircraft": {"airliner_large"},
    "wheelchair": {"wheelchair"},
    "scooter": SCOOTERS,
    "drone": {"quadcopter"},
}

OF_SHAPE = {
    # guiShape: a size that fits it [m], models
    "passenger": (CAR_SIZE, CARS),
    "passenger/sedan": (CAR_SIZE, {"sedan"}),
    "passenger/hatchback": (CAR_SIZE, {"hatchback"}),
    "passenger/wagon": (CAR_SIZE, {"estate"}),
    "passenger/van": (CAR_SIZE, {"van_compact", "people_carrier"}),
    "taxi": (CAR_SIZE, {"taxi"}),
    "evehicle": (CAR_SIZE, CARS),
    "police": (CAR_SIZE, {"police"}),
    "bicycle": ((1.6, 0.65, 1.7), BICYCLES),
    "moped": ((2.1, 0.78, 1.7), {"moped"}),
    "motorcycle": ((2.2, 0.9, 1.5), {"motorcycle"}),
    "scooter": ((1.2, 0.5, 1.7), SCOOTERS),
    "rickshaw": ((2.7, 1.3, 1.7), {"rickshaw"}),
    "delivery": ((6.5, 2.16, 2.86), {"delivery_van"}),
    "truck": ((7.1, 2.4, 2.4), {"rigid_truck"}),
    "truck/semitrailer": ((16.5, 2.55, 4.0), SEMITRAILERS),
    "truck/trailer": ((18.75, 2.55, 4.0), SEMITRAILERS),
    "truck/1trailer": ((18.75, 2.55, 4.0), SEMITRAILERS),
    "bus": ((12.0, 2.5, 3.4), {"city_bus"}),
    "bus/city": ((12.0, 2.5, 3.4), {"city_bus"}),
    "bus/coach": ((13.0, 2.55, 3.7), {"coach"}),
    "bus/overland": ((12.5, 2.55, 3.5), {"coach", "city_bus"}),
    "bus/trolley": ((12.0, 2.5, 3.4), {"coach", "city_bus"}),
    "bus/flexible": ((18.0, 2.5, 3.2), {"articulated_bus"}),
    "rail": ((135.0, 2.84, 3.75), TRAINS),
    "rail/railcar": ((75.0, 2.84, 3.75), TRAINS),
    "rail/cargo": ((400.0, 2.9, 3.9), {"freight_train"}),
    "rail/light": ((32.0, 2.4, 3.3), {"tram"}),
    "rail/city": ((109.5, 3.0, 3.6), {"urban_train", "tram"}),
    "rail/slow": ((135.0, 2.84, 3.75), TRAINS),
    "rail/fast": ((200.0, 2.95, 3.89), {"passenger_train"}),
    "ship": ((17.0, 4.0, 4.0), {"ship"}),
    "emergency": ((6.5, 2.16, 2.86), {"ambulance"}),
    "firebrigade": ((8.0, 2.5, 3.3), {"fire_engine"}),
    "aircraft": ((37.0, 35.0, 11.8), {"airliner"}),
    "unheard-of": (CAR_SIZE, CARS),
}

BY_SIZE = [
    # vClass, size [m], models
    ("ship", (5.0, 2.0, 2.0), {"boat"}),
    ("ship", (46.0, 11.0, 11.0), {"ferry", "cargo_ship"}),
    ("ship", (110.0, 11.4, 7.0), {"cargo_ship"}),
    ("aircraft", (8.3, 11.0, 2.7), {"light_aircraft"}),
    ("aircraft", (37.6, 35.8, 11.8), {"airliner"}),
    ("container", (12.192, 2.438, 2.591), {"container_40"}),
    ("drone", (1.6, 1.6, 0.5), {"quadcopter"}),
    ("cable_car", (2.1, 1.9, 2.2), {"cable_cabin"}),
    ("truck", (16.5, 2.55, 4.0), SEMITRAILERS),
    ("truck", (4.6, 2.0, 2.4), {"delivery_van"}),
    ("bus", (7.2, 2.1, 2.7), {"minibus"}),
    ("rail", (19.0, 2.9, 3.9), {"locomotive"}),
    ("emergency", (8.6, 2.5, 3.3), {"fire_engine"}),
]


def drawn(vclass: str, size, gui_shape: str = "", *, name: str = "a", type_id: str = "t") -> Choice:
    kind = VehicleType(type_id, vclass, *size, gui_shape)
    return choose(kind, name=name, models=MODELS, own={}, seed=3, looks=LOOKS)


def names_of(vclass: str, size, gui_shape: str = "", **kinds: str) -> set[str]:
    """Models of several road users of one vType."""
    choices = [drawn(vclass, size, gui_shape, name=str(k), **kinds) for k in range(12)]
    return {choice.model.name for choice in choices if isinstance(choice, ModelChoice)} | {
        type(choice).__name__ for choice in choices if not isinstance(choice, ModelChoice)
    }


def default_size(vclass: str) -> tuple[float, float, float]:
    size = CLASS_DEFAULTS[vclass]
    return size.length, size.width, size.height


def test_every_class_and_no_other_is_listed():
    assert set(OF_CLASS) | {"pedestrian", "ignoring"} == set(CLASS_DEFAULTS) | {"ignoring"}


@pytest.mark.parametrize("vclass", sorted(set(OF_CLASS) & set(CLASS_DEFAULTS)))
def test_a_class_without_more_shows_its_kind(vclass):
    gui_shape = CLASS_DEFAULTS[vclass].gui_shape
    assert names_of(vclass, default_size(vclass), gui_shape) <= OF_CLASS[vclass]


@pytest.mark.parametrize("gui_shape", sorted(OF_SHAPE))
def test_a_shape_counts_more_than_the_class(gui_shape):
    size, expected = OF_SHAPE[gui_shape]
    for vclass in ("passenger", "custom1", "private"):
        assert names_of(vclass, size, gui_shape) <= expected


@pytest.mark.parametrize(
    ("vclass", "size", "expected"),
    BY_SIZE,
    ids=lambda v: " or ".join(sorted(v)) if isinstance(v, set) else str(v),
)
def test_the_size_picks_among_models(vclass, size, expected):
    assert names_of(vclass, size, CLASS_DEFAULTS[vclass].gui_shape) <= expected


@pytest.mark.parametrize("type_id", ["cargo_1", "FreightTrain", "goods.7"])
def test_a_goods_train_is_known_by_its_type(type_id):
    size = default_size("rail")
    assert names_of("rail", size, "rail", type_id=type_id) == {"freight_train"}
    assert names_of("rail", size, "rail", type_id="ic") <= TRAINS
    assert names_of("truck", default_size("truck"), "truck", type_id=type_id) == {"rigid_truck"}


def test_people_stay_people_and_riders_have_a_persons_size():
    assert isinstance(drawn("pedestrian", default_size("pedestrian"), "pedestrian"), FigureChoice)
    for gui_shape in ("bicycle", "moped", "motorcycle", "scooter", "rickshaw"):
        choice = drawn("passenger", DEFAULT_CAR, gui_shape)
        assert isinstance(choice, ModelChoice)
        assert choice.size == choice.model.size


def test_army_vehicles_are_olive_or_sand():
    kind = VehicleType("t", "army", 8.0, 2.5, 3.0)
    paints = {paint_of("truck", kind, key=str(k), colours="european", seed=1) for k in range(60)}
    assert paints == set(ARMY.colours)
    red = paint_of("truck", kind, key="a", colours=["#800000"], seed=1)
    assert red not in paints


CASES = [
    *((vclass, default_size(vclass), CLASS_DEFAULTS[vclass].gui_shape) for vclass in OF_CLASS),
    *(("passenger", size, gui_shape) for gui_shape, (size, _) in OF_SHAPE.items()),
    *((vclass, size, CLASS_DEFAULTS[vclass].gui_shape) for vclass, size, _ in BY_SIZE),
]


@pytest.mark.parametrize(("vclass", "size", "gui_shape"), CASES, ids=lambda v: str(v))
def test_bodies_have_the_size_of_their_type(vclass, size, gui_shape):
    choice = drawn(vclass, size, gui_shape)
    body = build_body(choice, {})
    if size == DEFAULT_CAR and drawn_class(VehicleType("t", vclass, *size)) in CAR_CLASSES:
        assert all(side <= most * 1.3 for side, most in zip(body.size, size, strict=True))
        return
    assert body.size[0] == pytest.approx(size[0], rel=0.12 if choice.vclass in RIDDEN else 0.02)
    if choice.vclass not in RIDDEN:
        # No model is squeezed or widened by more than a quarter.
        near = np.clip(size[1], 0.8 * choice.model.size[1], 1.25 * choice.model.size[1])
        assert body.size[1] == pytest.approx(near, rel=0.02)
    assert body.size[2] < 26.0


@pytest.mark.parametrize("vclass", sorted(OF_CLASS))
def test_lamps_are_where_a_class_has_them(vclass):
    choice = drawn(vclass, default_size(vclass), CLASS_DEFAULTS[vclass].gui_shape)
    units = build_body(choice, {}).assembly.units
    roles = {lamp.role for unit in units for lamp in unit.prototype.lamps}
    if vclass in ("wheelchair", "container"):
        assert not roles
    elif vclass in UNLIT or vclass == "ship":
        assert roles & {"head", "sign"}
    else:
        assert {"head", "tail"} <= roles


@settings(max_examples=60, deadline=None)
@given(
    vclass=st.sampled_from(sorted(OF_CLASS)),
    length=st.floats(0.2, 400.0),
    width=st.floats(0.3, 60.0),
    height=st.floats(0.2, 40.0),
    name=st.text("abc", min_size=1, max_size=3),
)
def test_any_size_of_any_class_gives_a_body_of_its_length(vclass, length, width, height, name):
    choice = drawn(vclass, (length, width, height), name=name)
    assert isinstance(choice, ModelChoice | PlainChoice)
    if isinstance(choice, PlainChoice):
        assert choice.size == (length, width, height)
        return
    body = build_body(choice, {})
    if choice.vclass not in RIDDEN:
        assert body.size[0] == pytest.approx(length, rel=0.02)
    model = choice.model
    assert body.size[1] / model.size[1] == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize(
    "model", [model for model in MODELS if model.vclasses], ids=lambda m: m.name
)
def test_a_scene_file_can_give_any_model_to_any_class(model):
    own = OwnLooks({"a*": OwnLook(model=model.name, colour="#204060")})
    for vclass in ("passenger", "aircraft", min(model.vclasses)):
        size = default_size(vclass) if vclass in CLASS_DEFAULTS else CAR_SIZE
        choice = own.choice(VehicleType("t", vclass, *size), name="a1", walks=False)
        assert isinstance(choice, ModelChoice)
        assert choice.model.name == model.name
    assert own.choice(VehicleType("t", "passenger", *CAR_SIZE), name="b", walks=False) is None
    assert own.paint("a1", "t") is not None


@pytest.mark.parametrize("vclass", sorted(OF_CLASS))
def test_a_users_own_file_replaces_any_class(vclass):
    kind = VehicleType("t", vclass, *default_size(vclass), CLASS_DEFAULTS[vclass].gui_shape)
    path = Path("own.glb")
    choice = choose(kind, name="a", models=MODELS, own={"t": path}, seed=1, looks=LOOKS)
    assert choice == UserChoice(path, drawn_class(kind), kind.length)


@pytest.mark.parametrize("vclass", sorted(OF_CLASS))
def test_sumos_colours_count_for_every_class(vclass):
    kind = VehicleType("t", vclass, *default_size(vclass), colour=(0.2, 0.4, 0.1))
    assert paint_of(drawn_class(kind), kind, key="a", colours="sumo", seed=1) == (0.2, 0.4, 0.1)
