"""Planning with PDDL through the robot memory, in the built-in core.

The tables are those of the compatibility page on the behaviour of the CX core, sections 1.3, 8.5 and 9.
"""

from __future__ import annotations

from itertools import count

import pytest

from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.host.values import TRUE, ExternalAddress, Symbol, Value
from tests.executive.fake_robot_memory import Document, MemoryBench

PLANS = "robmem.pddl-plan"
_TEMPLATES = """
(deftemplate PddlGenInterface (slot id) (slot msg_id) (slot final))
(deftemplate PddlPlannerInterface (slot id) (slot msg_id) (slot final) (slot success))
(deftemplate executive-init-signal (slot id) (slot ok))
"""


class PlanningBench(MemoryBench):
    """A goal G that needs a plan. The test plays generator, planner and blackboard."""

    def __init__(self, *files: str) -> None:
        super().__init__("plan.clp", "goal.clp")
        for line in _TEMPLATES.strip().splitlines():
            self.env.build(line)
        self.info_requests = 0
        messages = count(41)
        for name, function, arity in (
            ("blackboard-open-reading", lambda _kind, _name: None, 2),
            ("blackboard-get-info", self._info, 0),
            ("blackboard-create-msg", lambda _interface, _kind: ExternalAddress(next(messages)), 2),
            ("blackboard-set-msg-field", lambda _message, _field, _value: TRUE, 3),
            ("blackboard-send-msg", lambda message: message.handle, 1),
        ):
            self.env.define(name, function, arity)
        self.load("cx/robot-memory.clp")
        for name in files:
            self.load(f"cx/{name}")

    def _info(self) -> None:
        self.info_requests += 1

    def interface(self, kind: str, msg_id: int, final: bool, success: bool | None = None) -> None:
        """Write the generator's or the planner's interface, and run."""
        self.env.eval(f"(do-for-all-facts ((?i {kind})) TRUE (retract ?i))")
        name = "pddl-gen" if kind == "PddlGenInterface" else "pddl-planner"
        outcome = "" if success is None else f"(success {str(success).upper()})"
        self.env.assert_string(
            f'({kind} (id "{name}") (msg_id {msg_id}) (final {str(final).upper()}) {outcome})'
        )
        self.env.run()

    def call(self) -> None:
        """Request a plan."""
        self.env.assert_string("(goal (id G) (class C) (mode SELECTED))")
        self.env.call("pddl-call", Symbol("G"), "(said PEGGY HELLO)")
        self.env.run()

    def finish(self, success: bool = True) -> None:
        """Go through all states up to the planner's end."""
        self.call()
        self.interface("PddlGenInterface", 41, True)
        self.interface("PddlPlannerInterface", 42, False, False)
        self.interface("PddlPlannerInterface", 42, True, success)


PLAN: Document = {
    "plan": 1,
    "msg_id": 42,
    "actions": [
        {"name": "say-hello", "args": ["peggy"]},
        {"name": "REACH-GOAL", "args": []},
        {"name": "say-goodbye", "args": ["peggy", "goodbye"]},
    ],
}


@pytest.fixture
def bench() -> PlanningBench:
    return PlanningBench("pddl.clp")


def _actions(bench: PlanningBench) -> list[tuple[Value, ...]]:
    rows = [(a["id"], a["action-name"], a["param-values"]) for a in bench.all("plan-action")]
    return sorted(rows, key=lambda row: int(str(row[0])))


EXPECTED = [
    (1, Symbol("say-hello"), (Symbol("PEGGY"),)),
    (3, Symbol("say-goodbye"), (Symbol("PEGGY"), Symbol("GOODBYE"))),
]


def test_plan_is_found_after_early_notification(bench: PlanningBench) -> None:
    """The original core waits for ever. Message ids of earlier runs are no excuse."""
    stale = {**PLAN, "_id": "1", "actions": [{"name": "old", "args": []}]}
    bench.memory.collections[PLANS] = {"1": stale, "2": {**PLAN, "_id": "2"}, "3": {"_id": "3", "plan": 0}}
    bench.memory.trigger("new-plan", {"fullDocument": PLAN})
    bench.finish()
    assert _actions(bench) == EXPECTED
    assert bench.state("G") == ("EXPANDED", "UNKNOWN")
    assert bench.memory.living() == 0


