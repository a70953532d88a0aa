"""The command `cxbridge plan`."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.main import invoke

DOMAIN = """(define (domain d) (:requirements :strips) (:predicates (at ?p) (link ?a ?b))
  (:action go :parameters (?a ?b)
    :precondition (and (at ?a) (link ?a ?b)) :effect (and (at ?b) (not (at ?a)))))
"""
PROBLEM = """(define (problem p) (:domain d) (:objects a b c)
  (:init (at a) (link a b) (link b c)) (:goal (at c)))
"""


@pytest.fixture
def write_files(tmp_path):
    def write(domain=DOMAIN, problem=PROBLEM):
        paths = [tmp_path / "domain.pddl", tmp_path / "problem.pddl"]
        for path, text in zip(paths, (domain, problem), strict=True):
            path.write_text(text)
        return [str(path) for path in paths]

    return write


def test_plan_has_line_for_each_step(write_files, capsys):
    assert invoke(["plan", *write_files()]) == 0
    assert capsys.readouterr().out == "(go a b)\n(go b c)\n"


def test_plan_is_printed_as_json(write_files, capsys):
    assert (
        invoke(["plan", *write_files(), "--json", "--planner", "pyperplan", "--option", "search=astar"]) == 0
    )
    result = json.loads(capsys.readouterr().out)
    assert (result["status"], result["planner"]) == ("PLANNED", "pyperplan")
    assert result["actions"][0] == {"name": "go", "arguments": ["a", "b"], "start": None, "duration": None}


def test_plan_is_written_to_file(write_files, tmp_path, capsys):
    assert invoke(["plan", *write_files(), "-o", str(tmp_path / "plan")]) == 0
    assert (tmp_path / "plan").read_text() == "(go a b)\n(go b c)\n"
    assert capsys.readouterr().out == ""


def test_unsolvable_problem_exits_with_1(write_files, capsys):
    assert invoke(["plan", *write_files(problem=PROBLEM.replace("(at c)", "(link c a)"))]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "says that there is no plan" in err


def test_timeout_exits_with_3(write_files, capsys):
    assert invoke(["plan", *write_files(), "--timeout", "0.001"]) == 3
    assert "no plan within 0.001 s" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--planner", "gps"], "there is no planner 'gps'"),
        (["--option", "search"], "not an option of a planner"),
        (["--option", "search=x", "--planner", "pyperplan"], "pyperplan has no search 'x'"),
        (["--planner", "popf"], "not installed"),
        (["--timeout", "-1"], "timeout"),
    ],
)
def test_invalid_options_exit_with_2(write_files, capsys, monkeypatch, tmp_path, arguments, message):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert invoke(["plan", *write_files(), *arguments]) == 2
    assert message in capsys.readouterr().err


def test_invalid_files_exit_with_2(write_files, capsys):
    domain, problem = write_files(problem=PROBLEM.replace("(at a)", "(on a)"))
    assert invoke(["plan", domain, problem]) == 2
    assert f"{problem}:2:" in capsys.readouterr().err
    assert invoke(["plan", domain]) == 2
    assert invoke(["plan", domain, f"{problem}x"]) == 2


def test_unsupported_problem_exits_with_2(write_files, capsys):
    domain = DOMAIN.replace("(:predicates", "(:functions (n)) (:predicates").replace(
        "(and (at ?a)", "(and (< (n) 3) (at ?a)"
    )
    assert invoke(["plan", *write_files(domain=domain), "--planner", "pyperplan"]) == 2
    assert "pyperplan does not support numbers (action go)" in capsys.readouterr().err


def test_list_has_planners(capsys):
    assert invoke(["plan", "--list"]) == 0
    assert capsys.readouterr().out.startswith("pyperplan       installed\n")
    assert invoke(["plan", "--list", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["installed"] is True


@pytest.mark.parametrize(
    ("plan", "status", "output"),
    [
        ("(go a b)\n(go b c)\n", 0, "the plan holds: 2 steps"),
        ("; a comment\n0.000: ( GO A B ) [1.000]\n\n 1.5:(go b c)\n", 0, "the plan holds: 2 steps"),
        ("(go a b)\n", 1, "the plan does not hold: the goal is not reached: (at c) is false"),
        ("(go a b)\n(go a b)\n", 1, "the plan does not hold: step 2, (go a b): (at a) is false"),
    ],
)
def test_plan_is_validated(write_files, tmp_path, capsys, plan, status, output):
    (tmp_path / "plan").write_text(plan)
    assert invoke(["plan", *write_files(), "--validate", str(tmp_path / "plan")]) == status
    assert output in capsys.readouterr().out


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ("go a b", "plan:1: not an action of a plan"),
        ("(go a b)\n(fly a b)", "plan:2:"),
        ("(go a z)", "does not exist: z"),
    ],
)
def test_invalid_plan_file_is_refused(write_files, tmp_path, capsys, plan, message):
    (tmp_path / "plan").write_text(plan)
    assert invoke(["plan", *write_files(), "--validate", str(tmp_path / "plan")]) == 2
    assert message in capsys.readouterr().err


def test_strict_fawkes_refuses_wrong_case(write_files, capsys):
    domain = DOMAIN.replace("link ?a ?b)) :effect", "Link ?a ?b)) :effect")
    assert invoke(["plan", *write_files(domain=domain)]) == 0
    assert invoke(["plan", *write_files(domain=domain), "--strict", "fawkes"]) == 2
    assert "Unknown predicate: Link" in capsys.readouterr().err
    assert invoke(["plan", *write_files(), "--strict", "val"]) == 2
