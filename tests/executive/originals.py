"""Fawkes' tests of the domain, read from a checkout and played: C++ statements and CLIPS commands.

Their files speak of ``domain-precondition`` and ``domain-atomic-precondition``. Fawkes has dropped these
templates for formulas since, and requires goals, plans and the parameters of operators, so that its tests
do not run there any more. :data:`OLD_WORDS` defines the two templates again: their facts become facts of the
present core, and results of the core become facts of the templates.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.host.values import TRUE, Symbol

CORE = "src/plugins/clips-executive/clips"
TESTS = f"{CORE}/tests"

OLD_WORDS = """
(deftemplate domain-precondition
  (slot name (default-dynamic (gensym*))) (slot part-of) (slot operator) (slot type (default conjunction))
  (slot grounded (default FALSE)) (slot is-satisfied (default FALSE)))
(deftemplate domain-atomic-precondition
  (slot name (default-dynamic (gensym*))) (slot part-of) (slot operator) (slot predicate)
  (slot equality (default FALSE)) (multislot param-names) (multislot param-values) (multislot param-constants)
  (slot grounded (default FALSE)) (slot is-satisfied (default FALSE)))

(defrule old-precondition
  (declare (salience 10000))
  ?old <- (domain-precondition (grounded FALSE) (name ?name) (part-of ?parent) (type ?type))
  =>
  (retract ?old)
  (assert (pddl-formula (id ?name) (part-of ?parent) (type ?type))))

(defrule old-atom
  (declare (salience 10000))
  ?old <- (domain-atomic-precondition (grounded FALSE) (name ?name) (part-of ?parent) (predicate ?predicate)
            (equality ?equality) (param-names $?names) (param-constants $?constants))
  =>
  (retract ?old)
  (assert (pddl-formula (id ?name) (part-of ?parent) (type atom))
          (pddl-predicate (id (sym-cat ?name -atom)) (part-of ?name)
            (predicate (if ?equality then EQUALITY else ?predicate))
            (param-names ?names) (param-constants ?constants))))

(defrule old-operator-parameters
  (declare (salience 9999))
  ?operator <- (domain-operator (name ?name) (param-names))
  (exists (domain-operator-parameter (operator ?name)))
  =>
  (bind ?names (create$))
  (do-for-all-facts ((?p domain-operator-parameter)) (eq ?p:operator ?name) (bind ?names ?names ?p:name))
  (modify ?operator (param-names ?names)))

(defrule old-operator
  (declare (salience 9999))
  (plan-action (action-name ?name) (param-names $?names))
  (exists (pddl-formula (part-of ?name)))
  (not (domain-operator (name ?name)))
  =>
  (assert (domain-operator (name ?name) (param-names ?names))))

(defrule old-goal
  (declare (salience 9999))
  (plan-action (goal-id ?goal) (plan-id ?plan))
  (not (plan (id ?plan) (goal-id ?goal)))
  =>
  (assert (goal (id ?goal) (mode DISPATCHED)) (plan (id ?plan) (goal-id ?goal))))

(deffunction look-through-old-eyes ()
  (delayed-do-for-all-facts ((?old domain-precondition)) ?old:grounded (retract ?old))
  (delayed-do-for-all-facts ((?old domain-atomic-precondition)) ?old:grounded (retract ?old))
  (do-for-all-facts ((?now grounded-pddl-formula)) TRUE
    (assert (domain-precondition (name ?now:formula-id) (grounded TRUE) (is-satisfied ?now:is-satisfied))))
  (do-for-all-facts
    ((?now grounded-pddl-predicate) (?of pddl-predicate) (?with pddl-grounding))
    (and (eq ?now:predicate-id ?of:id) (eq ?now:grounding ?with:id))
    (bind ?values (create$))
    (foreach ?name ?of:param-names
      (bind ?at (member$ ?name ?with:param-names))
      (bind ?values ?values
        (if ?at then (nth$ ?at ?with:param-values) else (nth$ ?name-index ?of:param-constants))))
    (assert (domain-atomic-precondition (name ?of:part-of) (predicate ?of:predicate) (grounded TRUE)
              (param-values ?values) (is-satisfied ?now:is-satisfied)))))
