"""Checks the agents that the options of a run name."""

from __future__ import annotations

from dataclasses import replace

from cxbridge.check import checks
from cxbridge.check.agent import Agent, agents
from cxbridge.check.findings import Finding, of_error
from cxbridge.check.silence import without_silenced
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions


def check(options: RunOptions, *, errors_only: bool = False) -> list[Finding]:
    """Return what is wrong with the agents of a scenario, each finding once.

    :param options: as those of a run; what concerns recording and time is ignored.
    :param errors_only: no warnings and notes, and no work for them.
    :raises CxbridgeError: when the options themselves make no sense.
    """
    options.check()
    found: dict[Finding, None] = {}
    try:
        for name in agents(options):
            with Agent(replace(options, agent=name)) as agent:
                found.update(dict.fromkeys(checks.findings(agent, errors_only=errors_only)))
    except CxbridgeError as error:
        found[of_error(error)] = None
    return without_silenced(found)
