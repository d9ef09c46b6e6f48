"""Signal logs."""

import pytest

from sumo3dviz_pt.errors import InputError
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
