"""Loading of files: broken constructs are reported with file and line, valid constructs are defined."""

from __future__ import annotations

from cxbridge.events import Level

BROKEN = """(deffunction fine () 1)

(defrule broken (foo) => (no-such-function 3))

(deffunction also-fine () 2)
"""


def test_broken_construct_is_reported_with_file_line_and_name(env, clp, log):
    path = clp(BROKEN)
    assert env.load(path) is False
    (diagnostic,) = env.loader.diagnostics
    assert (diagnostic.file, diagnostic.line, diagnostic.construct) == (str(path), 3, "defrule broken")
    assert "Missing function declaration for 'no-such-function'" in diagnostic.message
    assert log.texts(Level.ERROR) == [str(diagnostic)]


def test_loading_continues_behind_broken_construct(env, clp):
    env.load(clp(BROKEN))
    assert env.eval("(+ (fine) (also-fine))") == 3


def test_rewritten_modify_keeps_line_numbers(env, clp):
    rule = "(defrule m ?f <- (t) =>\n (modify ?f\n  (a 1)))"
    text = f"(deftemplate t (slot a))\n{rule}\n\n(defrule bad (t) => (nope))\n"
    path = clp(text)
    env.load(path)
    (diagnostic,) = env.loader.diagnostics
    assert (diagnostic.file, diagnostic.line) == (str(path), 6)


def test_missing_parenthesis_in_batch_file_is_found(env, clp, log):
    """Fawkes' skills.clp lacks a parenthesis, and Fawkes silently loses the rules behind the gap."""
    path = clp(
        "(deffunction before () 1)\n(defrule open\n (x)\n =>\n (assert (y))\n(deffunction lost () 2)\n"
    )
    assert env.batch(path) is True
    (diagnostic,) = env.loader.diagnostics
    assert (diagnostic.line, diagnostic.construct, diagnostic.code) == (2, "defrule open", "UNCLOSED")


def test_batch_executes_commands(env, clp):
    env.batch(clp("(deftemplate t (slot a))\n(assert (t (a 1)))\n(assert (t (a 2)))\n"))
    assert [values["a"] for _, _, values in env.facts("t")] == [1, 2]


def test_load_of_broken_construct_returns_false(env, clp):
    assert env.eval(f'(load "{clp(BROKEN)}")') == "FALSE"
    assert env.eval(f'(load "{clp("(deffunction f () 1)", "good.clp")}")') == "TRUE"


def test_nested_load_reports_errors_of_both_files(env, clp):
    inner = clp("(defrule inner-broken (x) => (nope))\n(deffunction inner () 1)", "inner.clp")
    outer = clp(f'(load "{inner}")\n(defrule outer-broken (x) => (nope2))\n', "outer.clp")
    env.batch(outer)
    assert [d.construct for d in env.loader.diagnostics] == ["defrule inner-broken", "defrule outer-broken"]


def test_forward_declarations_of_functions_are_silent(env, log, clp):
    env.loader.warn_redefinitions = True
    text = """
        (deffunction is-odd "whether it is" (?n))
        (deffunction is-even (?n) (if (= ?n 0) then TRUE else (is-odd (- ?n 1))))
        (deffunction is-odd (?n) (if (= ?n 0) then FALSE else (is-even (- ?n 1))))
    """
    assert env.load(clp(text))
    assert log.texts(Level.ERROR) == []
    assert env.eval("(is-odd 7)") == "TRUE"
    assert env.load(clp("(deffunction is-odd (?n) TRUE)"))
    assert log.texts(Level.ERROR) == ["Redefining deffunction: is-odd"]


def test_redefinitions_within_file_are_reported_once_each(env, log, clp):
    env.loader.warn_redefinitions = True
    text = """
        (deffunction f () 1) (deffunction f () 2) (deffunction MAIN::f () 3)
        (defrule r (a) =>) (defrule r (b) =>)
        (defglobal ?*x* = 1 ?*y* = 2) (defglobal ?*y* = 3)
        (deftemplate t (slot a)) (deftemplate t (slot a))
        (defclass C (is-a USER)) (defclass C (is-a USER))
        (deffacts ff-features-x (a)) (deffacts ff-features-x (b))
    """
    assert env.load(clp(text))
    assert log.texts(Level.ERROR) == [
        "Redefining deffunction: f",
        "Redefining deffunction: f",
        "Redefining defrule: r",
        "Redefining defglobal: y",
        "Redefining deftemplate: t",
        "Redefining defclass: C",
    ]


def test_agent_may_define_function_with_name_of_6_4(env, log, clp):
    assert env.load(clp("(deffunction early () (union$ (create$ a) (create$ b)))"))
    assert env.load(clp("(deffunction union$ (?x) ?x) (deffunction println (?a ?b) (+ ?a ?b))"))
    assert env.eval("(union$ mine)") == "mine"
    assert env.eval("(println 1 2)") == 3
    assert env.eval("(early)") == ("a", "b"), "who used the one of 6.4 goes on doing so"
    assert not log.texts(Level.ERROR)
