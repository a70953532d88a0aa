"""Blocks from recorded values equal the recorded blocks; values that do not fit are errors."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import TraceError
from cxbridge.events import InterfaceWrite
from cxbridge.interfaces.registry import default_registry
from cxbridge.interfaces.schema import FieldSchema
from cxbridge.trace.codec import encode, make_decoder
from cxbridge.trace.formats.block_decoder import block_events
from cxbridge.trace.replay.block_maker import BlockMaker
from tests.trace.replay.samples import UID, write

NAMES = default_registry().names()


def values_of(field: FieldSchema) -> st.SearchStrategy[object]:
    """Return possible recorded values of a field."""
    if field.is_string:
        return st.text(st.characters(codec="ascii", min_codepoint=1), max_size=field.runtime_length - 1)
    items: dict[type, st.SearchStrategy[object]] = {
        bool: st.booleans(),
        float: st.floats(width=32, allow_nan=False, allow_infinity=False),
        int: st.integers(0, 100)
        if field.enum is None
        else st.sampled_from([item.name for item in field.enum.items]),
    }
    item = items[field.storage.python_type]
    length = field.length
    if length is None:
        return item
    some = min(length, 6)  # repeated, because 360 drawn numbers take too long
    return st.lists(item, min_size=some, max_size=some).map(lambda values: (values * length)[:length])


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
def test_recorded_values_make_recorded_block(name: str, data: st.DataObject) -> None:
    interface_class = default_registry().get(name)
    schema, maker = interface_class.SCHEMA, BlockMaker(interface_class)
    values = {field.name: data.draw(values_of(field), field.name) for field in schema.fields}
    block = maker.make_block(values, 1_700_000_000_123_456, f"{name}::x")
    event = next(block_events(schema, f"{name}::x", 0, block))
    stored = make_decoder(InterfaceWrite)(encode(event))
    assert maker.make_block(stored.values, 1_700_000_000_123_456, f"{name}::x") == block  # type: ignore[attr-defined]


def test_removed_field_is_error_with_name() -> None:
    maker = BlockMaker(default_registry().get("SwitchInterface"))
    with pytest.raises(TraceError, match="only the recording has strength"):
        maker.make_block(write(0, 1, strength=3).values, 0, UID)


def test_new_field_is_error_with_name() -> None:
    maker = BlockMaker(default_registry().get("SwitchInterface"))
    values = dict(write(0, 1).values)
    del values["history"]
    with pytest.raises(TraceError, match="only the definition has history") as caught:
        maker.check_fields(values, UID)
    assert "--interface-dir" in str(caught.value)


def test_value_of_wrong_type_is_error() -> None:
    maker = BlockMaker(default_registry().get("SwitchInterface"))
    with pytest.raises(TraceError, match=r"SwitchInterface::s does not fit: .*value"):
        maker.make_block(write(0, "much").values, 0, UID)  # type: ignore[arg-type]
