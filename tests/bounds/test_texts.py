"""Texts for which earlier regular expressions took for ever, on their ways in."""

from __future__ import annotations

from time import process_time

import pytest

from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.executive.host.facts.constants import parse_constant_fact
from cxbridge.interfaces.xml.parser import parse_bytes
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from tests.skiller.rig import Rig

MOST_S = 1.0
LONGEST = 1_023
"""Length of the field ``skill_string``."""

SKILL_STRINGS = [
    "say{" + "a, " * 24 + "}",
    "say{" + "a,\t " * 250 + ",}",
    "say{" + "," * 1_000 + "}",
    "say{a=" + " " * 1_000 + "'}",
    "say{a='" + "x" * 1_000 + '"}',
    "s" * LONGEST,
]


@pytest.mark.parametrize("text", SKILL_STRINGS)
def test_skill_string_of_simulator_takes_little_time(text):
    assert len(text) <= LONGEST
    rig = Rig()
    rig.add(SkillerSimulator(rig.board, rig.clock, rig.bus, ()))
    rig.send("AcquireControl", False)
    rig.send("ExecSkill", text)
    before = process_time()
    rig.loop(3)
    assert process_time() - before < MOST_S


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize(
    "tag",
    [
        '<interface name="A" ' + 'b="c" ' * 10_000,
        "<interface " + "'\"" * 20_000,
        "<" + "a" * 40_000,
        "<a " * 9_000,
    ],
    ids=["attributes", "quotes", "name", "tags"],
)
def test_start_tag_takes_little_time(tag, encoding):
    before = process_time()
    for end in ("", "<", "/>"):
        with pytest.raises(CxbridgeError):
            parse_bytes((tag + end).encode(encoding))
    assert process_time() - before < MOST_S


@pytest.mark.parametrize(
    ("inner", "is_fact"),
    [
        ("(a b)" * 100_000, True),
        ("(a b)" * 100_000 + "(a", False),
        ("a " * 200_000, True),
        ("1" * 500_000 + "x", True),
        ("(" * 500_000, False),
        ('"' * 500_000, True),
        ('\\"' * 250_000, False),
    ],
    ids=["slots", "slots, unclosed", "fields", "digits", "parentheses", "texts", "a text, unclosed"],
)
def test_fact_of_client_takes_little_time(inner, is_fact):
    before = process_time()
    try:
        parse_constant_fact(f"(f {inner})")
    except ClipsError:
        assert not is_fact
    else:
        assert is_fact
    assert process_time() - before < 2 * MOST_S
