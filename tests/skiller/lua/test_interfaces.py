"""Blackboard interfaces in Lua: fields, constants, messages, queues."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.events import Level
from tests.skiller.rig import Rig, write_skills


@pytest.fixture
def rig() -> Rig:
    rig = Rig()
    rig.lua(mode="fawkes")
    rig.loop()
    rig.forget()
    return rig


def check(rig: Rig, text: str) -> None:
    """Run a skill string that must not log an error."""
    rig.exec(text)
    assert rig.logged(Level.ERROR) == []


def test_writer_sets_fields_and_publishes(rig: Rig):
    reader: Any = rig.board.open_for_reading("SpeechSynthInterface", "Lua", owner="test")
    check(
        rig,
        """
local i = blackboard:open_for_writing("SpeechSynthInterface", "Lua")
i:set_text("Grüße"); i:set_msgid(7); i:set_final(true); i:set_duration(1.5)
assert(i:text() == "Grüße" and i:msgid() == 7 and i:is_final() and i:duration() == 1.5 and i:changed())
i:write()
assert(i:is_writer() and i:has_writer())
assert(i:type() == "SpeechSynthInterface" and i:id() == "Lua" and i:uid() == "SpeechSynthInterface::Lua")
assert(i:maxlenof_text() == 1024)
""",
    )
    reader.read()
    assert (reader.text, reader.msgid, reader.final, reader.duration) == ("Grüße", 7, True, 1.5)


def test_array_indices_start_at_zero(rig: Rig):
    reader: Any = rig.board.open_for_reading("Position3DInterface", "Lua", owner="test")
    check(
        rig,
        """
local i = blackboard:open_for_writing("Position3DInterface", "Lua")
i:set_translation(2, 0.5)
assert(i:translation(2) == 0.5 and i:translation(0) == 0 and i:maxlenof_translation() == 3)
i:write()
""",
    )
    reader.read()
    assert reader.translation == (0.0, 0.0, 0.5)


def test_enum_values_are_numbers_of_class(rig: Rig):
    check(
        rig,
        """
local i = blackboard:open_for_reading("SkillerInterface", "Skiller")
i:read()
assert(i.S_RUNNING == 2 and i:status() == i.S_RUNNING)
""",
    )


def test_reader_sends_messages_and_writer_takes_them(rig: Rig):
    check(
        rig,
        """
local w = blackboard:open_for_writing("SpeechSynthInterface", "Lua")
local r = blackboard:open_for_reading("SpeechSynthInterface", "Lua")
local m = r.SayMessage:new("one")
assert(r:msgq_enqueue_copy(m) == 1 and m:id() == 1)
local empty = r.SayMessage:new(); empty:set_text("two"); assert(r:msgq_enqueue_copy(empty) == 2)
assert(w:msgq_size() == 2 and not w:msgq_empty())
local first = w:msgq_first()
assert(first:type() == "SayMessage" and first:text() == "one" and first:id() == 1)
assert(first:source_id():get_string() == r:serial():get_string())
w:msgq_pop(); assert(w:msgq_first():text() == "two")
w:msgq_remove(2); assert(w:msgq_first() == nil)
blackboard:close(w); blackboard:close(r)
""",
    )


WITHOUT_WRITER = """
local i = blackboard:open_for_reading("SwitchInterface", "x")
i:msgq_enqueue(i.EnableSwitchMessage:new())
"""


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('blackboard:open_for_reading("NoInterface", "x")', "Interface of type 'NoInterface' not found"),
        ('blackboard:open_for_writing("SkillerInterface", "Skiller")', "writ"),
        (WITHOUT_WRITER, "No writing instance"),
        ('local i = blackboard:open_for_writing("SpeechSynthInterface", "x"); i:set_msgid(-1)', "msgid"),
        ('local i = blackboard:open_for_writing("SpeechSynthInterface", "x"); i:set_msgid("a")', "msgid"),
        ('local i = blackboard:open_for_writing("SpeechSynthInterface", "x"); i:set_text({})', "text"),
        (
            'local i = blackboard:open_for_writing("SpeechSynthInterface", "x"); i:set_nothing(1)',
            "set_nothing",
        ),
        ('local i = blackboard:open_for_writing("Position3DInterface", "x"); i:translation(3)', ""),
    ],
)
def test_refusal_of_blackboard_is_lua_error(rig: Rig, text: str, problem: str):
    rig.exec(text)
    assert rig.status == "S_FAILED"
    assert problem in rig.logged(Level.ERROR)[0].partition("|")[2]


def test_wait_takes_given_time(rig: Rig):
    rig.exec("wait{seconds=0.2}", loops=6)
    assert rig.status == "S_RUNNING"
    rig.loop(2)
    assert rig.status == "S_FINAL"


@pytest.mark.parametrize("text", ["wait{}", "wait{seconds=-1}", 'wait("long")'])
def test_wait_needs_a_duration(rig: Rig, text: str):
    rig.exec(text, loops=2)
    assert (rig.status, rig.state.error) == ("S_FAILED", "seconds must be a number that is not negative")


def test_fields_are_published_at_end_of_loop(tmp_path: Path):
    skill = """
module(..., skillenv.module_init)
name = "tell"
fsm = SkillHSM:new{name = name, start = "TELL"}
documentation = "Tells the loop it is in."
depends_interfaces = {{v = "out", type = "SpeechSynthInterface", id = "Out", writing = true}}
skillenv.skill_module(_M)
fsm:define_states{export_to = _M, "TELL"}
function TELL:loop()
    fsm.vars.n = math.min((fsm.vars.n or 0) + 1, 2)
    out:set_msgid(fsm.vars.n)
end
"""
    write_skills(tmp_path, {"space": 'skillenv.use_skill("skills.tell")', "tell": skill})
    rig = Rig()
    rig.lua([tmp_path], space="space")
    rig.exec("tell{}", loops=4)
    assert rig.writes("msgid", uid="SpeechSynthInterface::Out") == [1, 2]
