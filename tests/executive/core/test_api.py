"""The built-in core has the interface of the original, name by name.

The interface is compat/cx-core-api.json of the shared facts. Everything is loaded into one environment, in
the order in which a scenario with all of it would.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from clips._clips import ffi, lib

from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.host.values import TRUE, Symbol, Value
from tests.executive.fake_robot_memory import MemoryBench
from tests.support import SHARED, needs_shared

pytestmark = needs_shared

Description = dict[str, Any]

_INTERFACES = """
(deftemplate SkillerInterface (slot id) (slot status) (slot error) (slot msgid) (slot exclusive_controller)
  (slot skill_string))
(deftemplate PddlGenInterface (slot id) (slot msg_id) (slot final))
(deftemplate PddlPlannerInterface (slot id) (slot msg_id) (slot final) (slot success) (slot active_planner))
(deftemplate MongoDBManagedReplicaSetInterface (slot id) (slot member_status) (slot primary_status)
  (slot error_msg))
"""
_ORDER = [
    "saliences",
    "init",
    "blackboard-init",
    "robmem-wait-init",
    "robot-memory",
    "plan",
    "goal",
    "domain",
    "domain-index",
    "domain-grounding",
    "domain-effects",
    "domain-exogenous",
    "worldmodel",
    "cx-identity",
    "wm-domain-sync",
    "wm-domain-sync-facts",
    "wm-domain-sync-objects",
    "wm-config",
    "skills",
    "skills-calls",
    "goal-tree",
    "skills-actions",
    "goals/*",
    "action-selection/*",
    "execmon/*",
    "wm-template-facts",
    "coordination-mutex",
    "lock-actions",
    "resource-locks",
    "wm-robmem-sync",
    "robot-memory-sync",
    "pddl-init",
    "pddl",
    "exectest-init",
    "exectest",
]

_OURS = {"skill-board-actions.clp"}
"""No part of the original; tested in tests/executive/features/test_skill_board.py."""


def _files() -> list[str]:
    cx = CORE_DIR / "cx"
    found = [path.relative_to(cx).as_posix() for name in _ORDER for path in sorted(cx.glob(f"{name}.clp"))]
    rest = {path.relative_to(cx).as_posix() for path in cx.rglob("*.clp")} - set(found)
    assert rest == _OURS, "files of the core that nobody loads"
    return found


class WholeCore(MemoryBench):
    """All files of the core, with functions of features that do nothing."""

    def __init__(self) -> None:
        super().__init__()
        for template in _INTERFACES.strip().split("\n(deftemplate "):
            self.env.build(template if template.startswith("(") else f"(deftemplate {template}")
        self.env.build("(defrule blackboard-read (time $?) =>)")
        nothing: dict[str, Value] = {
            "blackboard-send-msg": 1,
            "map-action-skill": "",
            "blackboard-get-info": None,
        }
        for function in [
            "blackboard-open-reading",
            "blackboard-close",
            "blackboard-create-msg",
            "blackboard-set-msg-field",
            "blackboard-enable-time-read",
            "blackboard-get-info",
            "blackboard-send-msg",
            "blackboard-preload",
            "config-load",
            "ff-feature-request",
            "map-action-skill",
            "parse-pddl-domain",
        ]:
            self.env.define(function, self._returns(nothing.get(function, TRUE)), 0, 9)
        for name in _files():
            self.load(f"cx/{name}")

    @staticmethod
    def _returns(value: Value) -> Callable[..., Value]:
        return lambda *_: value


@pytest.fixture(scope="module")
def core() -> WholeCore:
    return WholeCore()


@cache
def _api() -> Description:
    api: Description = json.loads((SHARED / "compat/cx-core-api.json").read_text())
    return api


def _all(kind: str) -> list[Any]:
    if not SHARED.is_dir():
        return []
    return [
        pytest.param(row, id=f"{file}:{row['name']}")
        for file, content in _api()["files"].items()
        for row in content.get(kind, [])
    ]


def test_core_loads_without_messages(core: WholeCore) -> None:
    assert core.env.loader.diagnostics == []
    assert [line for line in core.lines if line.level.value in "EW"] == []


def _facet(core: WholeCore, facet: str, template: str, slot: str) -> Value:
    return core.env.eval(f"(deftemplate-slot-{facet} {template} {slot})")


OURS = {"plan-action": {"agent-id"}}
"""Our slots: the executor of an action on the skill board, as in the core of the thesis."""


@pytest.mark.parametrize("row", _all("deftemplates"))
def test_deftemplate(core: WholeCore, row: Description) -> None:
    template = row["name"]
    slots = set(core.env.eval(f"(deftemplate-slot-names {template})")) - OURS.get(template, set())
    assert slots == {s["name"] for s in row["slots"]}
    for slot in row["slots"]:
        name = slot["name"]
        assert _facet(core, "multip", template, name) == str(slot["multislot"]).upper(), name
        types = _facet(core, "types", template, name)
        assert isinstance(types, tuple)
        assert "type" not in slot or types == (slot["type"],), name
        assert "type" in slot or len(types) > 1, name
        allowed = _facet(core, "allowed-values", template, name)
        assert "allowed-values" not in slot or set(allowed) == set(slot["allowed-values"]), name
        assert "allowed-values" in slot or allowed == Symbol("FALSE"), name
        if "cardinality" in slot:
            bounds = tuple(int(bound) for bound in slot["cardinality"])
            assert _facet(core, "cardinality", template, name) == bounds, name
        _check_default(core, template, slot)


def _check_default(core: WholeCore, template: str, slot: Description) -> None:
    name = slot["name"]
    if "default-dynamic" in slot:
        assert _facet(core, "defaultp", template, name) == "dynamic"
        return
    if slot.get("default") == "?NONE":
        assert _facet(core, "defaultp", template, name) == "FALSE", name
        return
    text = slot.get("default", slot.get("implicit-default"))
    value = _facet(core, "default-value", template, name)
    if text in ("derived", "null address"):  # CLIPS derives the default from type and cardinality
        assert text != "derived" or value == (0, 0)
        return
    wanted = core.env.eval("(create$)" if text == "()" else f"(create$ {text})")
    assert isinstance(wanted, tuple)
    assert value == (wanted if slot["multislot"] else wanted[0]), name


def _signature(core: WholeCore, function: str) -> tuple[int, str | None] | None:
    """Return the number of parameters and the wildcard of a deffunction; None for an unknown one."""
    pointer = lib.FindDeffunction(core.env.c_env, function.encode())
    if pointer == ffi.NULL:
        return None
    text = ffi.string(lib.DeffunctionPPForm(pointer)).decode()
    text = re.sub(r'"(?:\\.|[^"\\])*"', "", text)
    params = re.search(r"^\(deffunction\s+\S+\s*\(([^)]*)\)", text)
    assert params is not None, text
    names = params[1].split()
    wildcard = names.pop() if names and names[-1].startswith("$?") else None
    return len(names), wildcard


@pytest.mark.parametrize("row", _all("deffunctions"))
def test_deffunction(core: WholeCore, row: Description) -> None:
    signature = _signature(core, row["name"])
    assert signature is not None, "there is no such deffunction"
    assert signature[0] == len(row["params"])
    assert (signature[1] is None) == (row["wildcard"] is None)


@pytest.mark.parametrize("row", _all("defglobals"))
def test_defglobal(core: WholeCore, row: Description) -> None:
    assert core.env.eval(row["name"]) == core.env.eval(row["value"])


def test_saliences(core: WholeCore) -> None:
    for name, value in _api()["salience_table"].items():
        assert core.env.eval(name) == value


def test_core_of_scenario_idles_without_errors(core: WholeCore) -> None:
    core.tick(1.0)
    core.tick(1.0)
    assert [line.text for line in core.lines if line.level.value == "E"] == []
