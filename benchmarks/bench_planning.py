"""Planning through the service against the bare engine, for blocks worlds of 4 to 10 blocks.

The service is measured from the text of a problem to the plan: reading, transfer to the planner's process and
back, binding or translation, search. The bare engine is called in this process, with files: pyperplan with
the same search and heuristic, Fast Downward through unified-planning (omitted when it is not installed).
"""

from __future__ import annotations

import random
import statistics
import tempfile
import time
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

from benchmarks.harness import report
from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning import PlanningService, PlanRequest

DOMAIN = """(define (domain blocks) (:requirements :strips :typing) (:types block)
  (:predicates (on ?x ?y - block) (table ?x - block) (clear ?x - block) (empty) (held ?x - block))
  (:action pick :parameters (?x - block) :precondition (and (clear ?x) (table ?x) (empty))
    :effect (and (not (table ?x)) (not (clear ?x)) (not (empty)) (held ?x)))
  (:action drop :parameters (?x - block) :precondition (held ?x)
    :effect (and (not (held ?x)) (clear ?x) (empty) (table ?x)))
  (:action stack :parameters (?x ?y - block) :precondition (and (held ?x) (clear ?y))
    :effect (and (not (held ?x)) (not (clear ?y)) (clear ?x) (empty) (on ?x ?y)))
  (:action unstack :parameters (?x ?y - block) :precondition (and (on ?x ?y) (clear ?x) (empty))
    :effect (and (held ?x) (clear ?y) (not (clear ?x)) (not (empty)) (not (on ?x ?y)))))
"""
ROUNDS = 7


def problem_text(blocks: int) -> str:
    """Return the PDDL problem of building a tower from another tower."""
    names = [f"b{number}" for number in range(blocks)]
    before, after = (
        random.Random(blocks).sample(names, blocks),
        random.Random(100 + blocks).sample(names, blocks),
    )
    on = "".join(f"(on {upper} {lower})" for upper, lower in pairwise(before))
    goal = "".join(f"(on {upper} {lower})" for upper, lower in pairwise(after))
    return f"""(define (problem p) (:domain blocks) (:objects {" ".join(names)} - block)
      (:init (empty) (clear {before[0]}) (table {before[-1]}) {on}) (:goal (and {goal})))"""


def call_timed(function, *arguments):
    """Return the seconds of a call, and its result."""
    start = time.perf_counter()
    result = function(*arguments)
    return time.perf_counter() - start, result


def bare_pyperplan(domain_file, problem_file):
    """Return the plan of pyperplan alone; None without a plan."""
    from pyperplan import planner

    task = planner._ground(planner._parse(str(domain_file), str(problem_file)))
    return planner.SEARCHES["gbf"](task, planner.HEURISTICS["hff"](task))


def bare_fast_downward(domain_file, problem_file):
    """Return the plan of Fast Downward as unified-planning calls it; None without a plan."""
    from unified_planning import io, shortcuts

    shortcuts.get_environment().credits_stream = None  # it prints the credits of engines otherwise
    task = io.PDDLReader().parse_problem(str(domain_file), str(problem_file))
    with shortcuts.OneshotPlanner(name="fast-downward") as engine:
        return engine.solve(task).plan


def compare(service, engine, bare, folder) -> None:
    """Measure an engine, bare and through the service in turn, and print.

    :param engine: the engine's name for the service.
    :param bare: the function that calls the bare engine with the files of domain and problem.
    """
    domain = parse_domain(DOMAIN)
    domain_file, problem_file = Path(folder, "domain.pddl"), Path(folder, "problem.pddl")
    domain_file.write_text(DOMAIN)
    # not measured, because the first plan starts the planner's process
    service.plan(PlanRequest(domain, parse_problem(problem_text(3), domain), engine))
    for blocks in range(4, 11):
        text = problem_text(blocks)
        problem_file.write_text(text)
        bare(domain_file, problem_file)  # not measured, because the first call imports the engine
        alone_seconds, extra_seconds = [], []
        for _ in range(ROUNDS):
            rival_seconds, plan = call_timed(bare, domain_file, problem_file)
            start = time.perf_counter()
            result = service.plan(PlanRequest(domain, parse_problem(text, domain), engine))
            our_seconds = time.perf_counter() - start
            assert plan, "the engine alone finds no plan"
            assert result.actions, result.message
            alone_seconds.append(rival_seconds)
            extra_seconds.append(our_seconds - rival_seconds)
        alone_ms, extra_ms = 1000 * statistics.median(alone_seconds), 1000 * statistics.median(extra_seconds)
        share = extra_ms / alone_ms
        print(f"  {engine} alone: {alone_ms:.1f} ms; ours: {extra_ms:+.1f} ms, {100 * share:+.0f} %")
        report(f"{engine}, {blocks} blocks, more than alone, ms", extra_ms, limit=max(20, 0.1 * alone_ms))


def main() -> None:
    """Measure and print."""
    with PlanningService() as service, tempfile.TemporaryDirectory() as folder:
        compare(service, "pyperplan", bare_pyperplan, folder)
        if find_spec("up_fast_downward"):
            compare(service, "fast-downward", bare_fast_downward, folder)
        else:
            print("  fast-downward: not installed (pip install 'cxbridge-planning[engines]')")


if __name__ == "__main__":
    main()
