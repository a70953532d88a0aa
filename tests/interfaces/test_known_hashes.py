from __future__ import annotations

import pytest
from msgspec.structs import replace

from cxbridge.interfaces.known_hashes import accepts_hash, hash_for_wire, known_hashes, layout_fingerprint
from cxbridge.interfaces.registry import default_registry
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.interfaces.xml.parser import parse_bytes
from tests.interfaces.samples import DATA, definition

SKILLER = default_registry().schema("SkillerInterface")
OWN = {
    "ComponentInterface",
    "DaemonInterface",
    "ExplainInterface",
    "GameInterface",
    "OrderInterface",
    "RequestInterface",
    "SkillBoardInterface",
    "SkillExecutorInterface",
}
"""Types that Fawkes does not have."""


@pytest.mark.parametrize("name", sorted(set(default_registry().names()) - OWN))
def test_every_shipped_type_has_a_hash_that_fawkes_knows(name: str) -> None:
    schema = default_registry().schema(name)
    known = known_hashes(schema)
    assert known
    assert all(len(one) == 16 for one in known)
    assert hash_for_wire(schema) in known
    assert schema.hash not in known  # the words are our own
    assert accepts_hash(schema, known[0])
    assert accepts_hash(schema, schema.hash)
    assert not accepts_hash(schema, bytes(16))


@pytest.mark.parametrize("name", sorted(set(default_registry().names()) - OWN))
def test_who_uses_fawkes_definitions_takes_ours_of_equal_layout(name: str) -> None:
    ours = default_registry().schema(name)
    theirs = replace(ours, hash=known_hashes(ours)[0])
    assert accepts_hash(theirs, ours.hash)
    assert not accepts_hash(replace(theirs, datasize=ours.datasize + 8), ours.hash)


def changed_schemas() -> list[InterfaceSchema]:
    first, *rest = SKILLER.fields
    message, *messages = SKILLER.messages
    (enum,) = SKILLER.enums
    item, *items = enum.items
    return [
        replace(SKILLER, name="OtherInterface"),
        replace(SKILLER, datasize=SKILLER.datasize + 8),
        replace(SKILLER, fields=tuple(rest)),
        replace(SKILLER, fields=(*rest, first)),
        replace(SKILLER, fields=(replace(first, name="skill"), *rest)),
        replace(SKILLER, fields=(replace(first, type="byte"), *rest)),
        replace(SKILLER, fields=(replace(first, offset=24), *rest)),
        replace(SKILLER, fields=(replace(first, length=1023), *rest)),
        replace(SKILLER, messages=tuple(messages)),
        replace(SKILLER, messages=(*messages, message)),
        replace(SKILLER, messages=(replace(message, name="RunSkillMessage"), *messages)),
        replace(SKILLER, messages=(replace(message, fields=()), *messages)),
        replace(SKILLER, enums=()),
        replace(SKILLER, enums=(replace(enum, name="Status"),)),
        replace(SKILLER, enums=(replace(enum, items=(replace(item, value=9), *items)),)),
        replace(SKILLER, enums=(replace(enum, items=(replace(item, name="S_IDLE"), *items)),)),
    ]


@pytest.mark.parametrize("schema", changed_schemas())
def test_another_layout_never_gets_a_known_hash(schema: InterfaceSchema) -> None:
    assert layout_fingerprint(schema) != layout_fingerprint(SKILLER)
    assert known_hashes(schema) == ()
    assert hash_for_wire(schema) == schema.hash
    assert not accepts_hash(schema, hash_for_wire(SKILLER))


def test_words_make_no_difference() -> None:
    (enum,) = SKILLER.enums
    other = replace(
        SKILLER,
        hash=bytes(16),
        comment="other words",
        source="elsewhere",
        constants=(),
        enums=(replace(enum, comment="other words"),),
    )
    assert known_hashes(other) == known_hashes(SKILLER)


def test_an_unknown_type_has_its_own_hash() -> None:
    schema = parse_bytes(definition(DATA))
    assert known_hashes(schema) == ()
    assert hash_for_wire(schema) == schema.hash
