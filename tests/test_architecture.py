"""The dependencies point one way, and start-up stays cheap."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import ROOT

PACKAGE = ROOT / "cxbridge"
GROUND = {"errors", "clock", "events", "mainloop", "config", "resources", "transitions"}
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
    },
}
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
