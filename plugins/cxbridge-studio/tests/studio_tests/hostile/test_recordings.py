"""A look at a hostile recording runs no code of the recording, and ends in time."""

from __future__ import annotations

import subprocess
import sys
from contextlib import suppress
from itertools import product
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, FactChange, GoalTransition, SourceRead
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from cxbridge_studio.explain.rules import sandbox
from tests.support import share

ENV = "executive"
BEGIN_US = 1_000_000_000

EVIL = {
    "system": '(test (system "touch MARKER"))',
    "open": '(test (open "MARKER" f "w"))',
    "in-a-function": "(test (innocent))",
    "in-a-function-of-a-function": "(test (deeper))",
    "in-a-global": "(test (neq ?*evil* 1))",
    "in-a-slot": '(robot (name ?n&:(system "touch MARKER")))',
    "as-a-value": '(robot (name =(system "touch MARKER")))',
    "in-a-not": '(not (robot (name ?n&:(open "MARKER" f "w"))))',
    "dribble": '(test (dribble-on "MARKER"))',
    "save": '(test (save "MARKER"))',
    "save-facts": '(test (save-facts "MARKER"))',
    "bsave": '(test (bsave "MARKER"))',
    "remove": '(test (remove "VICTIM"))',
    "rename": '(test (rename "VICTIM" "MARKER"))',
    "load": '(test (load "LOADED"))',
    "batch": '(test (batch* "LOADED"))',
    "eval": '(test (eval "(system \\"touch MARKER\\")"))',
    "build": '(test (build "(defrule x => (system \\"touch MARKER\\"))"))',
    "funcall": '(test (funcall system "touch MARKER"))',
    "sort": '(test (sort system "touch MARKER" "touch MARKER"))',
    "assert-string": '(test (assert-string "(x =(system \\"touch MARKER\\"))"))',
    "feature": '(test (pb-connect "127.0.0.1" 1))',
}
"""Conditions that leave a mark if all functions of CLIPS work."""

FUNCTIONS = """
(deffunction innocent () (system "touch MARKER") TRUE)
(deffunction deeper () (innocent))
(defglobal ?*evil* = (system "touch MARKER"))
(deftemplate robot (slot name) (slot at (default-dynamic (system "touch MARKER"))))
"""

HEAVY = {
    "for-ever": "(test (while TRUE do (bind ?x 1)))",
    "long": "(test (loop-for-count (?i 1 9000000000000000) do (bind ?x 1)))",
    "memory": "(test (grow))",
    "many-matches": " ".join("(number ? ?)" for _ in range(8)),
    "recursion": "(test (endless 1))",
    "deep": "(test " + "(not " * 2_000 + "TRUE" + ")" * 2_000 + ")",
}
REPORTS = {
    "for-ever": ("within 1 s",),
    "long": ("within 1 s",),
    "memory": ("too much memory", "within 25 s"),
    "many-matches": ("within 1 s", "too much memory"),
    "recursion": ("is nested too deeply", "calls itself"),
    "deep": ("nested more than 500 deep", "nested too deep"),
}
"""The reports about the heavy conditions."""
HEAVY_FUNCTIONS = """
(deffunction endless (?x) (+ 1 (endless ?x)))
(deffunction grow () (bind ?x "aaaaaaaa") (while TRUE do (bind ?x (str-cat ?x ?x))))
"""


def write_recording(path: Path, text: str, *facts: tuple[str, str]) -> Path:
    """Write a recording with events of no real run."""
    events: list[Event] = [
        SourceRead(BEGIN_US, "environment", ENV, ENV, None, {}),
        SourceRead(BEGIN_US, "clips", ENV, "/agent/evil.clp", text.encode(), {"how": "load"}),
        GoalTransition(BEGIN_US, ENV, "g1", "G", "nil", "nil", "FORMULATED", "UNKNOWN", ""),
        *(
            FactChange(BEGIN_US + index, ENV, True, index, template, fact)
            for index, (template, fact) in enumerate(facts, 1)
        ),
    ]
    with McapWriter(path) as writer:
        for event in events:
            writer.write(event)
    return path


def make_rules(conditions: dict[str, str]) -> str:
    return "\n".join(f"(defrule {name} {condition} =>)" for name, condition in conditions.items())


