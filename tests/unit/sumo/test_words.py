"""Words of ids tell what vehicles are."""

import pytest

from sumo3dviz_pt.sumo import guesses
from sumo3dviz_pt.sumo.guesses import class_of_type, class_of_vehicle
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS


@pytest.mark.parametrize(
    ("vclass", "names"),
    {
        "bus": "bus veh_bus pt_bus Linienbus12m busType BUS bus_bus autobús schoolBus",
        "coach": "Reisebus coach_12",
        "truck": "truck LKW h_truck truck_truck camión Vrachtwagen HGV delivery_truck",
        "trailer": "truck_trailer Sattelzug semiTrailer",
        "delivery": "delivery van Lieferwagen furgoneta",
        "bicycle": "bike Fahrrad vélo bicicleta fiets bike_bicycle cargo_bike delivery_bike",
        "motorcycle": "moto motorbike motor_bike Motorrad mot_aggr1 police_motorcycle",
        "tram": "tram Straßenbahn light_rail lightrail pt_tram",
        "rail": "train Zug passenger_train",
        "rail_urban": "rail_urban cityrail",
        "subway": "subway U-Bahn metro",
        "taxi": "taxi cab_3",
        "emergency": "ambulance fire_truck Rettungswagen Feuerwehr",
        "authority": "police Polizei",
        "pedestrian": "pedestrian Fussgänger ped_pedestrian",
        "passenger": "car PKW passenger1 car_aggr1 voiture car_trailer",
    }.items(),
)
def test_types(vclass, names):
    assert {name: class_of_type(name, "vehicle") for name in names.split()} == dict.fromkeys(
        names.split(), vclass
    )


def test_what_is_no_word_tells_nothing():
    names = (
        "",
        "b1",
        "type7",
        "columbus",
        "nimbus",
        "t_0.3",
        "IDM",
        "businesstrip",
        "custom",
        "車",
    )
    assert [class_of_type(name, "vehicle") for name in names] == [None] * len(names)


def test_people_stay_people():
    assert class_of_type("bus", "person") is None
    assert class_of_type("wheelchair", "person") == "wheelchair"
    assert class_of_type("truck", "container") is None


def test_ids_of_vehicles_count_from_their_beginning():
    """What follows is often a place."""
    told = {"bus_12": "bus", "tram:4": "tram", "flow_bus.3": "bus", "motor_bike_2": "motorcycle"}
    assert {name: class_of_vehicle(name, "vehicle") for name in told} == told
    for name in ("E3_busstation", "trip_12", "N7.tram_depot", "0"):
        assert class_of_vehicle(name, "vehicle") is None


def test_every_word_means_a_class_of_sumo():
    assert set(guesses._CLASSES.values()) <= set(CLASS_DEFAULTS)
