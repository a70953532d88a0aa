"""Planning through the service against the engine bare: blocks worlds of 4 to 10 blocks.

What is ours is all but the engine's own search: reading the problem, binding, the way to the planner's
process and back. Bare is what the engine needs before it searches, in this process, from files.
"""

from __future__ import annotations

import random
import statistics
import tempfile
import time
from itertools import pairwise
from pathlib import Path

from benchmarks.harness import report
from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.planning import PlanningService, PlanRequest
from cxbridge.executive.planning.grounding import ground

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


def problem(blocks: int) -> str:
    """Return a tower to be built from another one."""
    names = [f"b{number}" for number in range(blocks)]
    before, after = (
        random.Random(blocks).sample(names, blocks),
        random.Random(100 + blocks).sample(names, blocks),
    )
    on = "".join(f"(on {upper} {lower})" for upper, lower in pairwise(before))
    goal = "".join(f"(on {upper} {lower})" for upper, lower in pairwise(after))
    return f"""(define (problem p) (:domain blocks) (:objects {" ".join(names)} - block)
      (:init (empty) (clear {before[0]}) (table {before[-1]}) {on}) (:goal (and {goal})))"""


def seconds(function, *arguments):
    """Return how long a call takes, and what it returns."""
    start = time.perf_counter()
    result = function(*arguments)
    return time.perf_counter() - start, result


def main() -> None:
    """Measure and print."""
    from pyperplan import planner as pyperplan

    domain = parse_domain(DOMAIN)
    with PlanningService() as service, tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, "domain.pddl"), Path(folder, "problem.pddl")]
        files[0].write_text(DOMAIN)
        service.plan(PlanRequest(domain, parse_problem(problem(3), domain), "pyperplan"))
        for blocks in range(4, 11):
            text = problem(blocks)
            files[1].write_text(text)
            ours, bare = [], []
            for _ in range(ROUNDS):
                bare.append(seconds(lambda: pyperplan._ground(pyperplan._parse(*map(str, files))))[0])
                task = parse_problem(text, domain)
                binding, _task = seconds(ground, domain, task)
                start = time.perf_counter()
                result = service.plan(PlanRequest(domain, parse_problem(text, domain), "pyperplan"))
                whole = time.perf_counter() - start
                assert result.actions
                ours.append(whole - result.seconds + binding)
            print(f"  {blocks} blocks: bare without search {1000 * statistics.median(bare):.1f} ms")
            report(f"planning beyond search, {blocks} blocks, ms", 1000 * statistics.median(ours), limit=20)


if __name__ == "__main__":
    main()
