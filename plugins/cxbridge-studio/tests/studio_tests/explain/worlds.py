"""Small environments for diagnoses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.explain.rules.diagnoser import diagnose
from cxbridge_studio.explain.rules.diagnosis import Diagnosis
from cxbridge_studio.explain.rules.environment import take_snapshot

TEMPLATES = (
    "(deftemplate goal (slot id) (slot class) (slot parent) (slot mode) (multislot params))",
    "(deftemplate robot (slot name) (slot at) (slot battery))",
)


@contextmanager
def make_world(*texts: str) -> Iterator[ClipsEnvironment]:
    """Yield an environment with the templates above, and with constructs and facts."""
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


def diagnose_rule(rule: str, *texts: str) -> Diagnosis:
    """Return the diagnosis of a rule, which is given from its condition on."""
    with make_world(*texts, f"(defrule it {rule} =>)") as env:
        return diagnose(take_snapshot(env, "it"))


def list_counts(diagnosis: Diagnosis) -> list[tuple[int | None, int | None]]:
    """Return the counts alone and joined of each element."""
    return [
        (element.alone.number if element.alone else None, element.joined.number if element.joined else None)
        for element in diagnosis.elements
    ]
