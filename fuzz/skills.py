"""Skill strings for a Skiller: the Skiller refuses the text, or a real Lua makes the same calls.

The first byte of an input is not part of the text. After any skill string, the Skiller must accept the next
skill string.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.errors import SkillError
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.skiller.lua.limits import MEBIBYTE, Limits
from cxbridge.skiller.make import make_lua_skiller
from cxbridge.skiller.skillstring import LuaCall, read_calls
from fuzz.luaoracle import lua_calls, normalise

STALL_SECONDS: Final = 0.05
"""The maximum processor time of a loop."""

_LOOPS: Final = 3  # of each skill string: `count` ends in its second loop
_MAX_BYTES: Final = 1000  # of an input; the field of the skill string has 1024
_MAX_ORDERS: Final = 5000  # of a Skiller, which is then replaced
_PERIOD_US: Final = 33_333  # of the main loop
_MODULE_HEAD: Final = "module(..., skillenv.module_init)\n"
_LUA_MODULES: Final = {
    "space": 'for _, name in ipairs {"count", "echo"} do skillenv.use_skill("skills." .. name) end',
    "count": _MODULE_HEAD
    + """
name = "count"
documentation = "Final in its second loop."
fsm = SkillHSM:new{name = name, start = "COUNT"}
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "COUNT"}
fsm:add_transitions{{"COUNT", "FINAL", cond = "vars.n >= 2"}}
function COUNT:init() fsm.vars.n = 0 end
function COUNT:loop() fsm.vars.n = fsm.vars.n + 1 end
""",
    "echo": _MODULE_HEAD
    + """
name = "echo"
documentation = "Writes a text to an interface."
depends_interfaces = {{v = "out", type = "SpeechSynthInterface", id = "Echo", writing = true}}
skillenv.skill_module(_M)
function execute(args)
    if type(args) == "table" then out:set_text(tostring(args.text)) end
    return S_FINAL
end
function reset() end
""",
}


class _Robot:
    """A Skiller on a blackboard, and a reader for orders."""

    def __init__(self) -> None:
        self._clock = VirtualClock()
        board = LocalBlackBoard(InterfaceRegistry(), self._clock, EventBus(self._clock))
        with tempfile.TemporaryDirectory() as folder:
            for name, text in _LUA_MODULES.items():
                Path(folder, f"{name}.lua").write_text(text)
            limits = Limits(memory=32 * MEBIBYTE)  # a quarter of the default; enough for both skills
            self.skiller = make_lua_skiller(
                board,
                self._clock,
                EventBus(self._clock),
                folders=[Path(folder)],
                space="space",
                limits=limits,
            )
        self._reader: Any = board.open_for_reading("SkillerInterface", "Skiller", owner="fuzz")
        self.order_count = 0
        self.slowest_loop_s = 0.0  # processor time of the slowest loop of the last order

    def order(self, text: str) -> tuple[str, str]:
        """Execute a skill string for some loops; return the final status and the error."""
        self.order_count += 1
        self._reader.msgq_enqueue(self._reader.ExecSkillMessage(text))
        self.slowest_loop_s = 0.0
        for _ in range(_LOOPS):
            begin_s = time.process_time()
            self.skiller.loop()
            self.slowest_loop_s = max(self.slowest_loop_s, time.process_time() - begin_s)
            self._clock.sleep_until(self._clock.now_us() + _PERIOD_US)
        self._reader.read()
        return self._reader.status.name, self._reader.error


_robots: list[_Robot] = []  # the present robot, if there is one


def _robot() -> _Robot:
    """Return the present robot, which inputs share because a new one is slow to make."""
    if not _robots or _robots[0].order_count > _MAX_ORDERS:
        for old in _robots:
            old.skiller.close()
        _robots[:] = [_Robot()]
    return _robots[0]


def skill_strings(data: bytes) -> None:
    """Execute a skill string, and a valid skill string after it.

    :param data: an ignored byte, and the text.
    """
    _order_and_check(data)


def timed_skill_strings(data: bytes) -> None:
    """Execute a skill string, and fail if a loop is too slow in three attempts.

    Only for the fuzzer, because a busy machine is slow as well.
    """
    if all(_order_and_check(data) > STALL_SECONDS for _ in range(3)):
        raise AssertionError(f"a loop takes longer than {STALL_SECONDS} s: {text_of(data)!r}")


def _order_and_check(data: bytes) -> float:
    """Execute a skill string, check the effects, and execute a valid skill string.

    :returns: the processor time of the slowest loop, in seconds.
    """
    text = text_of(data)
    robot = _robot()
    status, error = robot.order(text)
    slowest_loop_s = robot.slowest_loop_s
    _check_effects(text, status, error)
    assert robot.order("count{}") == ("S_FINAL", ""), f"after {text!r}"
    return slowest_loop_s


def text_of(data: bytes) -> str:
    """Return the skill string of an input."""
    return data[1:_MAX_BYTES].replace(b"\0", b" ").decode("utf-8", "surrogateescape")


def _check_effects(text: str, status: str, error: str) -> None:
    """Fail if the effects of a text differ from its calls."""
    problem = ""
    calls: list[LuaCall] = []
    try:
        calls = read_calls(text)
    except SkillError as refusal:
        problem = refusal.message
    if problem:
        assert status == "S_FAILED"
        # the field has 128 bytes, and cuts the message; a message outside ASCII is not compared
        assert error.isascii() is False or error == problem[: len(error)], f"{text!r}: {error}"
        return
    ours = [(call.name, normalise(call.values)) for call in calls]
    assert ours == lua_calls(text), f"{text!r} makes other calls in Lua"
    if any(call.name not in ("count", "echo") for call in calls):
        assert (status, "there is no skill" in error) == ("S_FAILED", True)
    elif not calls:
        assert status == "S_INACTIVE"


def _seeds() -> Iterator[bytes]:
    for text in (
        'echo{text="Hello", wait=true}', "echo('x', -1.5e3, 0x1F, nil, true)",
        "echo[[long]] count'x'; count{}", "", "count{a={1,{2}},['b c']=[==[\n]]]==]} -- end",
        "echo{text='\\65\\n\\\n'} --[[ x ]]", "count{to=name}", "fly{}", "count.module('x')",
        "echo{text=os.time()}",
    ):  # fmt: skip
        yield b"\0" + text.encode()


SKILL_STRINGS: Final = tuple(_seeds())
"""Seeds: skill strings of users, and texts that are not data."""
