"""Signal logs."""

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.network import Connection, Location, Network
from sumo3dviz_pt.sumo import read_signals


def write(tmp_path, entries, name="tls.xml"):
    rows = "\n".join(
        f'<tlsState time="{time}" id="{tls}" programID="{program}" phase="0" state="{state}"/>'
        for time, tls, program, state in entries
    )
    path = tmp_path / name
    path.write_text(f"<tlsStates>\n{rows}\n</tlsStates>", encoding="utf-8")
    return path


def test_only_changes_are_kept(tmp_path):
    path = write(
        tmp_path,
        [
            (0, "a", 0, "Gr"),
            (0, "b", 0, "r"),
            (1, "a", 0, "Gr"),
            (2, "a", 1, "yr"),
            (3, "a", 1, "rG"),
        ],
    )
    signals = read_signals([path])
    assert signals["a"].times == (0, 2, 3)
    assert signals["a"].states == ("Gr", "yr", "rG")
    assert signals["b"].times == (0,)
    assert signals["a"].state_at(2.5) == "yr"
    assert signals["a"].state_at(-1) is None


def test_full_and_switch_logs_agree(tmp_path):
    states = "GGGyyrrrGG"
    full = [(t, "a", 0, state) for t, state in enumerate(states)]
    switches = [e for i, e in enumerate(full) if i == 0 or full[i - 1][3] != e[3]]
    one = read_signals([write(tmp_path, full, "1.xml")])
    other = read_signals([write(tmp_path, switches, "2.xml")])
    assert one == other


def test_the_first_log_of_a_light_counts(tmp_path):
    first = write(tmp_path, [(0, "a", 0, "G")], "1.xml")
    second = write(tmp_path, [(0, "a", 0, "r"), (0, "b", 0, "r")], "2.xml")
    signals = read_signals([first, second])
    assert (signals["a"].states, signals["b"].states) == (("G",), ("r",))


def test_unordered_and_repeated_times(tmp_path):
    path = write(
        tmp_path, [(2, "a", 0, "r"), (0, "a", 0, "G"), (0, "a", 0, "y"), ("00:00:03", "a", 0, "r")]
    )
    assert read_signals([path])["a"].times == (0, 2)
    assert read_signals([path])["a"].states == ("y", "r")


def test_damage_is_named(tmp_path):
    with pytest.raises(InputError, match="h:m:s") as caught:
        read_signals([write(tmp_path, [("x", "a", 0, "G")])])
    assert caught.value.line == 2
    path = tmp_path / "other.xml"
    path.write_text("<tlsPrograms/>", encoding="utf-8")
    with pytest.raises(InputError, match="not a log of SUMO's traffic lights"):
        read_signals([path])
    assert read_signals([]) == {}


GREENS = """<tlsSwitches>
<tlsSwitch id="t" programID="0" fromLane="a_0" toLane="b_0" begin="5.00" end="20.00"/>
<tlsSwitch id="t" programID="0" fromLane="c_0" toLane="b_0" begin="00:00:23" end="30.00"/>
<tlsSwitch id="t" programID="0" fromLane="c_1" toLane="b_0" begin="25.00" end="40.00"/>
<tlsSwitch id="u" programID="0" fromLane="x_0" toLane="y_0" begin="0" end="9"/>
</tlsSwitches>"""
LINKS = [("a_0", 0), ("c_0", 2), ("c_1", 2), ("d_0", 1)]


def junction():
    """A network in which two lanes share a link, and one link is never green."""
    links = (Connection(lane, "b_0", "", "t", index, "s", "o") for lane, index in LINKS)
    return Network({}, {}, tuple(links), Location(), False)


def test_green_times_become_states(tmp_path):
    path = tmp_path / "greens.xml"
    path.write_text(GREENS, encoding="utf-8")
    signals = read_signals([path], junction())
    assert set(signals) == {"t"}
    assert signals["t"].times == (0, 5, 20, 23, 40)
    assert signals["t"].states == ("rrr", "Grr", "rrr", "rrG", "rrr")


def test_states_win_over_green_times(tmp_path):
    path = tmp_path / "greens.xml"
    path.write_text(GREENS, encoding="utf-8")
    states = write(tmp_path, [(0, "t", 0, "GGG")])
    assert read_signals([states, path], junction())["t"].states == ("GGG",)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [('begin="5.00"', 'begin="soon"', "begin=.soon."), ('end="20.00"', "", '"end" is missing')],
)
def test_damaged_green_times_are_named(tmp_path, old, new, words):
    path = tmp_path / "greens.xml"
    path.write_text(GREENS.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        read_signals([path], junction())
    assert caught.value.line == 2
