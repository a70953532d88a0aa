"""CLIPS files that crash CLIPS, or loop for ever: the process survives, and reports the error."""

from __future__ import annotations

import threading

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus, LogLine
from cxbridge.executive.host import endless
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.source import find_exceeded_limit, prepare_core_source, prepare_source
from tests.support import share


class Bench:
    """An environment and its log."""

    def __init__(self, folder):
        bus = EventBus(VirtualClock())
        self.lines: list[str] = []
        bus.subscribe(self._note, LogLine)
        self.env = ClipsEnvironment("hostile", bus)
        self.file = folder / "agent.clp"

    def _note(self, event):
        self.lines.append(event.text)

    def load(self, text: str | bytes) -> bool:
        self.file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return self.env.load(self.file)


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.env.destroy()


RECURSIONS = {
    "itself": "(deffunction f (?x) (+ 1 (f (+ ?x 1))))",
    "itself, with a comment": '(deffunction f "calls (itself)" (?x) ; (no)\n (+ 1 (f ?x)))',
    "each other": "(deffunction f (?x)) (deffunction g (?x) (f ?x)) (deffunction f (?x) (g ?x))",
    "eval": '(deffunction f (?x) (eval "(f 1)"))',
    "funcall": "(deffunction f (?x) (funcall (sym-cat f) ?x))",
    "a method": "(defgeneric f) (defmethod f ((?x INTEGER)) (+ 1 (f ?x)))",
    "a method by its number": "(defmethod f (?x) (call-specific-method f 1 ?x))",
    "sort": "(deffunction f (?x $?y) (sort f 3 1 2))",
    "assert-string": '(deffunction f (?x) (assert-string "(x =(f 1))"))',
    "a handler": """(defclass A (is-a USER)) (defmessage-handler A go () (send ?self go))
        (deffunction f (?x) (send (make-instance of A) go))""",
    "instances": """(defclass A (is-a USER)) (defmessage-handler A init after () (make-instance of A))
        (deffunction f (?x) (make-instance of A))""",
    "a default": """(deffunction f (?x) (make-instance of ?x)) (deffunction made () (f A))
        (defclass A (is-a USER) (slot s (default-dynamic (made)))) (defrule q (b) => (f A))""",
    "a method behind a default": """(defgeneric made) (deftemplate t (slot s (default-dynamic (made))))
        (defmethod made () (assert (t))) (deffunction f (?x) (assert (t)))""",
}


RECURRING = share(RECURSIONS, 5)


@pytest.mark.parametrize("functions", [RECURSIONS[name] for name in RECURRING], ids=RECURRING)
def test_endless_recursion_ends_right_hand_side_only(bench, functions):
    assert bench.load(
        functions + "(deffacts d (a) (b)) (defrule r (a) => (f 1)) (defrule s (b) => (assert (done)))"
    )
    bench.env.assert_string("(a)")
    bench.env.assert_string("(b)")
    bench.env.run()
    assert next(bench.env.facts("done"), None) is not None
    assert [line for line in bench.lines if "calls itself endlessly" in line]
    assert len(bench.lines) < 5, "one message, not one a level"


def test_recursion_in_thread_with_small_stack(bench):
    bench.load("(deffunction f (?x) (+ 1 (f ?x))) (defrule r (a) => (f 1))")
    bench.env.assert_string("(a)")
    before = threading.stack_size(1024 * 1024)
    try:
        thread = threading.Thread(target=bench.env.run)
        thread.start()
        thread.join(20)
    finally:
        threading.stack_size(before)
    assert any("calls itself endlessly" in line for line in bench.lines)


def test_finite_recursion_is_allowed(bench):
    bench.load("(deffunction sum (?x) (if (= ?x 0) then 0 else (+ ?x (sum (- ?x 1)))))")
    assert bench.env.eval("(sum 3000)") == 3000 * 3001 // 2


def test_only_recursive_functions_are_guarded():
    text = "(deffunction f (?x) (+ ?x 1))\n(deffunction g () (f 1))\n(defrule g (g) => (f 1))"
    assert prepare_source(text).text == text
    assert prepare_core_source("(deffunction f () (f))").is_changed is False


