"""Synchronising domain and world model, against the original core of a Fawkes checkout in the same run.

The work: D facts of one predicate with two parameters come at once, each gets its wm-fact; then some more
come, one at a time; then all go. Both cores run in cxbridge's CLIPS host, each with its own files for domain,
world model and their synchronisation.

Times are seconds of the process; making the environment and asserting are not part of them. Each figure of
the built-in core is the best of some rounds: machines are noisy.

    FAWKES_DIR=/path/to/fawkes python -m benchmarks.bench_wm_sync    exits with 1 when a limit is exceeded
"""

from __future__ import annotations

import itertools
import sys
import time
from dataclasses import dataclass

from benchmarks.cores import has_fawkes, make_environment
from benchmarks.harness import report
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol

FACTS = (100, 200, 400, 800)
COMPARED = 400
"""The number of facts for which the cores are compared."""
SINGLE = 5
"""Facts that come one at a time; the fastest counts."""
ROUNDS = 5
SPEED_UP = 10.0
"""The built-in core is to be faster by this."""
GROWTH = 2.3
"""It may take this much longer for twice as many facts."""
ONE_MORE_GROWTH = 1.5
"""One more fact may take this much longer where there are eight times as many."""

SYNC_FILES = {
    "fawkes": ("worldmodel", "wm-domain-sync"),
    "builtin": ("worldmodel", "wm-domain-sync", "wm-domain-sync-facts", "wm-domain-sync-objects"),
}
PREDICATE = "(domain-predicate (name at) (param-names thing place) (param-types object object))"


@dataclass(frozen=True)
class Taken:
    """Seconds for adding all facts, for one more, for the removal of all."""

    add: float
    one_more: float
    remove: float

    def best(self, other: Taken) -> Taken:
        """Return the smaller figures of both."""
        return Taken(
            min(self.add, other.add), min(self.one_more, other.one_more), min(self.remove, other.remove)
        )


def environment(core: str) -> ClipsEnvironment:
    """Make an environment with a core that knows the predicate."""
    env = make_environment(core, *SYNC_FILES[core])
    assert env.assert_string(PREDICATE) is not None
    env.run()
    return env


def assert_atom(env: ClipsEnvironment, number: int) -> None:
    """Assert a domain-fact; the values of all have a place in common."""
    values = (Symbol(f"thing-{number}"), Symbol("here"))
    env.assert_fact("domain-fact", {"name": Symbol("at"), "param-values": values})


def seconds_of_run(env: ClipsEnvironment) -> float:
    """Run until there is nothing to do, and return how long that took."""
    start = time.process_time()
    env.run()
    return time.process_time() - start


def measure(core: str, facts: int) -> Taken:
    """Do the work once.

    :raises AssertionError: when a wm-fact is missing or left over: the figures would mean nothing.
    """
    env = environment(core)
    for number in range(facts):
        assert_atom(env, number)
    add = seconds_of_run(env)
    assert synchronised(env) == facts
    one_more = float("inf")
    for number in range(facts, facts + SINGLE):
        assert_atom(env, number)
        one_more = min(one_more, seconds_of_run(env))
    assert synchronised(env) == facts + SINGLE
    env.eval("(delayed-do-for-all-facts ((?f domain-fact)) TRUE (retract ?f))")
    remove = seconds_of_run(env)
    assert synchronised(env) == 0
    env.destroy()
    return Taken(add, one_more, remove)


def synchronised(env: ClipsEnvironment) -> int:
    """Count the wm-facts that stand for facts of the predicate."""
    return sum(str(fact["id"]).startswith("/domain/fact/at?") for _, _, fact in env.facts("wm-fact"))


def measure_builtin() -> dict[int, Taken]:
    """Return the built-in core's best times for each number of facts; the rounds take turns."""
    worst = float("inf")
    best = dict.fromkeys(FACTS, Taken(worst, worst, worst))
    for _ in range(ROUNDS):
        for facts in FACTS:
            best[facts] = best[facts].best(measure("builtin", facts))
    return best


def show(core: str, facts: int, taken: Taken) -> None:
    """Print the times of a core."""
    print(
        f"  {core} core, D = {facts:3}: add {taken.add * 1e3:7.1f} ms, one more "
        f"{taken.one_more * 1e6:5.0f} us, remove {taken.remove * 1e3:7.1f} ms"
    )


def main() -> int:
    """Measure and print; whether a limit was exceeded."""
    within = True
    builtin = measure_builtin()
    for facts, taken in builtin.items():
        show("built-in", facts, taken)
    growths = [
        (f"add, D = {more} / D = {less}", builtin[more].add / builtin[less].add, GROWTH)
        for less, more in itertools.pairwise(FACTS)
    ]
    one_more = builtin[FACTS[-1]].one_more / builtin[FACTS[0]].one_more
    growths.append((f"one more, D = {FACTS[-1]} / D = {FACTS[0]}", one_more, ONE_MORE_GROWTH))
    for what, growth, limit in growths:
        report(what, growth, limit)
        within = within and growth <= limit
    if not has_fawkes():
        return int(not within)
    original = measure("fawkes", COMPARED)
    show("original", COMPARED, original)
    ratio = original.add / builtin[COMPARED].add
    print(f"original / built-in at D = {COMPARED}: {ratio:.1f} (at least {SPEED_UP:g})")
    return int(not within or ratio < SPEED_UP)


if __name__ == "__main__":
    sys.exit(main())
