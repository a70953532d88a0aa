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
"""Types that Fawkes lacks."""


@pytest.mark.parametrize("name", sorted(set(default_registry().names()) - OWN))
def test_shipped_type_has_hash_of_fawkes(name: str) -> None:
    schema = default_registry().schema(name)
    known = known_hashes(schema)
    assert known
    assert all(len(hash_) == 16 for hash_ in known)
    assert hash_for_wire(schema) in known
    assert schema.hash not in known  # the comments differ from Fawkes'
    assert accepts_hash(schema, known[0])
    assert accepts_hash(schema, schema.hash)
    assert not accepts_hash(schema, bytes(16))


@pytest.mark.parametrize("name", sorted(set(default_registry().names()) - OWN))
def test_fawkes_definition_accepts_equal_layout(name: str) -> None:
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
def test_changed_layout_has_no_known_hash(schema: InterfaceSchema) -> None:
    assert layout_fingerprint(schema) != layout_fingerprint(SKILLER)
    assert known_hashes(schema) == ()
    assert hash_for_wire(schema) == schema.hash
    assert not accepts_hash(schema, hash_for_wire(SKILLER))


def test_comments_do_not_change_known_hashes() -> None:
    (enum,) = SKILLER.enums
    changed = replace(
        SKILLER,
        hash=bytes(16),
        comment="other words",
        source="elsewhere",
        constants=(),
        enums=(replace(enum, comment="other words"),),
    )
    assert known_hashes(changed) == known_hashes(SKILLER)


def test_unknown_type_has_own_hash() -> None:
    schema = parse_bytes(definition(DATA))
    assert known_hashes(schema) == ()
    assert hash_for_wire(schema) == schema.hash
