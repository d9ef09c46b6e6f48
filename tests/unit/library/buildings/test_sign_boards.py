"""Words on shops: their letters, their languages, and how they fit their boards."""

import numpy as np
import pytest

from sumo3dviz_pt.library.buildings.facade import FAR, MIDDLE, NEAR
from sumo3dviz_pt.library.buildings.palettes import _contrast, palette
from sumo3dviz_pt.library.buildings.shop_words import ENGLISH, LANGUAGES, Writing, language_in
from sumo3dviz_pt.library.buildings.sign_boards import (
    COLOURS,
    Boards,
    _next_line,
    blade_signs,
    sign_boards,
)
from sumo3dviz_pt.library.buildings.styles import SHOPS
from sumo3dviz_pt.library.street.lettering import Hand, can_write, written

EDGES = np.linspace(0.25, 20.0, 7)


def built(writing=None, *, level=NEAR, whole=False, edges=EDGES):
    boards = Boards(writing or Writing(), (3, 0), whole=whole)
    return sign_boards(edges, 4.0, boards, level=level, rng=np.random.default_rng(5))


def lines_of(seed, room, language=ENGLISH, count=6):
    dice = np.random.default_rng(seed)
    waiting = list(LANGUAGES[language].shops)
    return [_next_line(waiting, room, dice) for _ in range(count)]


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_word_can_be_written_in_capitals_and_small_letters(language):
    words = LANGUAGES[language]
    assert len(set(words.shops)) == len(words.shops) >= 20
    assert len(set(words.large)) == len(words.large) >= 5
    for word in (*words.shops, *words.large):
        for text in (word, word.upper()):
            assert can_write(text), text
            flat = written(text, Hand(0.15, 0.28, 1.0, True, 0.08), height=1.0)
            assert np.abs(flat[..., 1]).max() < 0.86, "a board of 0.6 m has room for 0.35 m"


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("whole", [False, True])
def test_words_lie_within_their_boards(language, whole):
    for seed in range(12):
        for edges in (EDGES, np.array([0.25, 2.3, 3.8])):
            shell = built(Writing(language, seed), whole=whole, edges=edges)
            assert any(role.startswith("letter") for role in shell)
            for k in range(COLOURS):
                if f"letter{k}" not in shell:
                    continue
                letters, faces = (shell[f"{role}{k}"] for role in ("letter", "sign"))
                low, high = faces.min(axis=1), faces.max(axis=1)
                for quad in letters:
                    inside = (quad[:, None] > low - [0, 1, 0]) & (quad[:, None] < high)
                    assert inside.all(axis=(0, 2)).any()


def test_words_are_the_same_in_two_runs_and_differ_between_shops():
    one, again = built(Writing("german", 8)), built(Writing("german", 8))
    other = built(Writing("german", 9))
    assert one.keys() == again.keys()
    assert all((one[role] == again[role]).all() for role in one)
    assert [len(one[role]) for role in one] != [len(other[role]) for role in other]
    texts = [line.text for line in lines_of(1, 2.9)]
    assert texts == [line.text for line in lines_of(1, 2.9)]
    assert len(set(map(str.upper, texts))) == len(texts), "no word twice on a wall"


def test_hands_vary():
    lines = [line for seed in range(30) for line in lines_of(seed, 3.0, count=1)]
    weights = [line.hand.weight for line in lines]
    stretches = [line.hand.stretch for line in lines]
    assert max(weights) > 1.6 * min(weights) and max(stretches) > 1.25 * min(stretches)
    assert 5 < sum(line.text.isupper() for line in lines) < 25
    assert 1 < sum(line.left for line in lines) < 20


def test_narrow_boards_get_short_words_or_none():
    assert all(len(line.text) <= 7 for line in lines_of(2, 0.9) if line is not None)
    assert lines_of(2, 0.1) == [None] * 6


def test_all_levels_of_detail_say_the_same():
    near, middle, far = (built(Writing("french", 4), level=level) for level in (NEAR, MIDDLE, FAR))
    for k in range(COLOURS):
        role = f"letter{k}"
        assert (role in near) == (role in middle) == (role in far)
        if role in near:
            ends = [
                (shell[role][..., 0].min(), shell[role][..., 0].max())
                for shell in (near, middle, far)
            ]
            assert np.allclose(ends, ends[0], atol=0.05)
            assert len(near[role]) > len(middle[role]) > len(far[role])
            assert (near[f"sign{k}"] == far[f"sign{k}"]).all()


def test_signs_that_stick_out_have_a_word_of_the_language():
    made = [
        blade_signs(30.0, 4.0, Boards(Writing(name, 1), (0, 0)), level=NEAR,
                    rng=np.random.default_rng(2))
        for name in ("english", "czech")
    ]  # fmt: skip
    assert (made[0]["sign0"] == made[1]["sign0"]).all()
    assert made[0]["letter0"].shape != made[1]["letter0"].shape


def test_two_shops_of_one_variant_say_different_things():
    style = next(iter(SHOPS.values()))
    one, other = (style.build(1, NEAR, Writing(ENGLISH, seed)) for seed in (1, 2))
    letters = [role for role in one if role.startswith("letter")]
    assert letters and any(
        one[role].shape != other.get(role, np.zeros(0)).shape for role in letters
    )
    assert (one["wall"] == other["wall"]).all()


@pytest.mark.parametrize(
    ("zone", "language"),
    [
        ("Europe/Berlin", "german"),
        ("Europe/Rome", "italian"),
        ("Europe/Paris", "french"),
        ("Europe/Madrid", "spanish"),
        ("Europe/Amsterdam", "dutch"),
        ("Europe/Warsaw", "polish"),
        ("America/Sao_Paulo", "portuguese"),
        ("America/New_York", "english"),
        ("Asia/Tokyo", "english"),
        ("", "english"),
    ],
)
def test_zones_tell_languages(zone, language):
    assert language_in(zone) == language


def test_no_zone_has_two_languages():
    zones = [zone for words in LANGUAGES.values() for zone in words.zones]
    assert len(set(zones)) == len(zones)


def test_letters_stand_out_from_their_boards():
    for seed in range(30):
        style = next(iter(SHOPS.values()))
        roles = palette(style.colours, np.random.default_rng(seed))
        for k in range(COLOURS):
            assert _contrast(roles[f"sign{k}"][1], roles[f"letter{k}"][1]) > 2.5
