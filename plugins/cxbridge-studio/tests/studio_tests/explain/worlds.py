"""Environments as small as the question."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.explain.rules.diagnose import diagnose
from cxbridge_studio.explain.rules.diagnosis import Diagnosis
from cxbridge_studio.explain.rules.environment import take_snapshot

TEMPLATES = (
    "(deftemplate goal (slot id) (slot class) (slot parent) (slot mode) (multislot params))",
    "(deftemplate robot (slot name) (slot at) (slot battery))",
)


@contextmanager
def world(*texts: str) -> Iterator[ClipsEnvironment]:
    """Yield an environment with the templates above, constructs, and facts."""
    env = ClipsEnvironment("world", EventBus(VirtualClock()))
    try:
        for text in (*TEMPLATES, *texts):
            if text.startswith("(def"):
                env.build(text)
            else:
                assert env.assert_string(text) is not None, text
        yield env
    finally:
        env.destroy()


def diagnosis_of(rule: str, *texts: str) -> Diagnosis:
    """Diagnose a rule, written from its condition on, in such a world."""
    with world(*texts, f"(defrule it {rule} =>)") as env:
        return diagnose(take_snapshot(env, "it"))


def numbers(found: Diagnosis) -> list[tuple[int | None, int | None]]:
    """Return the columns alone and joined."""
    return [
        (each.alone.number if each.alone else None, each.joined.number if each.joined else None)
        for each in found.elements
    ]
