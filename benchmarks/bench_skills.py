"""Lua skills: a loop of a thousand that run at once, a command, a reload.

A thousand skills of five states each over a hundred Skillers on one blackboard, ten skills in each skill
string. Every skill waits in one of its states, tests two conditions there in each loop, and goes on to the
next state every fourth loop. Printed are the medians; processor time, because others use the machine, too.

    python -m benchmarks skills     exits with 1 when a limit is missed
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.skiller.make import make_lua_skiller
from cxbridge.skiller.skiller import Skiller

SKILLERS = 100
SKILLS = 10
STATES = 5
LOOPS = 60
LOOP_LIMIT_MS = 33.0
COMMAND_LIMIT_US = 100.0
RELOADED_SKILLS = 40
RELOAD_LIMIT_MS = 200.0

_SKILL = """
module(..., skillenv.module_init)
name = "{name}"
fsm = SkillHSM:new{{name = name, start = "S1"}}
documentation = "Goes round its states."
skillenv.skill_module(_M)
function waited(state) return fsm.vars.n >= 4 end
fsm:define_states{{export_to = _M, "S1", "S2", "S3", "S4", "S5"}}
fsm:add_transitions{{
    {{"S1", "S2", cond = waited}}, {{"S2", "S3", cond = waited}}, {{"S3", "S4", cond = waited}},
    {{"S4", "S5", cond = waited}}, {{"S5", "S1", cond = waited}},
    {{"S1", "FINAL", cond = "vars.stop"}}, {{"S2", "FINAL", cond = "vars.stop"}},
    {{"S3", "FINAL", cond = "vars.stop"}}, {{"S4", "FINAL", cond = "vars.stop"}},
    {{"S5", "FINAL", cond = "vars.stop"}},
}}
local function enter(self) fsm.vars.n = 0 end
local function loop(self) fsm.vars.n = fsm.vars.n + 1 end
for i = 1, 5 do
    _M["S" .. i].init, _M["S" .. i].loop = enter, loop
end
"""


def write_space(folder: Path, skills: int) -> None:
    names = [f"round{number}" for number in range(skills)]
    (folder / "space.lua").write_text("".join(f'skillenv.use_skill("skills.{name}")\n' for name in names))
    for name in names:
        (folder / f"{name}.lua").write_text(_SKILL.format(name=name))


def median_cpu(work: Callable[[], object], times: int) -> float:
    """Return the median processor time of a call, in seconds."""
    spent = []
    for _ in range(times):
        started = time.process_time()
        work()
        spent.append(time.process_time() - started)
    return statistics.median(spent)


class Crowd:
    """Skillers on one board."""

    def __init__(self, folder: Path) -> None:
        self.clock = VirtualClock()
        self.bus = EventBus(self.clock)
        self.board = LocalBlackBoard(InterfaceRegistry(), self.clock, self.bus)
        self.skillers: list[Skiller] = [
            make_lua_skiller(
                self.board, self.clock, self.bus, folders=[folder], space="space", name=f"Skiller{number}"
            )
            for number in range(SKILLERS)
        ]
        self.readers: list[Any] = [
            self.board.open_for_reading("SkillerInterface", f"Skiller{number}", owner="bench")
            for number in range(SKILLERS)
        ]

    def order(self, reader: Any, text: str) -> None:
        reader.msgq_enqueue(reader.ExecSkillMessage(text))

    def loop(self) -> None:
        for skiller in self.skillers:
            skiller.loop()
        self.clock.sleep_until(self.clock.now_us() + 33_333)


def bench_loop(crowd: Crowd) -> bool:
    text = "; ".join(f"round{number}{{}}" for number in range(SKILLS))
    for reader in crowd.readers:
        crowd.order(reader, text)
    crowd.loop()
    running = 0
    for reader in crowd.readers:
        reader.read()
        running += reader.status.name == "S_RUNNING"
    assert running == SKILLERS
    spent = median_cpu(crowd.loop, LOOPS) * 1e3
    print(f"one loop of {SKILLERS * SKILLS} skills: {spent:.1f} ms (limit {LOOP_LIMIT_MS:g} ms)")
    return spent <= LOOP_LIMIT_MS


def bench_command(crowd: Crowd) -> bool:
    """The loop in which a command is taken, against the loop after it: the difference is its cost.

    No two skill strings are equal: nothing of one serves for another.
    """
    reader, skiller = crowd.readers[0], crowd.skillers[0]
    costs = []
    for number in range(1000):
        crowd.order(reader, f'round{number % 2}{{place="C{number}", number={number}}}')
        started = time.process_time()
        skiller.loop()
        taken = time.process_time()
        skiller.loop()
        costs.append(2 * taken - started - time.process_time())
        reader.read()
        assert reader.status.name == "S_RUNNING"
    cost, least = statistics.median(costs) * 1e6, statistics.quantiles(costs, n=10)[0] * 1e6
    print(
        f"a command: {cost:.0f} us (limit {COMMAND_LIMIT_US:g} us); a tenth of them less than {least:.0f} us"
    )
    return cost <= COMMAND_LIMIT_US


def bench_reload(folder: Path) -> bool:
    write_space(folder, RELOADED_SKILLS)
    clock = VirtualClock()
    bus = EventBus(clock)
    with LocalBlackBoard(InterfaceRegistry(), clock, bus) as board:
        skiller = make_lua_skiller(board, clock, bus, folders=[folder], space="space")
        spent = median_cpu(skiller.engine.reload, 15) * 1e3
    print(f"reload of {RELOADED_SKILLS} skills: {spent:.0f} ms (limit {RELOAD_LIMIT_MS:g} ms)")
    return spent <= RELOAD_LIMIT_MS


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_space(folder, SKILLS)
        crowd = Crowd(folder)
        good = [bench_loop(crowd), bench_command(crowd), bench_reload(folder)]
    if not all(good):
        sys.exit(1)


if __name__ == "__main__":
    main()
