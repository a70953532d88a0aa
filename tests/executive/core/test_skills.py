"""Skills in the built-in core: control of skillers, calls, outcomes, cancellation.

The rows are those of the compatibility page on the behaviour of the CX core, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from tests.executive.core.core_bench import Bench
from tests.executive.fake_skiller import FakeSkiller

STEAL = "/clips-executive/steal-skiller-control"
OTHER = "somebody-else"


class Skills:
    """The rules for skills and for actions that are skills, with a skiller that the test plays."""

    def __init__(self, **skiller: bool) -> None:
        self.bench = Bench("plan.clp")
        self.skiller = FakeSkiller(**skiller)
        self.env = self.bench.env
        self.skiller.init_context(self.env)
        self.mapped: list[tuple[str, Value, Value]] = []
        self.env.define("map-action-skill", self._map, 3, types="*;sy;m;m")
        self.skiller.env.call("blackboard-enable-time-read")
        for name in ("skills.clp", "skills-calls.clp", "skills-actions.clp"):
            self.bench.load(f"cx/{name}")
        self.bench.config("/clips-executive/spec", "s")
        for action in ("say", "unmappable"):
            self.bench.config(f"/clips-executive/specs/s/action-mapping/{action}", f"{action}{{}}")
        self.seen = 0

    def _map(self, action: str, names: Sequence[Value], values: Sequence[Value]) -> str:
        self.mapped.append((str(action), names, values))
        return "" if action == "unmappable" else f"{action}{{}}"

    def loop(self, seconds: float = 0.1, loops: int = 1) -> None:
        """Run loops of the executive and the skiller."""
        for _ in range(loops):
            self.bench.tick(seconds)
            self.seen = self.skiller.loop(self.seen)

    def write_status(self, seconds: float = 0.1, **fields: Value) -> None:
        """Write the skiller's interface, and run the executive."""
        self.skiller.write(**fields)
        self.bench.tick(seconds)

    def control(self) -> tuple[Value, Value]:
        """Return the slots acquired and acquiring."""
        fact = self.bench.one("skiller-control")
        return fact["acquired"], fact["acquiring"]

    def acquire(self) -> None:
        """Get control."""
        self.env.assert_string("(skiller-control)")
        self.loop(loops=2)
        assert self.control() == (TRUE, FALSE)

    def action(self, number: int = 1, name: str = "say", **slots: str) -> None:
        """Make a due action."""
        more = " ".join(f"({slot.replace('_', '-')} {value})" for slot, value in slots.items())
        self.env.assert_string(
            f"(plan-action (id {number}) (goal-id G) (plan-id P) (action-name {name})"
            f" (state PENDING) (executable TRUE) {more})"
        )

    def state(self, number: int = 1) -> Value:
        """Return the state of an action."""
        return self.bench.one("plan-action", id=str(number))["state"]

    def types(self) -> list[str]:
        """Return the types of the messages sent so far, without AcquireControl."""
        return [m.type for m in self.skiller.sent if m.type != "AcquireControlMessage"]


@pytest.fixture
def skills() -> Skills:
    """A skiller whose skills take one loop."""
    return Skills()


# --- control ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steal", [TRUE, FALSE])
def test_control_is_stolen_only_if_configured(skills: Skills, steal: Symbol) -> None:
    skills.bench.config(STEAL, steal)
    skills.acquire()
    assert skills.skiller.steals == (steal == TRUE)


def test_silent_refusal_of_control_repeats_request() -> None:
    skills = Skills(grants=False)
    skills.env.assert_string("(skiller-control)")
    skills.loop(seconds=1.0, loops=3)
    assert skills.control() == (FALSE, TRUE)
    assert len(skills.skiller.sent) == 1
    skills.skiller.grants = True
    skills.loop(seconds=1.1, loops=3)
    assert len(skills.skiller.sent) == 2
    assert skills.control() == (TRUE, FALSE)


