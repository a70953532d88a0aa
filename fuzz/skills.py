"""Skill strings for a Skiller: as data, as any Lua text, and as Lua made of what a skill string can see.

The first byte of an input says which; the rest is the text, or what to choose when it is made. Whatever it
was, the Skiller takes the next skill string, which does what it should. A text that is data is refused, or
Lua makes the same calls of it.
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
from cxbridge.skiller.lua.engine import MEBIBYTE, Limits
from cxbridge.skiller.luacalls import LuaCall, read_calls
from cxbridge.skiller.make import make_lua_skiller
from fuzz.luaoracle import as_lua_says, normal

STALL_SECONDS: Final = 0.05
"""What a loop may take of the processor at most."""

_LOOPS: Final = 3
_LONGEST: Final = 1000  # bytes; the field has 1024
_RENEWED: Final = 5000  # inputs to one Skiller
_HEAD: Final = "module(..., skillenv.module_init)\n"
_FILES: Final = {
    "space": 'for _, name in ipairs {"count", "echo"} do skillenv.use_skill("skills." .. name) end',
    "count": _HEAD
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
    "echo": _HEAD
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
    """A Skiller on a blackboard, and who commands it."""

    def __init__(self, mode: Any) -> None:
        self._clock = VirtualClock()
        board = LocalBlackBoard(InterfaceRegistry(), self._clock, EventBus(self._clock))
        with tempfile.TemporaryDirectory() as folder:
            for name, text in _FILES.items():
                Path(folder, f"{name}.lua").write_text(text)
            limits = Limits(memory=32 * MEBIBYTE)
            self.skiller = make_lua_skiller(
                board,
                self._clock,
                EventBus(self._clock),
                folders=[Path(folder)],
                space="space",
                mode=mode,
                limits=limits,
            )
        self._reader: Any = board.open_for_reading("SkillerInterface", "Skiller", owner="fuzz")
        self.taken = 0
        self.slowest = 0.0

    def order(self, text: str) -> tuple[str, str]:
        """Have a skill string executed for some loops; return the status in the end, and the error."""
        self.taken += 1
        self._reader.msgq_enqueue(self._reader.ExecSkillMessage(text))
        self.slowest = 0.0
        for _ in range(_LOOPS):
            began = time.process_time()
            self.skiller.loop()
            self.slowest = max(self.slowest, time.process_time() - began)
            self._clock.sleep_until(self._clock.now_us() + 33_333)
        self._reader.read()
        return self._reader.status.name, self._reader.error


_robots: dict[str, _Robot] = {}


def _robot(mode: str) -> _Robot:
    robot = _robots.get(mode)
    if robot is None or robot.taken > _RENEWED:
        if robot is not None:
            robot.skiller.close()
        robot = _robots[mode] = _Robot(mode)
    return robot


def skill_strings(data: bytes) -> None:
    """Order a skill string, and a good one after it.

    :param data: what it is, and the text of it.
    """
    _order(data)


def timed_skill_strings(data: bytes) -> None:
    """Do the same, and fail when a loop takes too long, also when it is done again.

    Only for a fuzzer: others use the machine, too.
    """
    if all(_order(data) > STALL_SECONDS for _ in range(3)):
        raise AssertionError(f"a loop takes longer than {STALL_SECONDS} s: {text_of(data)!r}")


def _order(data: bytes) -> float:
    """Return the processor time of the slowest loop, in seconds."""
    text = text_of(data)
    robot = _robot("fawkes" if data[:1] and data[0] & 3 else "strict")
    status, error = robot.order(text)
    slowest = robot.slowest
    if robot.skiller.mode == "strict":
        _check_data(text, status, error)
    assert robot.order("count{}") == ("S_FINAL", ""), f"after {text!r}"
    return slowest


def text_of(data: bytes) -> str:
    """Return the skill string of an input."""
    if data[:1] and data[0] & 2:
        return made_of(data[1:])[:_LONGEST]
    return data[1:_LONGEST].replace(b"\0", b" ").decode("utf-8", "surrogateescape")


def _check_data(text: str, status: str, error: str) -> None:
    """Fail when a text that is data did anything but what it says."""
    problem = ""
    calls: list[LuaCall] = []
    try:
        calls = read_calls(text)
    except SkillError as refusal:
        problem = refusal.message
    if problem:
        assert status == "S_FAILED"
        assert error.isascii() is False or error == problem[: len(error)], f"{text!r}: {error}"
        return
    ours = [(call.name, normal(call.values)) for call in calls]
    assert ours == as_lua_says(text), f"{text!r} is other calls"
    if any(call.name not in ("count", "echo") for call in calls):
        assert (status, "there is no skill" in error) == ("S_FAILED", True)
    elif not calls:
        assert status == "S_INACTIVE"


# -- Lua that is made of what a skill string can see

_VALUES: Final = (
    "nil", "true", "0", "-1", "1/0", "0/0", "2^31-1", "-2^31", "2^53", "'x'", "'%s%d%q'", "'a-b-c-d-'",
    "('x'):rep(1e5)", "{}", "{1,2,3}", "count", "echo", "skills", "config", "clock", "logger",
    "blackboard", "tf", "string", "math", "os", "table", "t", "f", "s", "function(...) return ... end",
    "'SpeechSynthInterface'", "'/cxbridge/web/token'", "'*t'",
)  # fmt: skip
_CALLED: Final = (
    "assert", "error", "ipairs", "next", "pairs", "select", "tostring", "type", "unpack", "xpcall",
    "print", "printf", "print_info", "sinfo", "count", "echo", "string.byte", "string.char", "string.find",
    "string.format", "string.gmatch", "string.gsub", "string.len", "string.lower", "string.match",
    "string.rep", "string.reverse", "string.sub", "string.join", "string.split", "table.concat",
    "table.insert", "table.remove", "table.sort", "table.maxn", "table.foreach", "table.deepcopy",
    "math.random", "math.floor", "math.fmod", "math.ldexp", "math.round", "os.date", "os.time",
    "os.getenv", "config.get_string", "config.exists", "clock.now", "clock.get_time", "logger.log_info",
    "blackboard.open_for_reading", "blackboard.open_for_writing", "tf.can_transform",
    "tf.lookup_transform", "f", "s.rep",
)  # fmt: skip
_STATEMENTS: Final = (
    "t = {c}", "s = tostring({c})", "for i = 1, 1e9 do {c} end", "while true do {c} end",
    "xpcall(function() {c} end, {v})", "f = function(...) {c}; return f end",
    "t = {{ {v}, {c}, x = {v} }}", "s = (s or 'x') .. (s or 'y')", "{c}", "f({v})",
    "g = (g or '') .. 'x' for i = 1, 9 do g = g .. g end", "t[{v}] = {v}", "{v} = {v}",
    "count{{ to = {v} }}", "echo{{ text = {v} }}", "error({v})", "for k, v in {c} do {c} end", "t = #{v}",
    "t = {v} .. {v}", "t = {v} < {v}",
)  # fmt: skip


def made_of(choices: bytes) -> str:
    """Return a Lua text: each byte chooses what comes next in it."""
    rest = iter(choices)

    def pick(things: tuple[str, ...]) -> str:
        return things[next(rest, 0) % len(things)]

    def call() -> str:
        arguments = ", ".join(pick(_VALUES) for _ in range(next(rest, 0) % 4))
        return f"{pick(_CALLED)}({arguments})"

    statements = []
    for choice in rest:
        pieces = _STATEMENTS[choice % len(_STATEMENTS)]
        while "{c}" in pieces or "{v}" in pieces:
            pieces = pieces.replace("{c}", call(), 1).replace("{v}", pick(_VALUES), 1)
        statements.append(pieces.replace("{{", "{").replace("}}", "}"))
    return "\n".join(statements)


def _scripts() -> Iterator[bytes]:
    for text in (
        'echo{text="Hello", wait=true}', "echo('x', -1.5e3, 0x1F, nil, true)",
        "echo[[long]] count'x'; count{}", "", "count{a={1,{2}},['b c']=[==[\n]]]==]} -- end",
        "echo{text='\\65\\n\\\n'} --[[ x ]]", "count{to=name}", "fly{}", "count.module('x')",
        "echo{text=os.time()}",
    ):  # fmt: skip
        yield b"\0" + text.encode()
        yield b"\1" + text.encode()
    for text in (
        "unpack({}, -2^31, 2^31-1)", "while true do end", "s='x' while true do s=s..s end",
        "t={} for i=1,1e9 do t[i]=i end",
        "xpcall(function() error({}) end, function() while true do end end)", "string.rep('x', 1e9)",
        "('x'):rep(1e5):find(('.-'):rep(50)..'b')", "table.insert({}, -2^31, 1)",
        "os.date(('%c'):rep(1e5))", "print_info(config:get_string('/cxbridge/web/token'))",
        "for i=1,1e9 do print_info('x') end", "skills[1].module('x')", "f=function() return f() end f()",
        "f=function() return 1+f() end f()", "string.format('%99999d', 1)",
        "('x'):gsub('x', function() return f() end)", "table.sort({3,2,1}, function() return true end)",
        "\x1bLua", "for i=1,1e9 do blackboard:open_for_reading('SpeechSynthInterface', 'x'..i) end",
        "g=(g or 'x') g=g..g", "select(-1)",
    ):  # fmt: skip
        yield b"\1" + text.encode()
    for first in range(len(_STATEMENTS)):
        for second in range(0, len(_CALLED), 3):
            yield bytes((2, first, 3, second, first, second, 7, 1, second, 9, 10, 11))


SKILL_STRINGS: Final = tuple(_scripts())
"""Inputs to begin with: what users write, and what attackers wrote."""
