"""Every road user has a type, whatever its files define and whatever window is read."""

from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.traffic import Trace, TypeGuess, VehicleType
from sumo3dviz_pt.sumo.guesses import TypesOfUsers

OWN = VehicleType("b1", "truck", 9.0, 2.5, 3.0)


def trace(name, type_id="", kind="vehicle"):
    one = np.zeros(1)
    whole = np.full(1, -1)
    return Trace(name, kind, type_id, one, np.zeros((1, 3)), one, one, one, whole, whole)


def classes(types, *traces):
    typed, found = types.typed(traces)
    return [found[each.type_id].vclass for each in typed]


def test_files_win_then_the_scene_file_then_words():
    types = TypesOfUsers({"b1": OWN}, {"b1": "tram", "bus_*": "coach", "x?": "bus", "xy": "taxi"})
    traces = [trace("a", each) for each in ("b1", "bus_3", "x1", "xy", "Linienbus", "odd")]
    assert classes(types, *traces) == ["truck", "coach", "bus", "taxi", "bus", "passenger"]
    assert types.typed(traces)[1]["Linienbus"].length == 12.0


def test_without_types_ids_of_vehicles_tell():
    types = TypesOfUsers({}, {"N*": "tram"})
    traces = [trace("bus_1"), trace("N4"), trace("0"), trace("bus", kind="person")]
    assert classes(types, *traces) == ["bus", "tram", "passenger", "pedestrian"]
    typed, found = types.typed(traces)
    assert [each.type_id for each in typed][2:] == ["DEFAULT_VEHTYPE", "DEFAULT_PEDTYPE"]
    assert set(found) == {each.type_id for each in typed}


def test_ids_of_vehicles_do_not_tell_where_the_log_has_types():
    """SUMO's default type is a car, whatever its vehicle is called."""
    types = TypesOfUsers({})
    assert classes(types, trace("bus_1", "DEFAULT_VEHTYPE"), trace("bus_2", "t0")) == [
        "passenger",
        "passenger",
    ]


def test_a_type_does_not_hang_on_who_else_is_there():
    types = TypesOfUsers({})
    traces = [trace("bus_1"), trace("a", "veh_truck"), trace("b", "t0"), trace("c", "t0")]
    together = types.typed(traces)
    for number, alone in enumerate(traces):
        (own,), found = types.typed([alone])
        assert own.type_id == together[0][number].type_id
        assert found[own.type_id] == together[1][own.type_id]


def test_guesses_name_what_no_file_tells():
    types = TypesOfUsers({"b1": OWN}, {"told": "bus"})
    ids = ("b1", "told", "t0", "t0", "veh_bus", "DEFAULT_TAXITYPE")
    traces = [trace(str(number), each) for number, each in enumerate(ids)]
    traces += [trace("p", "odd", kind="person"), trace("tram_1"), trace("17")]
    assert types.guesses(traces) == (
        TypeGuess("", 1, "tram", "the names say so"),
        TypeGuess("t0", 2),
        TypeGuess("veh_bus", 1, "bus", "the names say so"),
    )


def test_a_type_that_a_file_defines_for_one_vehicle_is_its_own():
    """SUMO's own files of types (--vtype-output, saved states) hold `type@id`, too."""
    own, common = replace(OWN, id="b1@a", length=4.0), OWN
    types = TypesOfUsers({"b1": common, "b1@a": own})
    typed, found = types.typed([trace("a", "b1"), trace("b", "b1")])
    assert [found[each.type_id].length for each in typed] == [4.0, 9.0]