"""


def make_core(which: str, fawkes: Path, *files: str, bus: EventBus | None = None) -> ClipsEnvironment:
    """Return an environment with files of the core: of ``fawkes``, or the ``built-in`` one."""
    env = ClipsEnvironment("executive", bus or EventBus(VirtualClock()))
    if which == "fawkes":
        library, core = fawkes / "src/plugins/clips/clips", fawkes / CORE
    else:
        library, core = CORE_DIR / "host", CORE_DIR / "cx"
    for name in ("utils.clp", "ff-config.clp"):
        assert env.load(library / name)
    for name in ("saliences.clp", *files):
        assert env.load(core / name), env.loader.diagnostics
    return env


# --- test_domain.cpp --------------------------------------------------------------------------------------

_COMMENT = re.compile(r'//[^\n]*|/\*.*?\*/|("(?:[^"\\]|\\.)*")', re.DOTALL)
_FIXTURE = re.compile(r'class (\w+) : public DomainTest\b.*?push_back\("([^"]+)"\)', re.DOTALL)
_TEST = re.compile(r"TEST_F\((\w+), (\w+)\)\s*\{(.*?)\n\}", re.DOTALL)
_STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')


@dataclass(frozen=True)
class Original:
    """A test of test_domain.cpp.

    :param domain: name of the test's CLIPS file; None without.
    :param statements: each with its strings taken out, and these.
    """

    name: str
    domain: str | None
    statements: tuple[tuple[str, tuple[str, ...]], ...]


def read_originals(fawkes: Path) -> list[Original]:
    """Return the tests of test_domain.cpp."""
    text = _COMMENT.sub(lambda match: match[1] or "", (fawkes / TESTS / "test_domain.cpp").read_text())
    domains = dict(_FIXTURE.findall(text))
    return [
        Original(name.removeprefix("DISABLED_"), domains.get(fixture), tuple(_statements(body)))
        for fixture, name, body in _TEST.findall(text)
    ]


def _statements(body: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    joined = re.sub(r'"\s*"', "", body)  # C++ joins strings that follow each other
    strings = iter(_STRING.findall(joined))
    for statement in _STRING.sub('""', joined).split(";"):
        shape = "".join(statement.split())
        if shape:
            yield shape, tuple(next(strings) for _ in range(shape.count('""')))


class Player:
    """Plays all statements of an original, as GoogleTest would, also after a failed expectation."""

    def __init__(self, env: ClipsEnvironment) -> None:
        self.env = env
        self.surprises: list[str] = []

    def play(self, original: Original) -> list[str]:
        """Return the expectations that are not met."""
        for shape, strings in original.statements:
            self._play(shape, strings)
        return self.surprises

    def _play(self, shape: str, strings: tuple[str, ...]) -> None:
        if shape == "env.reset()":
            self.env.eval("(reset)")
        elif shape == "env.run()":
            self.env.run()
        elif shape == 'env.assert_fact("")':
            assert self.env.assert_string(strings[0]) is not None, strings[0]
        elif shape == 'env.evaluate("")':
            self.env.eval(strings[0])
        elif shape == 'EXPECT_EQ("",env.evaluate("")[0].as_string())':
            expected, call = strings
            self.env.run(self._untranslated())
            self._expect(str(self.env.eval(call)), expected, call)
        elif match := re.fullmatch(r"EXPECT_(TRUE|FALSE)\(has_(ordered_)?fact\([\"{},]*\)\)", shape):
            if match[2]:
                query = f"(any-factp ((?f {strings[0]})) (eq ?f:implied (create$ {' '.join(strings[1:])})))"
            else:
                query = f"(any-factp {strings[0]} {strings[1] if len(strings) > 1 else TRUE})"
            self.env.eval("(look-through-old-eyes)")
            self._expect(str(self.env.eval(query)), match[1], query)
        else:
            raise AssertionError(f"a statement that nobody can play: {shape}")

    def _expect(self, value: str, expected: str, expression: str) -> None:
        if value != expected:
            self.surprises.append(f"{' '.join(expression.split())} is {value}")

    def _untranslated(self) -> int:
        """Return the number of facts in the old words without a firing of a rule."""
        return sum(
            slots["grounded"] == Symbol("FALSE")
            for template in ("domain-precondition", "domain-atomic-precondition")
            for _, _, slots in self.env.facts(template)
        )


# --- wm-domain-sync*.clp ----------------------------------------------------------------------------------


def scenes(fawkes: Path, name: str) -> list[str]:
    """Return the parts of a file up to each ``(facts)``, without loading, watching and leaving."""
    text = re.sub(r"(?m)^\s*;.*$", "", (fawkes / TESTS / name).read_text())
    text = re.sub(r'(?m)^\((load\* "[^"]*"|watch \w+|exit)\)', "", text)
    *parts, rest = text.split("(facts)")
    assert not rest.strip(), rest
    return parts
