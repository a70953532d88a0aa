"""The feature `blackboard`."""

from __future__ import annotations

import pytest

from cxbridge.events import Level
from cxbridge.executive.host.values import Symbol


def facts(env, template):
    return [slots for _, _, slots in env.facts(template)]


def read(env):
    env.eval("(blackboard-read)")


def test_second_opening_is_silent_no_op(env):
    for _ in range(2):
        env.eval('(blackboard-open "SkillerInterface" "Skiller")')
    assert len(facts(env, "blackboard-interface")) == 1


def test_fact_of_write_is_replaced_by_next_write(env, board, bus):
    env.eval('(blackboard-open-reading "SkillerInterface" "Skiller")')
    with board.open_for_writing("SkillerInterface", "Skiller") as writer:
        read(env)
        assert facts(env, "SkillerInterface") == []
        writer.skill_string = 'say{text="hi"}'
        writer.status = writer.S_RUNNING
        writer.msgid = 3
        writer.write()
        read(env)
        (fact,) = facts(env, "SkillerInterface")
        assert fact["skill_string"] == 'say{text="hi"}'
        assert (fact["msgid"], fact["status"], fact["id"]) == (3, Symbol("S_RUNNING"), "Skiller")
        assert fact["time"] == (1_000_000_000, 0)
        read(env)
        assert len(facts(env, "SkillerInterface")) == 1
        bus.clock.sleep_until(bus.clock.now_us() + 7)
        writer.status = writer.S_FINAL
        writer.write()
        read(env)
        (fact,) = facts(env, "SkillerInterface")
        assert (fact["status"], fact["time"]) == ("S_FINAL", (1_000_000_000, 7))


def test_time_fact_reads_if_enabled(env, board):
    env.eval('(blackboard-open-reading "TestInterface" "T")')
    env.eval("(blackboard-enable-time-read)")
    with board.open_for_writing("TestInterface", "T") as writer:
        writer.test_int = 4
        writer.write()
        env.assert_ordered("time", (1, 2))
        env.run()
    assert facts(env, "TestInterface")[0]["test_int"] == 4


def test_slots_of_templates_have_types_of_fields(env):
    env.eval('(blackboard-preload "Position3DInterface")')
    assert env.eval("(deftemplate-slot-multip Position3DInterface rotation)") == "TRUE"
    assert env.eval("(deftemplate-slot-types Position3DInterface rotation)") == ("FLOAT",)
    assert env.eval("(deftemplate-slot-multip Position3DInterface frame)") == "FALSE"
    assert facts(env, "blackboard-interface") == []


def test_writing_from_clips(env, board):
    env.eval('(blackboard-open-writing "Position3DInterface" "Pose")')
    with board.open_for_reading("Position3DInterface", "Pose") as reader:
        env.eval('(blackboard-set "Position3DInterface::Pose" "frame" "map")')
        env.eval('(blackboard-set-multifield "Position3DInterface::Pose" translation (create$ 1 2.5))')
        reader.read()
        assert reader.frame == ""
        env.eval('(blackboard-write "Position3DInterface::Pose")')
        assert reader.read()
        assert (reader.frame, reader.translation) == ("map", (1.0, 2.5, 0.0))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            '(blackboard-set "TestInterface::X" test_int 1)',
            "Interface TestInterface::X not opened for writing",
        ),
        ('(blackboard-set "Other::X" test_int 1)', "No interface of type Other opened for, writing"),
        ('(blackboard-set "TestInterface::W" nope 1)', "Can't find field nope"),
        ('(blackboard-set "TestInterface::W" test_int "one")', "takes an INTEGER"),
        ('(blackboard-set "TestInterface::W" test_bool 1)', "takes TRUE or FALSE"),
        ('(blackboard-set "TestInterface::W" test_int 99999999999)', "test_int"),
        ('(blackboard-open-reading "NoSuchInterface" "X")', "Failed to open interface NoSuchInterface:X"),
        ('(blackboard-preload "NoSuchInterface")', "Failed to preload interface type NoSuchInterface"),
        ('(blackboard-create-msg "TestInterface::X" "SetTestIntMessage")', "is not opened for reading"),
        ('(blackboard-write "TestInterface::Q")', "not opened for writing"),
    ],
)
def test_invalid_calls_are_logged(env, log, call, message):
    env.eval('(blackboard-open-writing "TestInterface" "W")')
    env.eval(call)
    assert any(message in text for text in log.texts(Level.WARN, Level.ERROR))
    assert env.faults == []


def test_message_reaches_writer_once(env, board, log):
    env.eval('(blackboard-open-reading "SkillerInterface" "Skiller")')
    with board.open_for_writing("SkillerInterface", "Skiller") as writer:
        env.build(
            """(deffunction send-one ()
              (bind ?m (blackboard-create-msg "SkillerInterface::Skiller" "ExecSkillMessage"))
              (blackboard-set-msg-field ?m "skill_string" "wait{}")
              (create$ (blackboard-list-msg-fields ?m) (blackboard-send-msg ?m) (blackboard-send-msg ?m)))"""
        )
        assert env.eval("(send-one)") == ("skill_string", 1, 0)
        message = writer.msgq_first()
        assert (message.type, message.skill_string, message.id) == ("ExecSkillMessage", "wait{}", 1)
        assert str(message.source_id) == facts(env, "blackboard-interface")[0]["serial"]
        writer.msgq_pop()
        assert writer.msgq_empty()
    assert "Can't send message, was it already sent?" in log.texts(Level.WARN)


def test_message_without_writer_has_id_0_and_is_logged(env, log):
    env.eval('(blackboard-open-reading "SkillerInterface" "Skiller")')
    call = '(blackboard-send-msg (blackboard-create-msg "SkillerInterface::Skiller" "StopExecMessage"))'
    assert env.eval(call) == 0
    assert [line.component for line in log.lines if line.level is Level.WARN] == ["BlackBoard"]


def test_destroyed_environment_closes_interfaces(env, manager, board):
    env.eval('(blackboard-open-writing "TestInterface" "T")')
    manager.destroy("executive")
    assert list(board.list_all()) == []


def test_opened_interface_is_logged(env, log):
    env.eval('(blackboard-open-reading "SkillerInterface" "Skiller")')
    (fact,) = facts(env, "blackboard-interface")
    assert (fact["type"], fact["id"], fact["uid"]) == (
        "SkillerInterface",
        "Skiller",
        "SkillerInterface::Skiller",
    )
    assert len(fact["hash"]) == 32
    assert len(fact["serial"]) == 36
    assert fact["writing"] == "FALSE"
    assert "Added interface SkillerInterface::Skiller for reading" in log.texts(Level.INFO)
