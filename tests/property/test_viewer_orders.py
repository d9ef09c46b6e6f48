"""Whatever a page sends is an order within its bounds, or one sentence."""

from __future__ import annotations

import json
from typing import Any, get_args

from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.viewer.messages import Order, parsed

KINDS = sorted(
    name for kind in get_args(Order) for name in get_args(kind.model_fields["do"].annotation)
)
FIELDS = sorted({name for kind in get_args(Order) for name in kind.model_fields})

ODD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.integers(min_value=10**400, max_value=10**401),
    st.floats(),
    st.text(max_size=300),
    st.sampled_from([*KINDS, "add", "KeyW", "1e400", "\x00", "../.."]),
)
VALUES = st.recursive(
    ODD, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=3)
)


@given(st.dictionaries(st.sampled_from([*FIELDS, "else"]), VALUES), st.sampled_from(KINDS))
def test_messages(message: dict[str, Any], kind: str) -> None:
    try:
        order = parsed({**message, "do": kind})
    except ConfigError as error:
        assert 0 < len(str(error)) < 400 and len(str(error).splitlines()) == 1
    else:
        assert len(json.dumps(order.model_dump(), allow_nan=False)) < 100_000
