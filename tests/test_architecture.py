"""The dependencies point one way, and start-up stays cheap."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import ROOT

PACKAGE = ROOT / "cxbridge"
GROUND = {
    "errors",
    "clock",
    "events",
    "mainloop",
    "config",
    "resources",
    "transitions",
    "goaltree",
    "printing",
    "rights",
    "clipstext",
}
ALLOWED = {
    "interfaces": GROUND,
    "blackboard": GROUND | {"interfaces"},
    "executive": GROUND | {"interfaces", "blackboard", "tf", "navgraph"},
    "tf": GROUND | {"interfaces", "blackboard"},
    "navgraph": GROUND,
    "skiller": GROUND | {"interfaces", "blackboard", "tf", "navgraph"},
    "trace": GROUND | {"interfaces", "blackboard"},
    "explain": GROUND | {"interfaces", "blackboard", "executive", "trace"},
    "gateway": GROUND | {"interfaces", "blackboard"},
    "ros2cx": GROUND | {"interfaces", "blackboard", "executive", "skiller"},
    "web": GROUND | {"interfaces", "blackboard", "executive", "trace", "explain", "tf"},
    "app": GROUND
    | {
        "interfaces",
        "blackboard",
        "executive",
        "skiller",
        "trace",
        "explain",
        "gateway",
        "tf",
        "navgraph",
        "web",
        "ros2cx",
    },
    "cli": GROUND
    | {
        "interfaces",
        "blackboard",
        "executive",
        "skiller",
        "trace",
        "explain",
        "gateway",
        "app",
        "tf",
        "navgraph",
        "web",
        "monitor",
    },
}
ALLOWED["monitor"] = ALLOWED["cli"] - {"monitor"}
ALLOWED["testing"] = ALLOWED["cli"]
ALLOWED["pytest_plugin"] = {"app", "testing"}
ALLOWED |= dict.fromkeys(GROUND, GROUND)


def imports(path: Path) -> set[str]:
    """The parts of cxbridge that a file imports, for types or at run time."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
        elif isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
    return {name.split(".")[1] for name in names if name.startswith("cxbridge.")}


@pytest.mark.parametrize(
    "path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: str(path.relative_to(PACKAGE))
)
def test_dependencies_point_one_way(path):
    part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    if part in ALLOWED:
        assert imports(path) - {part} <= ALLOWED[part]


def test_the_command_line_imports_nothing_heavy():
    program = "import sys, cxbridge.cli.main; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    heavy = {
        "rich",
        "clips",
        "lupa",
        "lark",
        "mcap",
        "zmq",
        "yaml",
        "pyttsx3",
        "hypothesis",
        "starlette",
        "uvicorn",
    }
    assert heavy & set(done.stdout.split()) == set()


# -- the tests themselves

SLOW_ON_PURPOSE = {
    "executive/robmem/mongo_server.py",  # a server that answers late
    "hostile/test_descriptors.py",  # what a process uses while it is attacked
    "trace/test_recorder.py",  # a writer that takes its time
}


def sleeps(node: ast.AST, looping: bool = False) -> list[int]:
    """The lines of a file where a test sleeps, and not in a loop that looks for what it waits for."""
    found = []
    if isinstance(node, ast.Call) and not looping:
        called = ast.unparse(node.func)
        if called in {"sleep", "time.sleep", "asyncio.sleep"} or (
            called.endswith("Event().wait") and node.args
        ):
            found.append(node.lineno)
    inside = (looping or isinstance(node, ast.For | ast.While)) and not isinstance(
        node, ast.FunctionDef | ast.Lambda
    )
    for child in ast.iter_child_nodes(node):
        found += sleeps(child, inside)
    return found


def test_no_test_sleeps_and_hopes():
    """What a test waits for is looked for until it is there: how long it takes depends on the machine."""
    tests = ROOT / "tests"
    hopeful = {
        str(path.relative_to(tests)): lines
        for path in sorted(tests.rglob("*.py"))
        if (lines := sleeps(ast.parse(path.read_text())))
    }
    assert {name: lines for name, lines in hopeful.items() if name not in SLOW_ON_PURPOSE} == {}
    assert set(hopeful) == SLOW_ON_PURPOSE
