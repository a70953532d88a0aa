"""A blackboard with a Skiller and a client that commands the Skiller."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus, InterfaceWrite, Level, LogLine
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.mainloop import DEFAULT_PERIOD_US
from cxbridge.resources import shipped_dir
from cxbridge.skiller.backend import Mode, SkillerBackend
from cxbridge.skiller.lua.limits import Limits
from cxbridge.skiller.make import make_lua_skiller
from cxbridge.skiller.skiller import Skiller

# Skills for tests: ``count`` is final in its third loop, ``fail`` fails, ``done`` is final at once.
SKILLS = {
    "space": """
require("fawkes.modinit")
module(..., fawkes.modinit.register_all)
for _, skill in ipairs {"count", "fail", "done"} do skillenv.use_skill("skills." .. skill) end
""",
    "count": """
module(..., skillenv.module_init)
name = "count"
fsm = SkillHSM:new{name = name, start = "COUNT"}
documentation = "Final in its third loop."
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "COUNT"}
fsm:add_transitions{{"COUNT", "FINAL", cond = "vars.n >= (vars.to or 3)", desc = "counted"}}
function COUNT:init() fsm.vars.n = 0 end
function COUNT:loop()
    fsm.vars.n = fsm.vars.n + 1
    if fsm.vars.tell then print_info("n=%d", fsm.vars.n) end
end
function COUNT:exit() print_debug("leave COUNT") end
""",
    "fail": """
module(..., skillenv.module_init)
name = "fail"
fsm = SkillHSM:new{name = name, start = "TRY"}
documentation = "Fails, with a text or without one."
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "TRY"}
fsm:add_transitions{
    {"TRY", "FAILED", cond = "vars.why == nil and vars.tries == 1", desc = "only a label"},
    {"TRY", "FAILED", cond = "vars.why ~= nil", error = "on purpose"},
}
function TRY:loop() fsm.vars.tries = 1 end
""",
    "done": """
module(..., skillenv.module_init)
name = "done"
documentation = "Final at once; no state machine."
skillenv.skill_module(_M)
function execute() return S_FINAL end
function reset() end
""",
}


def write_skills(folder: Path, skills: dict[str, str]) -> Path:
    """Write skill files into a folder; return the folder."""
    for name, text in skills.items():
        path = folder / f"{name}.lua"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


class Rig:
    """A blackboard with backends; ``events`` has the log lines and writes since the last :meth:`forget`."""

    def __init__(self, interface_dirs: Sequence[Path] = ()) -> None:
        self.clock = VirtualClock()
        self.bus = EventBus(self.clock)
        self.events: list[Any] = []
        self.bus.subscribe(self.events.append, LogLine, InterfaceWrite)
        self.board = LocalBlackBoard(InterfaceRegistry(interface_dirs), self.clock, self.bus)
        self.backends: list[Any] = []
        self.commander = self.reader()

    def lua(
        self,
        folders: Sequence[Path] | None = None,
        *,
        space: str = "test",
        mode: Mode = "strict",
        limits: Limits | None = None,
        **more: Any,
    ) -> Skiller:
        """Add a Lua Skiller."""
        skiller = make_lua_skiller(
            self.board, self.clock, self.bus, folders=folders, space=space, mode=mode, limits=limits, **more
        )
        self.add(skiller)
        return skiller

    def add(self, backend: Any) -> Any:
        """Add a backend, which runs in each loop."""
        self.backends.append(backend)
        return backend

    def reader(self) -> Any:
        """Open SkillerInterface::Skiller for reading."""
        return self.board.open_for_reading("SkillerInterface", "Skiller", owner="test")

    def loop(self, times: int = 1) -> None:
        """Run main loops."""
        for _ in range(times):
            for backend in self.backends:
                backend.loop()
            self.clock.sleep_until(self.clock.now_us() + DEFAULT_PERIOD_US)

    def send(self, kind: str, *values: Any, by: Any = None, remote: bool = False) -> int:
        """Send a message to the Skiller and return its id."""
        reader = by or self.commander
        message = reader.MESSAGES[f"{kind}Message"](*values)
        if remote:
            message.mark_foreign(1)
        number: int = reader.msgq_enqueue(message)
        return number

    def exec(self, text: str, loops: int = 1) -> int:
        """Order a skill string and run loops."""
        number = self.send("ExecSkill", text)
        self.loop(loops)
        return number

    @property
    def state(self) -> Any:
        """The interface after a read."""
        self.commander.read()
        return self.commander

    @property
    def status(self) -> str:
        """The current status."""
        name: str = self.state.status.name
        return name

    def forget(self) -> None:
        """Clear the recorded events."""
        self.events.clear()

    def logged(self, level: Level) -> list[str]:
        """Return the texts of the log lines of a level."""
        return [event.text for event in self.events if isinstance(event, LogLine) and event.level is level]

    def writes(self, *fields: str, uid: str = "SkillerInterface::Skiller") -> list[Any]:
        """Return the values of fields in each write of an interface; enums by name."""
        rows = []
        for event in self.events:
            if isinstance(event, InterfaceWrite) and event.uid == uid:
                row = tuple(getattr(event.values[field], "name", event.values[field]) for field in fields)
                rows.append(row[0] if len(row) == 1 else row)
        return rows


def shipped_interfaces() -> Path:
    """Return the folder of the interface definitions."""
    return shipped_dir("interfaces")


__all__ = ["SKILLS", "Rig", "SkillerBackend", "shipped_interfaces", "write_skills"]