@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("controller", [OTHER, ""])
@pytest.mark.parametrize(
    ("msgid", "status"),
    [(2, "S_FINAL"), (2, "S_RUNNING"), (2, "S_FAILED"), (2, "S_INACTIVE"), (77, "S_FINAL")],
)
def test_lost_control_fails_action(
    skills: Skills, loops: int, controller: str, msgid: int, status: str
) -> None:
    """Loop 1: the skill is sent; loop 2: the skill runs. The thief's skill may have any id."""
    skills.skiller.duration = 100
    skills.acquire()
    skills.action()
    skills.loop(loops=loops)
    before = "S_IDLE" if loops == 1 else "S_RUNNING"
    skills.write_status(
        exclusive_controller=controller, msgid=msgid, status=status, skill_string="thief's{}", error=""
    )
    lost = f"Lost exclusive control of Skiller to {controller or 'nobody'}"
    action = skills.bench.one("plan-action")
    assert (action["state"], action["error-msg"]) == ("EXECUTION-FAILED", lost)
    assert skills.control()[0] == FALSE
    assert skills.bench.texts("I")[-1] == "Lost exclusive skiller control"
    assert skills.bench.texts("W")[-2:] == [
        f"Skill say was {before}: {lost}, assuming failure",
        f"Execution of say FAILED ({lost})",
    ]
    assert not skills.bench.all("skill")
    assert not skills.bench.all("skill-action-execinfo")


@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize(
    ("status", "state"), [("S_FINAL", "EXECUTION-SUCCEEDED"), ("S_FAILED", "EXECUTION-FAILED")]
)
def test_final_status_counts_without_controller(skills: Skills, loops: int, status: str, state: str) -> None:
    """A Skiller that leaves shows how our call has ended, and no controller."""
    skills.skiller.duration = 100
    skills.acquire()
    skills.action()
    skills.loop(loops=loops)
    (ours,) = [slots["skill-string"] for slots in skills.bench.all("skill")]
    skills.write_status(
        exclusive_controller="", msgid=2, status=status, skill_string=ours, error="it is gone"
    )
    action = skills.bench.one("plan-action")
    assert (action["state"], skills.control()[0]) == (state, FALSE)
    if state == "EXECUTION-FAILED":
        assert action["error-msg"] == "it is gone"


@pytest.mark.parametrize("loops", [1, 2])
def test_foreign_control_fails_call_without_control(skills: Skills, loops: int) -> None:
    """Fails at once when the skill runs (2); before (1), the skiller may yet refuse the call."""
    skills.skiller.duration = 100
    skills.env.eval("(skill-call say (create$) (create$))")
    skills.loop(loops=loops)
    skills.write_status(exclusive_controller=OTHER, msgid=1, status="S_FINAL")
    assert skills.bench.one("skill")["status"] == ("S_IDLE" if loops == 1 else "S_FAILED")
    skills.loop(seconds=5.1)
    assert skills.bench.one("skill")["status"] == "S_FAILED"


def test_control_is_released_at_end(skills: Skills) -> None:
    skills.acquire()
    skills.env.assert_string("(executive-finalize)")
    skills.env.run()
    assert skills.types() == ["ReleaseControlMessage"]
    assert skills.control()[0] == FALSE
    assert not skills.bench.all("blackboard-interface")


# --- calls ------------------------------------------------------------------------------------------------


def test_call_without_mapping_fails(skills: Skills) -> None:
    identifier = skills.env.eval('(skill-call unmappable (create$) (create$) "Two")')
    skill = skills.bench.one("skill")
    assert str(identifier).startswith("unmappablegen")
    assert skill["id"] == identifier
    assert (skill["status"], skill["skiller"]) == ("S_FAILED", "Two")
    assert skill["error-msg"] == "Failed to convert action 'unmappable' to skill string"
    assert skills.skiller.sent == []


def test_calls_with_equal_message_ids_have_different_ids(skills: Skills) -> None:
    """Each reading instance counts its messages from 1: two calls with one id were mixed up."""
    first = skills.env.eval('(skill-call say (create$) (create$) "Two")')
    skills.skiller.sent.clear()
    second = skills.env.eval('(skill-call say (create$) (create$) "Three")')
    messages = {fact["msgid"] for fact in skills.bench.all("skill")}
    assert len(messages) == 1
    assert (first, second) == ("say-Two-1", "say-Three-1")


def test_merge_params(skills: Skills) -> None:
    assert skills.env.eval("(merge-params (create$ a b) (create$ 1 2))") == ("a", 1, "b", 2)
    assert skills.env.eval("(merge-params (create$) (create$))") == ()
    assert skills.env.eval("(merge-params (create$ a) (create$))") == FALSE
    assert len(skills.bench.texts("E")) == 1


