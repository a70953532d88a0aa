"""Plays one game in a world whose events are drawn from a seed, and summarises the result."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

from cxbridge.events import InterfaceMessage, InterfaceWrite, LogLine, Sink, SkillStatus
from cxbridge.history.builder import RunHistory
from cxbridge.interrupt import Interrupt
from cxbridge.mainloop import Hook
from cxbridge.run.options import RunOptions
from cxbridge.run.recording import start_recording
from cxbridge.run.result import FAULT
from cxbridge_explore.game.judge import GameWatch, MakeJudge
from cxbridge_explore.game.score import POST_GAME, GameResult
from cxbridge_explore.game.work import find_robots, summarize_work
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import RandomChooser
from cxbridge_explore.worlds.run import MakeAssembly, WorldRun, make_scenario

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

_INTERRUPTED_STATUS: Final = 130  # exit status of shells for SIGINT: 128 + 2

OUTCOME_FILE: Final = "outcome.json"  # the attachment of the recording that has `GameResult.outcome`


def play_game(
    options: RunOptions,
    seed: int,
    world: WorldModel,
    make_judge: MakeJudge,
    *,
    make_assembly: MakeAssembly = make_scenario,
    console: Sink | None = None,
    attach: Callable[[Run], None] | None = None,
) -> GameResult:
    """Play a game to its end, and return its result.

    :param options: the options of the run.
    :param seed: the seed from which the events of the world are drawn, such as failures of skills.
    :param world: the possible events.
    :param make_judge: makes the judge, which reports the state and the score.
    :param make_assembly: makes the program to run.
    :param console: a sink for log lines.
    :param attach: called with each agent before the game.
    :raises KeyboardInterrupt: if a signal has ended the game; the recording is complete up to that point.
    """
    start_s = time.perf_counter()
    with Interrupt() as interrupt, ExitStack() as stack:
        run = stack.enter_context(WorldRun(options, RandomChooser(seed), world, make_assembly=make_assembly))
        assembly = run.assembly
        if console is not None:
            assembly.bus.subscribe(console, LogLine)
        if attach is not None:
            for agent in assembly.agents:
                attach(agent)
        history = RunHistory(start_us=assembly.clock.now_us())
        assembly.bus.subscribe(history.record_event, SkillStatus, InterfaceMessage, InterfaceWrite)
        judge = make_judge(assembly)
        game_watch = GameWatch(judge, assembly.clock)
        recorder = start_recording(assembly, options)
        stack.callback(recorder.close)
        stack.callback(assembly.finalize)  # before the recorder closes, so that the shutdown is recorded
        interrupt.replace_functions(assembly.loop.stop, assembly.interrupt)
        assembly.loop.add(Hook.POST_LOOP, game_watch.record)
        assembly.loop.add(Hook.POST_LOOP, recorder.flush_when_due)
        verdict = run.play().verdict
        score = judge.score()
        loaders = [agent.executive.env.loader for agent in assembly.agents]
        result = GameResult(
            score,
            is_over=score.phase == POST_GAME,
            seed=seed,
            wall_seconds=round(time.perf_counter() - start_s, 3),
            robots=summarize_work(history, find_robots(assembly.agents), assembly.clock.now_us(), game_watch),
            machine_seconds=game_watch.machine_seconds(),
            faults=(*((verdict.reason,) if verdict.status == FAULT else ()), *judge.faults),
            undefined_constructs=tuple(
                str(diagnostic)
                for loader in loaders
                for diagnostic in loader.diagnostics
                if diagnostic.construct
            ),
        )
        end_text = "" if result.is_over else f"not over, in {score.phase} at {score.game_time:g} s; "
        status = _INTERRUPTED_STATUS if interrupt.is_signalled else verdict.status
        recorder.describe(
            {"status": str(status), "reason": f"{end_text}{verdict.reason}; points: {score.points}"}
        )
        if options.trace_files:
            assembly.bus.emit_source("game", "", OUTCOME_FILE, json.dumps(result.outcome, indent=1).encode())
        interrupt.check()  # at the end, so that the recording of an interrupted game is complete
        return result
