"""What is heard of sources whose motion is known."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from sounding import BEGIN, EYE, car, clock, scene, steady, straight

from sumo3dviz_pt.sound.ears import EARS, HEAD, ear_delays, head_shadow
from sumo3dviz_pt.sound.emission import A_WEIGHTS, BANDS, SILENT, Emission
from sumo3dviz_pt.sound.propagation import SPEED_OF_SOUND, absorption
from sumo3dviz_pt.sound.recording import Meter
from sumo3dviz_pt.sound.render import STEP, Bed, Renderer, Source, bed_levels
from sumo3dviz_pt.sound.signals import RATE, NoiseBank, tone_shares

BANK = NoiseBank.of(7)


def heard(what, ears="ambisonics", first=0, last=RATE):
    return np.concatenate(list(Renderer(what, EARS[ears], BANK).blocks(first, last)))


def level(samples, full_scale=100.0):
    """Level of the root mean square of samples [dB]."""
    return 10.0 * np.log10(2.0 * np.mean(samples**2)) + full_scale


def loudness(samples, ears="ambisonics"):
    meter = Meter(EARS[ears].meters, 100.0)
    meter.heard(samples)
    return meter.read()


@pytest.mark.parametrize("seconds", [0.01, 0.1, 0.125, 1.0])
def test_a_steady_sound_is_as_loud_at_its_most_however_short_it_is(seconds):
    noise = 0.1 * np.random.default_rng(1).standard_normal((round(seconds * RATE), 4))
    found = loudness(noise)
    assert 0.0 <= found.maximum["listener"] - found.equivalent["listener"] < 1.0


# Levels -------------------------------------------------------------------------------------


def test_a_pass_by_has_the_directives_level():
    speed, times = 50 / 3.6, clock(4.0)
    passing = straight(times, at=(0.0, 7.5, 0.05), speed=(speed, 0, 0), since=2.0)
    # Worked out from the table of category 1: no sum or formula of the package.
    ar = np.array([83.1, 89.2, 87.7, 93.1, 100.1, 96.7, 86.8, 76.2])
    br = np.array([30.0, 41.5, 38.9, 25.7, 32.5, 37.2, 39.0, 40.0])
    ap = np.array([97.9, 92.5, 90.7, 87.2, 84.7, 88.0, 84.4, 77.1])
    bp = np.array([-1.3, 7.2, 7.7, 8.0, 8.0, 8.0, 8.0, 8.0])
    power = 10 ** (0.1 * (ar + br * np.log10(50 / 70))) + 10 ** (0.1 * (ap - bp * 20 / 70))
    weighted = 10 * np.log10((power * 10 ** (0.1 * A_WEIGHTS)).sum())
    found = loudness(heard(scene(4.0, car(times, passing, speed=speed)), last=4 * RATE))
    at = np.arange(0, 4, 0.001)
    square = 7.5**2 + 1.15**2 + (speed * (at - 2.0)) ** 2
    wanted = weighted - 8 + 10 * np.log10(np.mean(1 / square))
    assert found.equivalent["listener"] == pytest.approx(wanted, abs=1.0)
    assert found.maximum["listener"] == pytest.approx(weighted - 8 - 20 * np.log10(7.59), abs=1.0)


def test_half_the_distance_is_6_db_louder():
    times = clock(1.0)
    near, far = (
        level(heard(scene(1.0, car(times, straight(times, at=(away, 0.0, 1.2)), speed=14.0)))[:, 0])
        for away in (5.0, 10.0)
    )
    assert near - far == pytest.approx(6.02, abs=0.2)


@pytest.mark.parametrize("ears", ["stereo", "ambisonics"])
def test_powers_of_a_recording_add_up_to_the_listeners(ears):
    times = clock(1.0)
    source = Source("a", straight(times, at=(0, 10, 1.2)), np.ones(len(times)),
                    steady(4, 100.0, len(times)))  # fmt: skip
    parts = heard(scene(1.0, source), ears)
    channels = EARS[ears].meters["listener"]
    together = 10 * np.log10(sum(10 ** (0.1 * level(parts[:, k] + 1e-9)) for k in channels))
    air = 10 * absorption(np.array([1000.0]))[0]
    assert together == pytest.approx(100 - 10 * np.log10(2 * np.pi) - 20 - air, abs=0.2)


def test_air_takes_what_the_standard_says():
    # ISO 9613-1, table 1: 20 degrees, 50 %: 4.66 dB/km at 1 kHz, 104 dB/km at 8 kHz.
    assert 1000 * absorption(np.array([1000.0, 8000.0])) == pytest.approx([4.66, 105], rel=0.02)


def test_a_bed_has_its_level_from_everywhere():
    bed = Bed("rain", bed_levels(np.zeros(8), np.full(len(clock(1.0)), 54.0)))
    for ears, names in (("stereo", ("listener",)), ("binaural", ("left ear", "right ear"))):
        found = loudness(heard(scene(1.0, beds=(bed,)), ears), ears).equivalent
        assert [found[name] for name in names] == pytest.approx([54.0] * len(names), abs=0.7)


def test_the_own_vehicle_is_heard_and_the_world_through_its_body():
    times = clock(1.0)
    outside = car(times, straight(times, at=(5, 3, 0.05)), "other", speed=14.0)
    own = car(times, straight(times, at=(0, 0, 0.05)), speed=50 / 3.6, own=True)
    free, closed, alone = (
        loudness(heard(scene(1.0, *some, enclosed=shut))).equivalent["listener"]
        for some, shut in (((outside,), False), ((outside,), True), ((own,), True))
    )
    assert 15 < free - closed < 30
    assert alone == pytest.approx(61, abs=2)


# Motion -------------------------------------------------------------------------------------


def pitch(samples):
    """Mean frequency by crossings of zero [Hz]."""
    up = np.flatnonzero((samples[:-1] < 0) & (samples[1:] >= 0))
    parts = up + samples[up] / (samples[up] - samples[up + 1])
    return (len(parts) - 1) * RATE / (parts[-1] - parts[0])


@pytest.mark.parametrize("ears", ["stereo", "binaural"])
def test_pitch_follows_doppler(ears):
    times = clock(6.0)
    places = straight(times, at=(0, 2.0, 1.2), speed=(30, 0, 0), since=3.0)
    tone = Source("tone", places, np.ones(len(times)), steady(4, 120.0, len(times)), tone=1000.0)
    wave = heard(scene(6.0, tone), ears, last=6 * RATE)[:, 0]
    coming, going = pitch(wave[: RATE // 2]), pitch(wave[-RATE // 2 :])
    assert coming == pytest.approx(1000 * SPEED_OF_SOUND / (SPEED_OF_SOUND - 30), rel=0.005)
    assert going == pytest.approx(1000 * SPEED_OF_SOUND / (SPEED_OF_SOUND + 30), rel=0.005)


def test_sound_comes_late_by_its_way():
    times = clock(1.0)
    there = (times > 0.11).astype(float)  # it grows from 0.10 s on
    places = straight(times, at=(100.0, 0, 1.2))
    wave = heard(scene(1.0, car(times, places, speed=14.0, there=there)))[:, 0]
    first = np.flatnonzero(np.abs(wave) > 1e-4 * np.abs(wave).max())[0] / RATE
    assert first == pytest.approx(0.1 + 100.0 / SPEED_OF_SOUND, abs=0.005)


# Directions ---------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0, 45, 90])
def test_ears_hear_apart_by_woodworths_formula(degrees):
    angle, times = np.radians(degrees), clock(1.0)
    places = straight(times, at=EYE + 20 * np.array([np.cos(angle), np.sin(angle), 0]))
    tone = Source("tone", places, np.ones(len(times)), steady(3, 120.0, len(times)), tone=400.0)
    left, right = heard(scene(1.0, tone), "binaural", last=RATE // 2).T
    phase = [np.angle(np.sum(ear * np.exp(-2j * np.pi * 400 * np.arange(len(ear)) / RATE)))
             for ear in (left, right)]  # fmt: skip
    apart = np.mod(phase[0] - phase[1] + np.pi, 2 * np.pi) - np.pi
    wanted = HEAD / SPEED_OF_SOUND * (np.sin(angle) + angle)
    assert apart / (2 * np.pi * 400) == pytest.approx(wanted, abs=20e-6)


def test_the_far_ear_is_in_the_heads_shadow():
    near, far = head_shadow(np.radians([0.0, 150.0]))
    assert 20 * np.log10(near[[0, 7]]) == pytest.approx([0.1, 5.5], abs=0.5)
    assert 20 * np.log10(far[[0, 7]]) == pytest.approx([0.0, -16], abs=1.5)
    assert np.diff(ear_delays(np.linspace(0, np.pi, 50))).min() > 0


@pytest.mark.parametrize(
    ("way", "wanted"),
    [((0, 1, 0), (1, 1, 0, 0)), ((1, 0, 0), (1, 0, 0, 1)), ((0, 0, 1), (1, 0, 1, 0)),
     ((0, -1, 0), (1, -1, 0, 0))],
)  # fmt: skip
def test_channels_of_ambisonics_tell_the_direction(way, wanted):
    times = clock(1.0)
    source = car(times, straight(times, at=EYE + 10 * np.array(way)), speed=14.0)
    wave = heard(scene(1.0, source), last=4800)
    ratios = wave.T @ wave[:, 0] / (wave[:, 0] @ wave[:, 0])
    assert ratios == pytest.approx(np.array(wanted, dtype=float), abs=1e-6)


def test_directions_are_the_cameras():
    times = clock(1.0)
    source = car(times, straight(times, at=(10.0, 0, 1.2)), speed=14.0)
    # The camera looks north, so what is in the east is to its right.
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    whole = scene(1.0, source)
    whole = type(whole)(whole.begin, whole.places, np.tile(turned, (len(times), 1, 1)), (source,))
    left, right = heard(whole, "stereo", last=4800).T
    assert np.abs(left).max() < 1e-6 < np.abs(right).max()


# Purity, and cases at the edge --------------------------------------------------------------


def street():
    times = clock(2.0)
    return scene(2.0, *(
        car(times, straight(times, at=(k, 3.0 + k, 0.05), speed=(14, 0, 0), since=1.0), f"c{k}",
            speed=14.0)
        for k in range(3)
    ))  # fmt: skip


def test_the_same_seed_gives_the_same_bytes_in_any_chunks():
    whole = heard(street(), "binaural", last=2 * RATE)
    again = Renderer(street(), EARS["binaural"], NoiseBank.of(7))
    parts = [block for first, last in ((0, 31), (31, 50_003), (50_003, 2 * RATE))
             for block in again.blocks(first, last)]  # fmt: skip
    digests = {hashlib.sha256(np.ascontiguousarray(each)).hexdigest()
               for each in (whole, np.concatenate(parts))}  # fmt: skip
    assert len(digests) == 1
    other = Renderer(street(), EARS["binaural"], NoiseBank.of(8))
    assert np.abs(next(other.blocks(0, 100)) - whole[:100]).max() > 1e-3


def test_nobody_clicks_who_comes_and_goes():
    times = clock(3.0)
    gone = np.clip(10 * np.minimum(times - 0.5, 2.0 - times), 0, 1)  # within a tenth of a second
    fast = straight(times, at=(0, 4.0, 1.2), speed=(60, 0, 0), since=1.5)
    low = Emission(steady(0, 100.0, len(times)).rolling, *steady(0, SILENT, len(times)).rolling[
        None], np.zeros(len(times)))  # fmt: skip
    source = Source("low", fast, gone, low)
    wave = heard(scene(3.0, source, radius=60.0), last=3 * RATE)[:, 0]
    # Noise of 63 Hz cannot rise faster than its highest frequency, 95 Hz, does at its peak.
    assert np.abs(wave).max() > 0.01
    assert np.abs(np.diff(wave)).max() < 1.3 * np.abs(wave).max() * 2 * np.pi * 95 * 1.2 / RATE
    assert np.abs(wave[: RATE // 2]).max() == 0.0 and np.abs(wave[-RATE // 2 :]).max() == 0.0


@pytest.mark.parametrize("ears", list(EARS))
@pytest.mark.parametrize("case", ["nobody", "standing", "very near", "one frame"])
def test_cases_at_the_edge_are_finite(case, ears):
    times = clock(1.0)
    cars = {
        "nobody": [],
        "standing": [car(times, straight(times, at=(k, 3, 0.05)), f"{k}") for k in range(4)],
        "very near": [car(times, straight(times, at=(0, 0.03, 1.24), speed=(30, 0, 0), since=0.5),
                          speed=30.0)],
        "one frame": [car(times, np.tile(EYE, (len(times), 1)), speed=10.0)],
    }[case]  # fmt: skip
    wave = heard(scene(1.0, *cars), ears, last=1920 if case == "one frame" else RATE)
    assert np.isfinite(wave).all()
    assert (np.abs(wave).max() > 0) == bool(cars)
    assert np.abs(wave).max() < 10.0
    silence = loudness(0 * wave, ears).as_dict()
    assert set(silence["LAeq"].values()) == {None} and silence["peak_dbfs"] is None


def test_300_sources_are_heard_at_once():
    times = clock(0.5)
    cars = [car(times, straight(times, at=(k % 20 - 10, k // 20 + 3, 0.05), speed=(9, 0, 0)),
                f"{k}", speed=9.0) for k in range(300)]  # fmt: skip
    wave = heard(scene(0.5, *cars), last=RATE // 4)
    one = level(heard(scene(0.5, cars[0]), last=RATE // 4)[:, 0])
    assert np.isfinite(wave).all() and level(wave[:, 0]) > one + 15


# Waves --------------------------------------------------------------------------------------


def test_bands_of_noise_are_independent_and_of_unit_power():
    waves = BANK.waves.astype(float)
    assert (waves**2).mean(axis=1) == pytest.approx(1.0, abs=1e-3)
    together = waves @ waves.T / waves.shape[1]
    assert np.abs(together - np.eye(8)).max() < 0.12
    power = np.abs(np.fft.rfft(waves[4])) ** 2
    at = np.fft.rfftfreq(waves.shape[1], 1 / RATE)
    assert power[(at > 700) & (at < 1420)].sum() / power.sum() > 0.95


@pytest.mark.parametrize("rate", [0.0, 23.0, 60.0, 140.0, 400.0])
def test_tones_and_noise_have_the_bands_power_together(rate):
    harmonics, noise = tone_shares(np.array([rate]))
    assert (harmonics.sum(axis=1)[0] + noise[0, :3]) == pytest.approx(1.0)
    assert (noise >= 0).all() and (noise[0, 3:] == 1.0).all()
    assert len(BANDS) == noise.shape[1] and STEP > 0 and BEGIN < 0