def test_ignored_call_times_out(skills: Skills) -> None:
    skills.env.eval("(skill-call say (create$) (create$))")
    skills.bench.tick(5.0)
    assert skills.bench.one("skill")["status"] == "S_IDLE"
    skills.bench.tick(0.1)
    skill = skills.bench.one("skill")
    assert (skill["status"], skill["error-msg"]) == ("S_FAILED", "Start timeout")
    assert "Timeout starting skill say (5 sec): assuming failure" in skills.bench.texts("W")


# --- actions ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "obstacle",
    ["(executable FALSE)", "(state FORMULATED)", "(action-name not-mapped)", '(skiller "Nobody")'],
)
def test_action_waits_for_requirements(skills: Skills, obstacle: str) -> None:
    skills.acquire()
    skills.action()
    skills.bench.modify("plan-action", obstacle, id="1")
    skills.loop()
    assert skills.types() == []


def test_skiller_executes_one_action_at_a_time(skills: Skills) -> None:
    skills.acquire()
    skills.action(1)
    skills.action(2)
    skills.loop()
    assert sorted(str(skills.state(n)) for n in (1, 2)) == ["PENDING", "WAITING"]
    skills.loop(loops=6)
    assert [skills.state(n) for n in (1, 2)] == ["EXECUTION-SUCCEEDED"] * 2


@pytest.mark.parametrize("msgid", [0, 2])
def test_inactive_skiller_fails_running_action(skills: Skills, msgid: int) -> None:
    """With the id of another message, or of this call, whose skill has then ended, too."""
    skills.acquire()
    skills.action()
    skills.loop(loops=2)
    assert skills.state() == "RUNNING"
    skills.write_status(status="S_INACTIVE", msgid=msgid)
    action = skills.bench.one("plan-action")
    assert action["state"] == "EXECUTION-FAILED"
    assert action["error-msg"] == "SkillerInterface status inactive during running action"
    assert (
        "Execution of say on Skiller FAILED (SKillerInterface status inactive during running)"
        in skills.bench.texts("W")
    )
    assert not skills.bench.all("skill-action-execinfo")


@pytest.mark.parametrize("loops", [1, 2])
def test_retracted_action_is_cancelled(skills: Skills, loops: int) -> None:
    """Whether the skill was only sent (1) or is running (2)."""
    skills.skiller.duration = 100
    skills.acquire()
    skills.action()
    skills.loop(loops=loops)
    skills.env.eval("(do-for-all-facts ((?a plan-action)) TRUE (retract ?a))")
    skills.loop()
    assert skills.types() == ["ExecSkillMessage", "StopExecMessage"]
    assert "Cancelling Skill Execution, corresponding action does not exist" in skills.bench.texts("W")
    assert not skills.bench.all("skill-action-execinfo")
    skills.action(2)
    skills.loop()
    assert skills.state(2) == "WAITING"


def test_exectest_runs_skills_by_hand(skills: Skills) -> None:
    skills.env.call("path-add", f"{CORE_DIR}/cx/")
    skills.bench.load("cx/exectest-init.clp")
    skills.env.assert_string("(executive-init)")
    skills.env.assert_string("(ff-feature-loaded skills)")
    skills.loop()
    skills.env.assert_string("(start)")
    skills.loop(loops=12)
    assert [skills.state(n) for n in (1, 2)] == ["EXECUTION-SUCCEEDED"] * 2
    assert [values for _, _, values in skills.mapped] == [("Hello world", "true"), ("Good bye", "true")]
    lines = [text for text in skills.bench.texts("I") if text.startswith("Action 1 is now")]
    states = ["PENDING", "WAITING", "RUNNING", "EXECUTION-SUCCEEDED"]
    assert [text.split()[-1] for text in lines[-4:]] == states


def test_first_waiting_action_gets_skiller() -> None:
    """As in Fawkes: an action waits at the condition that its skiller executes nothing."""
    skills = Skills()
    skills.skiller.duration = 10
    skills.acquire()
    for number in range(4):
        skills.action(number, param_names="text", param_values=str(number))
        skills.loop()
    assert [values for _, _, values in skills.mapped] == [(0,)]
    skills.loop(loops=12)
    assert [values for _, _, values in skills.mapped] == [(0,), (1,)]