def test_failed_planning_fails_goal(bench: PlanningBench) -> None:
    bench.finish(success=False)
    assert bench.state("G") == ("FINISHED", "FAILED")
    assert (bench.goal("G")["error"], bench.goal("G")["message"]) == ((), "")
    assert bench.texts("E") == ["Planning failed for goal G"]
    assert bench.all("pddl-plan") == []


@pytest.mark.parametrize(
    "actions",
    [5, None, "say-hello", ["say-hello"], [{"name": "x"}], [{"args": []}], [{"name": 1, "args": []}], [[]]],
)
@pytest.mark.parametrize("by", ["event", "document"])
def test_invalid_plan_document_fails_goal(bench: PlanningBench, actions: object, by: str) -> None:
    document = {**PLAN, "_id": "1", "actions": actions}
    if by == "document":
        bench.memory.collections[PLANS] = {"1": document}
    bench.finish()
    if by == "event":
        bench.memory.trigger("new-plan", {"fullDocument": document})
        bench.env.run()
    assert bench.state("G") == ("FINISHED", "FAILED")
    assert (
        "The document for goal G is not a plan: no list of actions, or one lacks its name or its arguments"
        in bench.texts("E")
    )
    assert bench.all("plan") == bench.all("plan-action") == bench.all("pddl-plan") == []
    assert bench.memory.living() == 0


# --- start ------------------------------------------------------------------------------------------------


def test_start_polls_until_both_writers_exist() -> None:
    bench = PlanningBench("pddl-init.clp")
    bench.env.call("path-add", f"{CORE_DIR}/cx/")
    for fact in ("(executive-init)", "(ff-feature-loaded blackboard)", "(ff-feature-loaded robot_memory)"):
        bench.env.assert_string(fact)
    for seconds, requests in ((0.0, 2), (0.5, 2), (0.6, 4)):
        bench.tick(seconds)
        assert bench.info_requests == requests
    for name in ("pddl-gen", "pddl-planner"):
        assert bench.all("executive-init-signal") == []
        bench.env.assert_string(f'(blackboard-interface-info (id "{name}") (has-writer TRUE))')
        bench.tick(0.1)
    assert bench.one("executive-init-signal")["id"] == "pddl-planner-initialized"
    assert bench.env.eval("(member$ pddl-expand-goal (get-defrule-list))")


# --- facts as documents -----------------------------------------------------------------------------------

_NOTE = "(deftemplate note (slot a-long-name) (multislot some-values) (slot n))"


@pytest.fixture
def notes() -> PlanningBench:
    bench = PlanningBench()
    bench.env.build(_NOTE)
    bench.env.build("(defrule ordered (pose $?) =>)")
    return bench


@pytest.mark.parametrize(
    ("document", "template", "slots"),
    [
        (
            {"relation": "note", "n": 7, "some-values": ["x", "y"], "unknown": 1},
            "note",
            {"n": 7, "some-values": (Symbol("x"), Symbol("y")), "a-long-name": Symbol("nil")},
        ),
        ({"relation": "pose", "values": [1, "a b"]}, "pose", {"implied": (1, "a b")}),
    ],
)
def test_documents_become_facts(
    notes: PlanningBench, document: Document, template: str, slots: dict[str, Value]
) -> None:
    notes.env.call("rm-assert-from-bson", notes.memory.handle(document))
    assert notes.one(template) == slots


@pytest.mark.parametrize("event", [{"fullDocument": {"plan": 0}}, {"operationType": "delete"}])
def test_notification_without_plan_is_dropped(bench: PlanningBench, event: Document) -> None:
    bench.finish()
    bench.memory.trigger("new-plan", event)
    bench.env.run()
    assert bench.all("robmem-trigger") == []
    assert bench.memory.living() == 0
    assert bench.texts("W") == []
