"""YAML 1.2: what is written comes back."""

import json

from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.job.yaml12 import parse_yaml

# Line and paragraph separators count as line breaks in YAML 1.1's scanner.
WORDS = st.text(st.characters(codec="ascii", exclude_categories=("Cc",)), max_size=12)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**12), 10**12) | WORDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3),
    max_leaves=12,
)


@given(VALUES)
def test_json_is_yaml(value):
    """YAML 1.2 is a superset of JSON."""
    found, places = parse_yaml(json.dumps(value))
    assert found == value
    for path in places:
        here = value
        for part in path:
            here = here[part]


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_real_numbers_survive(number):
    found, _ = parse_yaml(f"a: {number!r}")
    assert found["a"] == number
