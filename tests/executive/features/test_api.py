"""The functions, templates and rules of Fawkes' CLIPS features exist, with their arguments."""

from __future__ import annotations

import json

import pytest

from cxbridge.errors import ClipsError
from tests.executive.features.conftest import HAS_MOTOR_SWITCH, HAS_PROTOBUF, HAS_ROBOT_MEMORY
from tests.support import SHARED, needs_shared

OURS = {
    "blackboard",
    "config",
    "redefine-warning",
    "pddl-parser",
    "tf",
    "navgraph",
    *(["protobuf"] if HAS_PROTOBUF else ()),
    *(["motor-switch"] if HAS_MOTOR_SWITCH else ()),
    *(["robot_memory"] if HAS_ROBOT_MEMORY else ()),
}
VARIADIC = {"append$", "path-add"}


def load():
    path = SHARED / "compat" / "clips-functions.json"
    return json.loads(path.read_text())["features"] if path.is_file() else []


def functions():
    for feature in load():
        here = feature["feature"] in OURS or feature["source"].endswith(("clips_env_manager.cpp",))
        if here:
            for function in feature["functions"]:
                types = [argument["type"] for argument in function["args"]]
                yield pytest.param(function["name"], types, id=function["name"])


def library():
    core = next((feature for feature in load() if feature.get("clips_library", {}).get("globals")), None)
    return (
        core["clips_library"] if core else {"globals": {}, "templates": [], "deffunctions": [], "rules": []}
    )


@pytest.fixture
def full(env, manager):
    for feature in OURS - {"blackboard", "config"}:
        manager.request("executive", feature)
    return env


def accepts(env, name, count):
    """Whether CLIPS parses a call with that many arguments."""
    arguments = " ".join(["(create$)"] * count)
    try:
        env.build(f"(deffunction probe ($?x) ({name} {arguments}))")
    except ClipsError:
        return False
    return True


@needs_shared
@pytest.mark.parametrize(("name", "types"), list(functions()))
def test_functions_take_exactly_their_arguments(full, name, types):
    count = len(types)
    arguments = ["?x" if kind.startswith("MULTIFIELD") else "(nth$ 1 ?x)" for kind in types]
    full.build(f"(deffunction probe ($?x) ({name} {' '.join(arguments)}))")
    assert not accepts(full, name, count + 1)
    if count:
        assert not accepts(full, name, count - 1)


@needs_shared
@pytest.mark.parametrize("function", library()["deffunctions"], ids=lambda function: function["name"])
def test_deffunctions_of_library(env, function):
    count = len([argument for argument in function["args"] if not argument.startswith("$")])
    assert accepts(env, function["name"], count)
    assert accepts(env, function["name"], count + 1) == (function["name"] in VARIADIC)


@needs_shared
def test_globals_templates_and_rules_of_library(env):
    known = library()
    for name in known["globals"]:
        assert name.strip("?*") in env.eval("(get-defglobal-list)")
    assert env.eval("?*DEBUG*") == 2
    assert env.eval("?*PRIORITY-TIME-RETRACT*") == -10000
    for template in known["templates"]:
        assert set(env.eval(f"(deftemplate-slot-names {template['name']})")) == set(template["slots"])
    assert "time-retract" in env.eval("(get-defrule-list)")


@needs_shared
@pytest.mark.parametrize(
    ("feature", "template"),
    [
        ("config", "confval"),
        ("blackboard", "blackboard-interface"),
        ("blackboard", "blackboard-interface-info"),
        *([("protobuf", "protobuf-msg")] if HAS_PROTOBUF else ()),
        ("navgraph", "navgraph"),
        ("navgraph", "navgraph-node"),
        ("navgraph", "navgraph-edge"),
    ],
)
def test_templates_of_features(full, feature, template):
    (row,) = [row for row in load() if row["feature"] == feature]
    (fact,) = [fact for fact in row["facts"] if fact["template"] == template]
    assert list(full.eval(f"(deftemplate-slot-names {template})")) == list(fact["slots"])
