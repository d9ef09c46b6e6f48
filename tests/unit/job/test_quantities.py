"""Numbers with units."""

from typing import Annotated

import pytest
from pydantic import TypeAdapter, ValidationError

from sumo3dviz_pt.job.values import Quantity

LENGTH = TypeAdapter(Annotated[float, Quantity("m", 0.001, 5000.0)])


@pytest.mark.parametrize(
    ("written", "metres"),
    [("200 m", 200.0), ("3 cm", 0.03), ("1.5km", 1500.0), (7, 7.0), ("2e1 mm", 0.02)],
)
def test_text_has_a_unit_and_numbers_are_in_the_first(written, metres):
    assert LENGTH.validate_python(written) == pytest.approx(metres)


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("200", "one of the units m, km, cm, mm"),
        ("3 h", "one of the units"),
        ("1.2.3 m", "one of the units"),
        (True, "one of the units"),
        (float("nan"), "one of the units"),
        (None, "one of the units"),
        ("6 km", "should lie in 0.001 to 5000 m, not 6000 m"),
        (0, "should lie in"),
    ],
)
def test_others_are_refused_in_words(written, said):
    with pytest.raises(ValidationError, match=said):
        LENGTH.validate_python(written)


def test_a_schema_takes_numbers_and_text():
    schema = LENGTH.json_schema()
    kinds = {each["type"] for each in schema["anyOf"]}
    assert kinds == {"number", "string"}
