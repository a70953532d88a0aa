"""Evidence from a scenario, which runs in this process, on the virtual clock, up to the time in question."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.interrupt import Interrupt
from cxbridge.run.agent import Run
from cxbridge.run.options import RunOptions
from cxbridge.run.run import make_run
from cxbridge.run.team import Team
from cxbridge_studio.constructs import read_rule_texts
from cxbridge_studio.explain.evidence import EVIDENCE_EVENT_TYPES, Evidence, History
from cxbridge_studio.explain.rules.environment import (
    read_fact_slots,
    read_rulebook,
    restore_sources,
    take_snapshot,
)
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot


class EnvironmentEvidence(Evidence):
    """Evidence from an existing environment.

    :param times_us: the start of the run, and the moment to explain.
    :param folders: the folders of the agent's CLIPS files.
    """

    def __init__(
        self,
        where: str,
        times_us: tuple[int, int],
        history: History,
        env: ClipsEnvironment,
        folders: tuple[object, ...],
    ) -> None:
        super().__init__(where, *times_us, history)
        self.env = env
        self.folders = folders

    def read_rulebook(self) -> Rulebook:
        with self.env.lock:
            return read_rulebook(self.env, self.folders)

    def take_snapshot(self, rule: str) -> Snapshot:
        with self.env.lock:
            return take_snapshot(self.env, rule)

    def read_rule_texts(self) -> Mapping[str, str]:
        with self.env.lock:
            texts = read_rule_texts(self.env)
        return restore_sources(texts)

    def read_fact_slots(self, template: str) -> list[Mapping[str, str]]:
        with self.env.lock:
            return read_fact_slots(self.env, template)


@contextmanager
def collect_scenario_evidence(
    options: RunOptions, at_s: float | None, env_or_agent: str | None = None
) -> Iterator[Evidence]:
    """Run a scenario up to a time or to its end, and yield the evidence of that moment.

    :param at_s: the seconds since the start of the run; None for its end or its time limit.
    :param env_or_agent: with a single agent, the name of a CLIPS environment; with several agents, the name
        of an agent, which is also the name of its environment. None for the executive's environment.
    :raises CxbridgeError: if an option is invalid, the run cannot start, the environment does not exist, or
        none of several agents has the name.
    """
    options.check()
    with make_run(options) as run:
        agent = _find_agent(run, env_or_agent)
        name = agent.executive.env.name if env_or_agent is None else env_or_agent
        history = History(name, find_facts=partial(read_fact_slots, agent.executive.env))
        agent.bus.subscribe(history.add_event, *EVIDENCE_EVENT_TYPES)
        start_us = run.clock.start_us
        end_us = start_us + int((options.timeout if at_s is None else at_s) * MICROSECONDS)
        watched_rules = agent.executive.env.watcher.rules
        history.has_firings = True  # all firings are recorded, even if no rule fires
        with Interrupt(run.loop.stop, run.interrupt) as interrupt:
            # Watch all rules twice: first for the rules that fire during the start, then again because the
            # configuration, which the start reads, may have switched rules off.
            watched_rules.set((), on=True)
            run.start()
            watched_rules.set((), on=True)
            interrupt.check()
            run.loop.run(lambda: _is_done(run, interrupt, end_us))
            interrupt.check()
        now_us = run.clock.now_us()
        time_text = f"{'at its end,' if run.is_over else 'at'} {(now_us - start_us) / MICROSECONDS:.3f} s"
        evidence = EnvironmentEvidence(
            f"{agent.spec} {time_text}",
            (start_us, now_us),
            history,
            agent.manager.find(name),
            agent.paths.clips_dirs,
        )
        evidence.is_time_chosen = at_s is not None
        yield evidence


def _find_agent(run: Run | Team, name: str | None) -> Run:
    """Return the only agent, or the agent with a name.

    :raises CxbridgeError: if several agents exist and none of them has the name.
    """
    if len(run.agents) == 1:
        return run.agents[0]
    agent = next((agent for agent in run.agents if agent.name == name), None)
    if agent is None:
        problem = "this scenario has several agents" if name is None else f"there is no agent '{name}'"
        names = ", ".join(agent.name for agent in run.agents)
        raise CxbridgeError(problem, hint=f"choose an agent with --env NAME, one of: {names}")
    return agent


def _is_done(run: Run | Team, interrupt: Interrupt, end_us: int) -> bool:
    """Return whether the run is over, was interrupted or quit by all agents, or has no time left."""
    return (
        interrupt.is_signalled
        or run.is_over
        or all(agent.executive.env.quit_requested for agent in run.agents)
        # The run is also done if its next loop would begin after the end.
        or run.clock.now_us() + run.loop.period_us > end_us
    )
