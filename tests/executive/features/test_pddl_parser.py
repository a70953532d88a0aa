"""The feature `pddl-parser`."""

from __future__ import annotations

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import Level
from cxbridge.executive.features.pddl_parser import STRICT, PddlParserFeature, reads_as_fawkes
from cxbridge.executive.host.environment import CORE_DIR

DOMAIN = """(define (domain d) (:requirements :strips :typing) (:types thing - object)
 (:predicates (held ?t - thing))
 (:action take :parameters (?t - thing) :precondition (and (not (held ?t))) :effect (held ?t)))
"""


@pytest.fixture
def pddl(env, manager):
    manager.request("executive", "pddl-parser")
    for file in ("saliences.clp", "plan.clp", "goal.clp", "domain.clp"):
        env.batch(CORE_DIR / "cx" / file)
    return env


def test_domain_becomes_facts(pddl, clp):
    pddl.call("parse-pddl-domain", str(clp(DOMAIN, "domain.pddl")))
    assert [slots["name"] for _, _, slots in pddl.facts("domain-operator")] == ["take"]
    assert [slots["id"] for _, _, slots in pddl.facts("pddl-formula")] == ["take1", "take11", "take111"]
    (effect,) = [slots for _, _, slots in pddl.facts("domain-effect")]
    assert (effect["predicate"], effect["param-names"], effect["type"]) == ("held", ("t",), "POSITIVE")
    assert effect["name"].startswith("gen")


@pytest.mark.parametrize(
    ("text", "message"),
    [("(define (domain d", "Failed to parse domain: "), (DOMAIN.replace("held ?t)", "unknown ?t)", 1), "")],
)
def test_broken_domain_is_logged_and_makes_no_facts(pddl, clp, log, text, message):
    path = clp(text, "domain.pddl")
    pddl.call("parse-pddl-domain", str(path))
    (error,) = log.texts(Level.ERROR)
    assert error.startswith("Failed to parse domain: ")
    assert str(path) in error
    assert list(pddl.facts("domain-operator")) == []


def test_name_of_digits_stays_name(pddl):
    pddl.call("parse-pddl-formula", "(= 01 1)", "q")
    (atom,) = [slots for _, _, slots in pddl.facts("pddl-predicate")]
    first, second = atom["param-constants"]
    assert (first, second) == ("01", 1)  # agents write 1, which CLIPS reads as a number
    assert not isinstance(first, int)


@pytest.mark.parametrize(("value", "is_strict"), [("fawkes", True), (None, False)])
def test_strict_setting_selects_parser_of_fawkes(value, is_strict):
    config = Configuration()
    if value is not None:
        config.set(STRICT, value)
    assert reads_as_fawkes(config) is is_strict


def test_unknown_value_of_strict_is_an_error():
    config = Configuration()
    config.set(STRICT, "yes")
    with pytest.raises(ConfigError, match="cannot be 'yes'"):
        reads_as_fawkes(config)


def test_parser_of_fawkes_is_case_sensitive(env, clp, log):
    PddlParserFeature(as_fawkes=True).init_context(env)
    env.call("parse-pddl-domain", str(clp(DOMAIN.replace(":action", ":ACTION"), "domain.pddl")))
    assert any("Fawkes' parser refuses this" in text for text in log.texts(Level.ERROR))
