"""Runs of scenarios, from start to end. :func:`run_scenario` makes a run, watches it and sums up the result.

An *assembly* is what runs: the :class:`Run` of a single agent, or a :class:`~cxbridge.run.team.Team`.

The order of clean-up matters: servers and the watchdog end first, then the rules finalize, then the recording
closes, which includes the finalization.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import TYPE_CHECKING

from msgspec import structs

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError
from cxbridge.events import LogLine, Sink
from cxbridge.interrupt import GOODBYE_S, Interrupt
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run, make_base
from cxbridge.run.agents import agent_names
from cxbridge.run.mistakes import AgentChecks
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NO_ADDITIONS, Additions
from cxbridge.run.recording import RecorderComponent
from cxbridge.run.result import COMPLETED, FAULT, TIMED_OUT, UNSUCCESSFUL, RunResult, sum_up
from cxbridge.run.servers import ATTEND_PAUSE_S, RunServer, WaitForUser, end_with_run
from cxbridge.run.stuck import StuckWatch
from cxbridge.run.watchdog import Stall, StallReporter, environments_by_agent

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from cxbridge.executive.goals import GoalState, GoalWatch
    from cxbridge.run.replay.replay import Replay
    from cxbridge.run.team import Team


MIN_STALL_S = 60.0
"""The real time, in seconds, that the rules of a cycle may take even if the timeout is shorter."""


def run_scenario(
    options: RunOptions,
    console: Sink | None = None,
    attach: Callable[[Run], None] | None = None,
    additions: Additions = NO_ADDITIONS,
    *,
    interactive: bool = False,
    wait_for_user: WaitForUser = end_with_run,
) -> RunResult:
    """Run a scenario until its root goals end or the timeout expires.

    :param console: receives the log lines.
    :param attach: called with each agent before its start.
    :param additions: features, skills and writers of a program.
    :param interactive: whether a user may stop the rules, so that a cycle may take any time.
    :param wait_for_user: called after the run if a server continues, see :data:`WaitForUser`. Not called in a
        replay, whose servers end with the run.
    :raises CxbridgeError: if the input is wrong.
    """
    if not options.replay:
        options.check()
        return _run(
            options,
            console,
            attach=attach,
            additions=additions,
            interactive=interactive,
            wait_for_user=wait_for_user,
        )
    from cxbridge.run.replay.replay import open_replay  # noqa: PLC0415 - start-up time is a feature

    options, replay = open_replay(options)
    result = _run(options, console, replay, attach, additions, interactive=interactive)
    if result.status not in (COMPLETED, UNSUCCESSFUL):
        return result
    outcome = replay.outcome()
    return structs.replace(
        result,
        status=COMPLETED if outcome.same else UNSUCCESSFUL,
        reason=outcome.reason,
        replay=outcome,
    )


def _run(
    options: RunOptions,
    console: Sink | None,
    replay: Replay | None = None,
    attach: Callable[[Run], None] | None = None,
    additions: Additions = NO_ADDITIONS,
    *,
    interactive: bool,
    wait_for_user: WaitForUser = end_with_run,
) -> RunResult:
    """Run a scenario, see :func:`run_scenario`.

    :param replay: the recorded environment.
    """
    started_s = time.perf_counter()
    with Interrupt() as interrupt, ExitStack() as stack:
        assembly = make_run(options, replay, additions)
        stack.callback(assembly.clock.close)
        checks = AgentChecks(assembly.agents)
        stuck_watch = StuckWatch(assembly)
        stack.enter_context(assembly)
        if console is not None:
            assembly.bus.subscribe(console, LogLine)
        # not in the table of components, because the recording begins before the first component starts
        recorder = RecorderComponent(assembly, additions.writers)
        stack.callback(recorder.close)
        if replay is not None:
            stack.enter_context(replay.compare_decisions(assembly.bus))
        # before the recorder closes: the recording includes the finalization
        stack.callback(assembly.finalize)
        stack.callback(interrupt.give_time, GOODBYE_S)  # called before `finalize`, whose rules need this time
        interrupt.replace_functions(assembly.loop.stop, assembly.interrupt)
        servers = [server for group in options.plugin_groups for server in group.servers()]
        interactive = interactive or any(group.is_interactive for group in options.plugin_groups)
        _attach_clients(stack, assembly, attach, servers)
        start_us = assembly.clock.start_us
        limit = _LoopLimit(assembly, options.timeout)
        if not interactive:
            stack.enter_context(
                StallReporter(
                    assembly.loop,
                    lambda: environments_by_agent(assembly),
                    assembly.bus.logger("Run"),
                    "Ctrl-C ends the run",
                    on_stall=limit.handle_report,
                )
            )
        with assembly.loop.busy_section():  # the limit of a cycle holds for the start, too
            _start(assembly, interrupt)
        checks.check_loaded_files()
        assembly.loop.add(Hook.POST_LOOP, recorder.loop)
        deadline_us = assembly.clock.now_us() + int(options.timeout * MICROSECONDS)
        if replay is not None:
            deadline_us += replay.length_us  # the run waits for the recorded times
        is_over, loss_reason = False, ""
        # a client, a user or a function of the program may change a run that looks stuck
        may_be_stuck = (
            replay is None
            and not (servers or interactive or additions.features)
            and all(agent.executive.knows_goals for agent in assembly.agents)
        )

        def is_done() -> bool:
            nonlocal is_over, loss_reason
            checks.check_new_files()
            is_over = assembly.is_over
            # read in the same cycle: goals may have failed because of the loss
            loss_reason = assembly.loss_reason
            return (
                interrupt.is_signalled
                or is_over
                or assembly.clock.now_us() >= deadline_us
                or bool(loss_reason)
                or (may_be_stuck and stuck_watch.observe_cycle())
            )

        assembly.loop.run(is_done)
        interrupt.check()
        run_seconds = (assembly.clock.now_us() - start_us) / MICROSECONDS
        result = sum_up_run(
            assembly,
            options,
            loss_reason,
            limit.verdict,
            stuck_watch,
            run_seconds=run_seconds,
            wall_seconds=time.perf_counter() - started_s,
            is_over=is_over,
        )
        recorder.describe({"status": str(result.status), "reason": result.reason})
        _finish_servers(servers, result, wait_for_user, lambda: interrupt.is_signalled, recorder.loop)
    if recorder.fault:
        reason = f"{result.reason}, but the recording is incomplete: {recorder.fault}"
        return structs.replace(result, status=FAULT, reason=reason)
    return result


def _finish_servers(
    servers: Sequence[RunServer],
    result: RunResult,
    wait_for_user: WaitForUser,
    is_interrupted: Callable[[], bool],
    tick: Callable[[], None],
) -> None:
    """Report the result to the servers; serve clients until the user ends the servers that continue.

    :param wait_for_user: see :data:`WaitForUser`.
    :param is_interrupted: returns whether a signal has been received.
    :param tick: called after each round of the servers, to flush the recording.
    """
    for server in servers:
        server.finish(result)
    if not any(server.lingering_name for server in servers):
        return
    has_ended = wait_for_user(result, servers)
    while not (is_interrupted() or has_ended()):
        for server in servers:
            server.attend()
        tick()
        time.sleep(ATTEND_PAUSE_S)  # the run has ended; only the servers have work


def _attach_clients(
    stack: ExitStack,
    assembly: Run | Team,
    attach: Callable[[Run], None] | None,
    servers: Sequence[RunServer],
) -> None:
    if attach is not None:
        for agent in assembly.agents:
            attach(agent)
    for server in servers:
        stack.enter_context(server.serve(assembly))


def sum_up_run(
    assembly: Run | Team,
    options: RunOptions,
    loss_reason: str,
    verdict: tuple[int, str] | None,
    stuck_watch: StuckWatch,
    *,
    run_seconds: float,
    wall_seconds: float,
    is_over: bool,
) -> RunResult:
    """Return the result of a run.

    :param loss_reason: the lost component that ended the run, with the reason; else empty.
    :param verdict: status and reason if the limit of a cycle ended the run; else None.
    :param stuck_watch: has the missing events if the run is stuck.
    :param run_seconds: the duration by the run's clock.
    :param wall_seconds: the duration in real time.
    :param is_over: whether the run reached its end: in a team, all agents.
    """
    is_team = len(assembly.agents) > 1
    verdicts = [
        verdict
        or _judge_agent(
            agent, options, loss_reason, stuck_watch, is_over=is_over or (is_team and agent.is_over)
        )
        for agent in assembly.agents
    ]
    return sum_up(
        {
            agent.name: RunResult(
                status,
                reason,
                spec=agent.spec,
                goals=agent.executive.goals.all_states(),
                forgotten_goal_count=agent.executive.goals.forgotten_count,
                loops=agent.loop.cycle_count,
                firings=agent.firings,
                run_seconds=run_seconds,
                wall_seconds=wall_seconds,
                is_stuck=bool(stuck_watch.missing_events) and status == TIMED_OUT,
            )
            for agent, (status, reason) in zip(assembly.agents, verdicts, strict=True)
        }
    )


class _LoopLimit:
    """Ends a run whose rules take more real time in one cycle than the timeout, but at least MIN_STALL_S.

    The virtual clock stands still within a cycle, so only real time can limit the duration of a cycle.
    """

    def __init__(self, run: Run | Team, timeout_s: float) -> None:
        self.verdict: tuple[int, str] | None = None
        """Status and reason if the limit ended the run; else None."""
        self._run = run
        self._limit_s = max(timeout_s, MIN_STALL_S)

    def handle_report(self, stall: Stall | None) -> None:
        """End the run if its rules exceed the limit. Called in the thread of the watchdog."""
        if stall is not None and stall.is_in_rules and stall.seconds >= self._limit_s:
            self.verdict = TIMED_OUT, str(stall)
            self._run.loop.stop()
            self._run.interrupt()


def _start(assembly: Run | Team, interrupt: Interrupt) -> None:
    try:
        assembly.start()
    except CxbridgeError:
        interrupt.check()  # an interrupted start may fail with any error
        raise
    interrupt.check()


def make_run(
    options: RunOptions, replay: Replay | None = None, additions: Additions = NO_ADDITIONS
) -> Run | Team:
    """Make a run of one agent or of a team.

    :raises CxbridgeError: if a file or setting is missing or wrong, or a replay is of several agents.
    """
    base = make_base(options, None if replay is None else replay.clock, recorded=bool(additions.writers))
    names = [] if options.agent else agent_names(base.config)
    if replay is not None and (names or (options.agent and len(replay.recordings.envs) > 1)):
        raise CxbridgeError(
            "a recording of several agents is not replayed",
            hint="record one agent with --agent, and replay it with the same option",
        )
    if not names:
        return Run(options, base, replay, additions)
    from cxbridge.run.team import Team  # noqa: PLC0415 - start-up time is a feature

    return Team(options, base, names, additions)


def _judge_agent(
    agent: Run, options: RunOptions, loss_reason: str, stuck_watch: StuckWatch, *, is_over: bool
) -> tuple[int, str]:
    """Return the exit status of an agent, and the reason.

    :param loss_reason: the lost component that ended the run, with the reason; else empty.
    :param stuck_watch: has the missing events if the run is stuck.
    :param is_over: whether the agent reached its end, which may be before the end of its team.
    """
    env, goals = agent.executive.env, agent.executive.goals
    maintained_goals = ", ".join(agent.executive.maintaining_goals)
    shortcomings = _find_shortcomings(goals, has_quit_early=env.quit_requested and not maintained_goals)
    # after a loss, the result of an agent that is over and successful still counts
    if fault := next(iter(env.faults), loss_reason if shortcomings or not is_over else ""):
        return FAULT, fault
    if not agent.executive.knows_goals:
        return _judge_agent_without_goals(agent)
    if not is_over and not maintained_goals:
        return TIMED_OUT, _describe_timeout(agent, options.timeout, stuck_watch)
    if shortcomings:
        return UNSUCCESSFUL, ", ".join(shortcomings)
    if not maintained_goals and not goals.outcome_counts:
        return UNSUCCESSFUL, "the agent quit before any goal was over"
    return COMPLETED, (
        f"maintaining {maintained_goals}" if maintained_goals else "every root goal ended COMPLETED"
    )


def _judge_agent_without_goals(agent: Run) -> tuple[int, str]:
    """Return exit status and reason of an agent without goals, which runs until it quits or times out."""
    if error := agent.executive.first_error:
        return UNSUCCESSFUL, f"an error was reported: {error}"
    if agent.executive.env.quit_requested:
        return COMPLETED, "the agent quit, and reported no error"
    return COMPLETED, "its time limit was reached, and no error was reported"


def _find_shortcomings(goals: GoalWatch, *, has_quit_early: bool) -> list[str]:
    """Return the reasons why an agent was not successful; empty without such a reason.

    :param has_quit_early: whether the agent quit, so that open root goals count as failures.
    """
    shortcomings = []
    if goals.outcome_counts.total() > goals.outcome_counts["COMPLETED"]:
        # in a very long run, the first ended goals are forgotten
        shortcomings = [
            f"{goal.goal} ended {goal.outcome}" for goal in goals.ended_roots if goal.outcome != "COMPLETED"
        ]
        shortcomings = shortcomings or ["some root goals did not end COMPLETED"]
    if goals.open_roots and has_quit_early:
        shortcomings.append(
            f"the agent quit before its root goals were over: {_describe_modes(goals.open_roots)}"
        )
    return shortcomings


def _describe_timeout(agent: Run, timeout_s: float, stuck_watch: StuckWatch) -> str:
    """Return the events that a stuck run waits for, or the open goals or steps of a run that timed out."""
    if missing_events := stuck_watch.missing_events.get(agent.name):
        return f"nothing can happen any more: {missing_events}"
    goals = agent.executive.goals
    if not agent.executive.is_initialized:
        open_work = "the initialisation has not ended"
    elif goals.open_roots:
        open_work = f"not over: {_describe_modes(goals.open_roots)}"
    else:
        open_work = "no goal has appeared" if not goals.outcome_counts else "a skill or a rule had not ended"
    return f"{open_work} after {timeout_s:g} s"


def _describe_modes(goals: Iterable[GoalState]) -> str:
    """Return goals with their modes, e.g. ``G is DISPATCHED, H is EXPANDED``."""
    return ", ".join(f"{goal.goal} is {goal.mode}" for goal in goals)
