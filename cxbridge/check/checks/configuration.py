"""Finds what is strange in the configuration of an agent."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.check.agent import Agent, place_of
from cxbridge.check.findings import Code, Finding, Place, Severity
from cxbridge.run.specs import check_spec

STRANGE: Final = Code(
    "CX111",
    Severity.WARNING,
    "a configuration value is not what it seems",
    "YAML reads some words as something else, two files disagree, or nobody reads this key. Nothing "
    "says so at run time.",
)
NO_TIME: Final = Code(
    "CX112",
    Severity.WARNING,
    "no time facts",
    "Without assert-time-each-loop there is no (time ...) fact in the loop: the executive reads no "
    "interface after the "
    "first loop, time-outs never pass, and an agent with skills waits for ever.",
)

CODES: Final = (STRANGE, NO_TIME)

_PLACE = re.compile(r"(?P<file>[^\n:]+):(?P<line>\d+)(?::(?P<column>\d+))?: (?P<text>.*)", re.DOTALL)


def check(agent: Agent) -> Iterator[Finding]:
    """Yield a finding for each strange value."""
    config = agent.config
    seen: set[Place] = set()
    for text in (*map(str, config.warnings), *check_spec(config, agent.spec)):
        match = _PLACE.match(text)
        place = Place(str(agent.context.paths.config_file))
        if match:
            place = Place(match["file"], int(match["line"]), int(match["column"] or 0))
        if not match or place not in seen:  # a second one there follows from the first
            yield Finding(STRANGE, place, match["text"] if match else text)
        seen.add(place)
    key = "/clips-executive/assert-time-each-loop"
    if agent.context.paths.ros2cx is None and not config.get_bool(key, default=False):
        there = config.exists(key)
        place = place_of(config.get(key)) if there else Place(str(agent.context.paths.config_file))
        yield Finding(
            NO_TIME,
            place,
            f"assert-time-each-loop is {'false' if there else 'absent'}: nothing is read, no time passes",
            "set assert-time-each-loop: true below clips-executive",
        )
