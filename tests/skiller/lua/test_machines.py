"""State machines run as in Fawkes: the order of calls, preconditions, timeouts, errors, sub-skills."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.events import Level
from cxbridge.skiller.backend import Mode
from tests.skiller.rig import SKILLS, Rig, write_skills

HEAD = """
module(..., skillenv.module_init)
name = "test"
fsm = SkillHSM:new{name = name, start = "A"}
documentation = "Under test."
depends_skills = {"count", "fail"}
skillenv.skill_module(_M)
local function follow(...)
    for _, state in ipairs{...} do
        function state:init() print_info("init %s", self.name) end
        function state:loop() print_info("loop %s", self.name) end
        function state:exit() print_info("exit %s", self.name) end
    end
end
"""


def make(tmp_path: Path, body: str, mode: Mode = "fawkes") -> Rig:
    """Return a Skiller whose skill ``test`` has this body; ``follow(STATE...)`` logs the calls."""
    space = SKILLS["space"] + 'skillenv.use_skill("skills.test")'
    write_skills(tmp_path, SKILLS | {"space": space, "test": HEAD + body})
    rig = Rig()
    rig.lua([tmp_path], space="space", mode=mode)
    rig.forget()
    return rig


def take_calls(rig: Rig) -> list[str]:
    """Return the calls logged since the last call, and clear the log."""
    texts = [text for text in rig.logged(Level.INFO) if not text.startswith("MainThread")]
    rig.forget()
    return texts


def test_first_loop_follows_transitions_and_loops_in_last_state(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A", "B", "C"}
fsm:add_transitions{{"A", "B", cond = true}, {"B", "C", cond = "vars.go"}, {"C", "FINAL", cond = "vars.go"}}
follow(A, B, C, FINAL)
function B:loop() print_info("loop B"); fsm.vars.go = true end
""",
    )
    rig.exec("test{}")
    # B's loop enters C, whose condition holds already.
    assert take_calls(rig) == ["init A", "exit A", "init B", "loop B", "exit B", "init C", "exit C",
                               "init FINAL", "exit FINAL"]  # fmt: skip
    assert rig.status == "S_FINAL"


def test_state_after_transition_from_loop_loops_in_next_loop(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A", "B"}
fsm:add_transitions{{"A", "B", cond = "vars.n == 1"}}
follow(A, B)
function A:loop() fsm.vars.n = 1 end
""",
    )
    rig.exec("test{}")
    assert take_calls(rig) == ["init A", "exit A", "init B"]
    rig.loop()
    assert take_calls(rig) == ["loop B"]


def test_preconditions_skip_init_but_not_exit(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A", "B"}
fsm:add_transitions{{"A", "B", precond = true}}
follow(A, B)
""",
    )
    rig.exec("test{}")
    assert take_calls(rig) == ["exit A", "init B", "loop B"]


def test_first_transition_wins_and_timeout_precedes_condition(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A", "B", "C"}
fsm:add_transitions{{"A", "B", cond = "vars.never"}, {"A", "C", timeout = {0, "B"}, cond = true}}
follow(A, B, C)
""",
    )
    rig.exec("test{}")
    assert "init B" in take_calls(rig)


def test_timeout_fires_after_its_duration(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A"}
fsm:add_transitions{{"A", "FINAL", timeout = 0.1}}
""",
    )
    rig.exec("test{}")
    statuses = []
    for _ in range(4):
        statuses.append(rig.status)
        rig.loop()
    # a loop takes 33.333 ms: three loops take 99.999 ms
    assert statuses == ["S_RUNNING"] * 4
    assert rig.status == "S_FINAL"


def test_tenth_transition_in_single_loop_is_error(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A", "B"}
fsm:add_transitions{{"A", "B", cond = true}, {"B", "A", cond = true}}
""",
    )
    rig.exec("test{}")
    assert "Recursion limit (10) reached, infinite loop?" in rig.logged(Level.ERROR)[0]


def test_error_of_transition_fails_skill(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A", "B"}
fsm:add_transitions{{"A", "B", cond = true, error = "one"}, {"B", "A", cond = "vars.never"}}
""",
    )
    rig.exec("test{}")
    assert (rig.status, rig.state.error) == ("S_FAILED", "one")


@pytest.mark.parametrize(
    ("where", "text"),
    [
        ("A:init", "Init failed: skills/test.lua:"),
        ("A:loop", "Loop exception: skills/test.lua:"),
        ("A:exit", "Exit exception: skills/test.lua:"),
        ("B:init", "Init of successor failed: skills/test.lua:"),
    ],
)
def test_lua_error_in_state_fails_skill(tmp_path: Path, where: str, text: str):
    rig = make(
        tmp_path,
        f"""
fsm:define_states{{export_to = _M, "A", "B"}}
fsm:add_transitions{{{{"A", "B", cond = "vars.n == 2"}}}}
function A:loop() fsm.vars.n = 2 end
function {where}() error("broken") end
""",
    )
    rig.exec("test{}")
    assert rig.status == "S_FAILED"
    assert rig.state.error.startswith(text)


