"""Checks for resources and mutexes in an agent that never sets its identity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity

MISSING_IDENTITY: Final = Code(
    "CX507",
    Severity.WARNING,
    "a lock without an identity",
    "A goal needs resources, or a rule locks a mutex, and no rule calls cx-identity-set: the executive has "
    "no name for the holder of the lock. The lock is never acquired, and the goal waits forever.",
)

CODES: Final = (MISSING_IDENTITY,)

_SET_IDENTITY: Final = "cx-identity-set"
_LOCK_FUNCTIONS: Final = ("mutex-try-lock-async", "mutex-lock-async", "mutex-try-lock")


def check(agent: Agent) -> Iterator[Finding]:
    """Yield a finding for the first lock in each file, if nothing sets the identity."""
    # A rule may also assert the fact with the identity, which has this id, without a call of the function.
    if any("/cx/identity" in construct.placed_piece.piece.text for construct in agent.own_constructs):
        return
    calls = agent.model.find_mentions(Name(NameKind.FUNCTION, _SET_IDENTITY), Use.CALLED)
    if any(not agent.is_core_path(call.file.path) for call in calls):
        return
    reported_files: set[str] = set()
    for construct in agent.own_constructs:
        lock_starts = [
            node.start
            for node in construct.action_nodes
            if (node.head == "required-resources" and node.arguments) or node.head in _LOCK_FUNCTIONS
        ]
        if lock_starts and construct.file.path not in reported_files:
            reported_files.add(construct.file.path)
            yield Finding(
                MISSING_IDENTITY,
                construct.place(lock_starts[0]),
                f"no rule calls {_SET_IDENTITY}: no lock is ever acquired",
                f'call ({_SET_IDENTITY} "NAME") in a rule for (executive-init)',
            )