@pytest.fixture
def trap_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a file to remove and a file to load."""
    home = tmp_path / "home"
    home.mkdir()
    (home / "VICTIM").write_text("still there")
    (home / "LOADED").write_text('(system "touch MARKER")\n(defglobal ?*x* = (system "touch MARKER"))')
    monkeypatch.chdir(home)
    return home


def is_unharmed(home: Path) -> bool:
    return sorted(file.name for file in home.iterdir()) == ["LOADED", "VICTIM"] and (
        (home / "VICTIM").read_text() == "still there"
    )


@pytest.mark.parametrize("rule", share([*EVIL], 5))
def test_conditions_of_recording_do_not_run(trap_folder, tmp_path, capsys, rule):
    facts = [("robot", "(robot (name a))")]
    run = write_recording(tmp_path / "run.mcap", FUNCTIONS + make_rules(EVIL), *facts)
    assert invoke(["why", "rule", rule, "--run", str(run)]) == 0
    # sort takes the function by name
    assert ("cannot be matched" in capsys.readouterr().out) == (rule != "sort")
    assert is_unharmed(trap_folder)


@pytest.mark.parametrize("rule", share(HEAVY, 3))
def test_heavy_condition_of_recording_is_ended(tmp_path, monkeypatch, rule):
    monkeypatch.setattr(sandbox, "MAX_MEMORY_BYTES", sandbox.MAX_MEMORY_BYTES // 4)
    if "within 1 s" in REPORTS[rule]:
        monkeypatch.setattr(sandbox, "LIMIT_S", 1.0)
    facts = [("number", f"(number {index} x)") for index in range(200)]
    run = write_recording(tmp_path / "run.mcap", HEAVY_FUNCTIONS + make_rules(HEAVY), *facts)
    text = "\n".join(explain(RecordedEvidence(open_run(run), None, None), rule, "rule").lines)
    assert any(word in text for word in REPORTS[rule]), text[:2000]


NAMES = [
    'x)) (defrule a => (system "touch MARKER"',
    'x =(system "touch MARKER")',
    'x (default-dynamic (system "touch MARKER"))',
    "?x",
    "",
    "x\0y",
    '"',
    "(",
    ")",
    "x y",
    "MAIN::x",
    "x;",
    "x" * 200_000,
]


PLACES = ("template", "slot", "value", "rule", "function")
NUMBERS = share(product(PLACES, range(len(NAMES))), 8, row=lambda case: case[1])


@pytest.mark.parametrize(("place", "number"), NUMBERS)
def test_names_of_recording_are_no_code(trap_folder, tmp_path, place, number):
    """Names and values of a recording become parts of CLIPS text."""
    name = NAMES[number]
    query = "(test (any-factp ((?f x)) TRUE))"
    rule = f"(defrule r (x ?) {query} =>)"
    fact = ("x", "(x 2)")
    text, fact = {
        "template": (rule, (name, f"({name} 1)")),
        "slot": (f"(deftemplate y (slot {name})){rule}", ("y", f"(y ({name} 1))")),
        "value": (rule, ("x", f"(x {name})")),
        "rule": (f"(defrule r (x {name}) {query} =>)", fact),
        "function": (
            f"(deffunction f (?x) {name})(deftemplate x (multislot y))(defrule r (x ?) (test (f 1)) =>)",
            fact,
        ),
    }[place]
    run = write_recording(tmp_path / "run.mcap", text, ("x", "(x 1)"), fact)
    with suppress(CxbridgeError):
        explain(RecordedEvidence(open_run(run), None, None), "r", "rule")
    assert is_unharmed(trap_folder)


def test_process_of_look_has_no_unneeded_rights(tmp_path):
    """A second defence, against a break-in into CLIPS."""
    program = f"""
import os
from cxbridge_studio.explain.rules.sandbox import MAX_MEMORY_BYTES
from cxbridge_studio.explain.rules.sandbox_process import _drop_rights
_drop_rights(MAX_MEMORY_BYTES)
def attempt(act):
    try:
        act()
    except (OSError, MemoryError):
        return "refused"
    return "allowed"
print(attempt(lambda: open({str(tmp_path / "x")!r}, "w")), attempt(lambda: bytearray(4 << 30)),
      attempt(lambda: __import__("socket").socket()), attempt(os.fork) if os.getuid() else "refused")
"""
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert process.stdout.split() == ["refused"] * 4, process.stderr


def test_crash_of_look_is_reported(monkeypatch, tmp_path):
    run = write_recording(tmp_path / "run.mcap", "(defrule r (x) =>)", ("x", "(x)"))
    lines = explain(RecordedEvidence(open_run(run), None, None), "r", "rule").lines
    assert any("(x)" in line for line in lines)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    lines = explain(RecordedEvidence(open_run(run), None, None), "r", "rule").lines
    assert any("matching its condition" in line for line in lines), lines