@pytest.mark.parametrize(
    "transition",
    [
        '{"A", "B", timeout = 1}',
        '{"A", "B", timeout = {time = 1, error = "late"}}',
        '{"A", "B", cond = function(state) return state.not_there.deeper end}',
        '{"A", "B", cond = "vars.not_there.deeper"}',
    ],
)
def test_first_error_of_init_is_published(tmp_path: Path, transition: str):
    body = f"""
fsm:define_states{{export_to = _M, "A", "B"}}
fsm:add_transitions{{{transition}}}
function A:init() if fsm.vars.broken then error("broken") end end
"""
    rig = make(tmp_path, body, mode="strict")
    for _ in range(2):
        rig.exec("test{broken=true}")
        assert rig.status == "S_FAILED"
        assert re.match(r"Init failed: skills/test.lua:\d+: broken", rig.state.error)
    rig.exec("test{}")
    assert "broken" not in rig.state.error


@pytest.mark.parametrize("kind", ["float", "uint", "int", "bool", "string"])
def test_missing_value_is_error_with_line_in_skill(tmp_path: Path, kind: str):
    rig = make(
        tmp_path,
        f"""
fsm:define_states{{export_to = _M, "A", "B"}}
fsm:add_transitions{{{{"A", "B", timeout = 1}}}}
function A:init()
    if config:is_{kind}("/not/there") then error("there is a value") end
    config:get_{kind}("/not/there")
end
""",
        mode="strict",
    )
    rig.exec("test{}")
    assert rig.state.error.startswith("Init failed: skills/test.lua:20: there is no configuration")


def test_arguments_are_those_of_first_call(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A"}
fsm:add_transitions{{"A", "FINAL", cond = "vars.never"}}
function A:loop() print_info("%s %s", tostring(fsm.vars.x), tostring(fsm.vars[1])) end
""",
    )
    rig.exec("test{x=os.time()}", loops=40)
    assert take_calls(rig) == ["1000000000 nil"] * 40
    rig.exec("test(7)")
    assert take_calls(rig)[-1] == "nil 7"


def test_string_conditions_have_limited_environment(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, closure = {extra = "yes"}, "A", "B"}
fsm:add_transitions{
    {"A", "FAILED", cond = "print_info ~= nil or S_FINAL ~= nil", error = "sees too much"},
    {"A", "FINAL", cond = "vars and fsm and self == state and extra == 'yes' and math.floor(1.5) == 1"},
}
""",
    )
    rig.exec("test{}")
    assert rig.status == "S_FINAL"


def test_default_transitions_leave_all_states(tmp_path: Path):
    rig = make(
        tmp_path,
        """
fsm:define_states{export_to = _M, "A", "B", "C"}
fsm:add_transitions{{"C", cond = "vars.jump", desc = "jump"}, {"A", "B", cond = true}}
function B:loop() fsm.vars.jump = true end
follow(C)
""",
    )
    rig.forget()
    rig.exec("test{}")
    assert take_calls(rig) == ["init C"]


SUB = """
fsm:define_states{{export_to = _M, closure = {{}},
    {{"A", SkillJumpState, skills = {{{{count, {{tell = true}}}}{more}}},
        final_to = "FINAL", fail_to = "{fail_to}"}}, "B"}}
fsm:add_transitions{{{{"B", "FINAL", cond = "vars.never"}}}}
function A:init() {init} end
follow(B)
"""


def test_sub_skill_runs_once_per_loop_until_final(tmp_path: Path):
    rig = make(tmp_path, SUB.format(more="", fail_to="FAILED", init="self.args.count = {to = 2}"))
    rig.exec("test{}")
    assert (rig.status, take_calls(rig)) == ("S_RUNNING", ["n=1"])
    rig.loop()
    assert (rig.status, take_calls(rig)) == ("S_FINAL", ["n=2"])


def test_error_of_sub_skill_is_not_published(tmp_path: Path):
    init = "self.args = {count = {}, fail = {why = 1}, odd = {}}"
    rig = make(tmp_path, SUB.format(more=', {"fail"}', fail_to="B", init=init))
    rig.exec("test{}")
    assert "Unexpected skillname: odd in self.args" in rig.logged(Level.WARN)
    assert take_calls(rig) == ["n=1", "init B"]
    assert (rig.status, rig.state.error) == ("S_RUNNING", "")
    rig.loop()
    assert take_calls(rig) == ["loop B"]


def test_equal_final_and_fail_targets_make_one_transition(tmp_path: Path):
    rig = make(
        tmp_path, SUB.format(more="", fail_to="FINAL", init="") + "print_info(A.transitions[1].description)\n"
    )
    del rig
    second_rig = Rig()
    second_rig.lua([tmp_path], space="space")
    assert "count done" in second_rig.logged(Level.INFO)


def test_reset_exits_current_state(tmp_path: Path):
    rig = make(tmp_path, 'fsm:define_states{export_to = _M, "A"}\nfollow(A)\n')
    rig.exec("test{}")
    take_calls(rig)
    rig.exec("done{}")
    assert take_calls(rig)[1:] == ["exit A"]


def test_sub_machine_shares_variables_and_error(tmp_path: Path):
    rig = make(
        tmp_path,
        """
local inner = SkillHSM:new{name = "inner", start = "I"}
inner:define_states{"I"}
inner:add_transitions{{"I", "FAILED", cond = "vars.x == 1", error = "inner says no"}}
fsm:define_states{export_to = _M,
    {"A", SubFSMJumpState, subfsm = inner, exit_to = "FINAL", fail_to = "B"}, "B"}
fsm:add_transitions{{"B", "FINAL", cond = "vars.never"}}
""",
    )
    rig.exec("test{x=1}")
    assert (rig.status, rig.state.error) == ("S_FAILED", "inner says no")