@pytest.mark.parametrize(
    "function",
    [
        '(deffunction f "e.g. (f 1), (eval x)" (?x) (+ ?x 1))',
        '(deffunction f (?x) "e.g. (f 1) is 2" (+ ?x 1))',
        "(deffunction f (?x) ; (f 1) is 2\n (+ ?x 1))",
        '(deffunction f (?x) (str-cat "(f " ?x ")" "\\"(f 1)\\""))',
        '(defmethod f "(send [x] y)" ((?x INTEGER)) (+ ?x 1))',
    ],
)
def test_call_in_string_or_comment_is_no_call(function):
    assert prepare_source(function).text == function


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("\n(defrule r => (bind ?x " + "(+ 1 " * 200_000 + "1" + ")" * 200_000 + "))", 2, "nested"),
        ("(defrule r " + "(not " * 100_000 + "(a)" + ")" * 100_000 + " =>)", 1, "nested"),
        ("(" * 1_000_000, 1, "nested"),
        ("\n\n(deftemplate t " + " ".join(f"(slot s{i})" for i in range(70_000)) + ")", 3, "parts"),
        ('(deffacts d (a "' + "x" * 2_000_000 + '"))', 1, "string"),
        ('(deffacts d (a "' + "x " * 1_000_000 + '"))', 1, "string"),
        ('(deffacts d (a "' + "x " * 1_000_000, 1, "string"),
        ("(deffacts " + "x" * 1_000_000 + " (a))", 1, "word"),
        ('\n(defrule r => (format t "a%n %-999999d" 3))', 2, "field"),
        ('(defrule r => (format nil "%d %.400f" 3 1.5))', 1, "field"),
    ],
    ids=[
        "calls",
        "conditions",
        "open",
        "slots",
        "string",
        "string of words",
        "open string",
        "symbol",
        "wide",
        "precise",
    ],
)
def test_crashing_texts_do_not_reach_parser(bench, text, line, message):
    assert not bench.load(text)
    [diagnostic] = bench.env.loader.diagnostics
    assert (diagnostic.line, diagnostic.code) == (line, "LIMIT")
    assert message in diagnostic.message


def test_large_file_is_allowed(bench):
    nested = "(+ 1 " * 400 + "1" + ")" * 400
    facts = " ".join(f'(a {i} "{"x" * 20}")' for i in range(20_000))
    assert bench.load(f"(deffacts d {facts}) (defrule r => (bind ?x {nested})) ; {'-' * 1000}")
    assert find_exceeded_limit("(a" * 400) is None
    assert find_exceeded_limit('(format t "%-20s %5.3f 1000 %%500" 1 2)') is None


def test_endless_rules_are_named_in_fault(bench):
    bench.load("(defrule spin ?f <- (n ?x) => (retract ?f) (assert (n (+ ?x 1))))")
    bench.env.assert_string("(n 1)")
    assert bench.env.run() >= endless.ENDLESS_LIMITS[-1][0]
    [fault] = bench.env.faults
    assert "spin" in fault
    assert bench.env.run() == 0


@pytest.mark.parametrize(
    "text", [b"\0\0", b"\xff\xfe\0a", b"\xef\xbb\xbf(deffacts d (a))", b"(deffacts d (a))\r\n", b"\x1a", b""]
)
def test_files_of_any_bytes(bench, text):
    bench.load(text)
    assert bench.load("(deffacts e (b))")


CRASHING_TEXTS = {
    "calls": "(a " + "(+ 1 " * 200_000 + "1" + ")" * 200_000 + ")",
    "open": "(a " + "(" * 1_000_000,
    "wide": '(a (format nil "%-999999d" 3))',
    "symbol": "(a " + "x" * 1_000_000 + ")",
}
"""Texts that end the process if CLIPS parses them."""


@pytest.mark.parametrize("text", CRASHING_TEXTS.values(), ids=CRASHING_TEXTS)
def test_crashing_texts_of_clients_do_not_reach_parser(bench, text):
    """A fact that was asserted over HTTP ended the daemon."""
    with pytest.raises(ClipsError, match="CLIPS cannot read this text"):
        bench.env.eval(text)
    assert bench.env.eval("(+ 1 2)") == 3
