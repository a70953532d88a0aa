"""A stranger's recording is data: none of its code runs, and it does not hold up its reader."""

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
"""Conditions that would leave a trace, were they run with all that CLIPS has."""

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
TOLD = {
    "for-ever": ("within 1 s",),
    "long": ("within 1 s",),
    "memory": ("too much memory", "within 25 s"),
    "many-matches": ("within 1 s", "too much memory"),
    "recursion": ("is nested too deeply", "calls itself"),
    "deep": ("nested more than 500 deep", "nested too deep"),
}
"""The reports about them."""
HEAVY_FUNCTIONS = """
(deffunction endless (?x) (+ 1 (endless ?x)))
(deffunction grow () (bind ?x "aaaaaaaa") (while TRUE do (bind ?x (str-cat ?x ?x))))
"""


def record(path: Path, text: str, *facts: tuple[str, str]) -> Path:
    """Record events that no run makes, with our own recorder."""
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


def rules_of(conditions: dict[str, str]) -> str:
    return "\n".join(f"(defrule {name} {condition} =>)" for name, condition in conditions.items())


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a file to lose and one to load, where a program would write its marker."""
    home = tmp_path / "home"
    home.mkdir()
    (home / "VICTIM").write_text("still there")
    (home / "LOADED").write_text('(system "touch MARKER")\n(defglobal ?*x* = (system "touch MARKER"))')
    monkeypatch.chdir(home)
    return home


def unharmed(home: Path) -> bool:
    return sorted(file.name for file in home.iterdir()) == ["LOADED", "VICTIM"] and (
        (home / "VICTIM").read_text() == "still there"
    )


@pytest.mark.parametrize("rule", share([*EVIL], 5))
def test_nothing_of_a_recording_runs(scene, tmp_path, capsys, rule):
    facts = [("robot", "(robot (name a))")]
    run = record(tmp_path / "run.mcap", FUNCTIONS + rules_of(EVIL), *facts)
    assert invoke(["why", "rule", rule, "--run", str(run)]) == 0
    assert ("cannot be matched" in capsys.readouterr().out) == (rule != "sort")  # it calls by a name
    assert unharmed(scene)


@pytest.mark.parametrize("rule", share(HEAVY, 3))
def test_a_recording_does_not_hold_up_who_looks(tmp_path, monkeypatch, rule):
    monkeypatch.setattr(sandbox, "MAX_MEMORY_BYTES", sandbox.MAX_MEMORY_BYTES // 4)
    if "within 1 s" in TOLD[rule]:
        monkeypatch.setattr(sandbox, "LIMIT_S", 1.0)
    facts = [("number", f"(number {index} x)") for index in range(200)]
    run = record(tmp_path / "run.mcap", HEAVY_FUNCTIONS + rules_of(HEAVY), *facts)
    text = "\n".join(explain(RecordedEvidence(open_run(run), None, None), rule, "rule").lines)
    assert any(word in text for word in TOLD[rule]), text[:2000]


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


WHERE = ("template", "slot", "value", "rule", "function")
NUMBERS = share(product(WHERE, range(len(NAMES))), 8, row=lambda case: case[1])


@pytest.mark.parametrize(("where", "number"), NUMBERS)
def test_names_of_a_recording_are_no_code(scene, tmp_path, where, number):
    """CLIPS text that is made from names and values of a recording."""
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
    }[where]
    run = record(tmp_path / "run.mcap", text, ("x", "(x 1)"), fact)
    with suppress(CxbridgeError):
        explain(RecordedEvidence(open_run(run), None, None), "r", "rule")
    assert unharmed(scene)


def test_a_look_has_no_rights_that_it_does_not_need(tmp_path):
    """The rights of the process of a look if CLIPS itself were broken into: not even this."""
    program = f"""
import os
from cxbridge_studio.explain.rules.sandbox import MAX_MEMORY_BYTES
from cxbridge_studio.explain.rules.sandbox_process import _drop_rights
_drop_rights(MAX_MEMORY_BYTES)
def tries(act):
    try:
        act()
    except (OSError, MemoryError):
        return "refused"
    return "done"
print(tries(lambda: open({str(tmp_path / "x")!r}, "w")), tries(lambda: bytearray(4 << 30)),
      tries(lambda: __import__("socket").socket()), tries(os.fork) if os.getuid() else "refused")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["refused"] * 4, done.stderr


def test_a_look_that_crashes_is_told(monkeypatch, tmp_path):
    run = record(tmp_path / "run.mcap", "(defrule r (x) =>)", ("x", "(x)"))
    lines = explain(RecordedEvidence(open_run(run), None, None), "r", "rule").lines
    assert any("(x)" in line for line in lines)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    lines = explain(RecordedEvidence(open_run(run), None, None), "r", "rule").lines
    assert any("matching its condition" in line for line in lines), lines
