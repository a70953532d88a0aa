"""What the guard against endless recursion costs a function, and what it saves not to give it to all.

``wm-key-prefix`` of Fawkes' core is called for every fact that a rule of a world model tests. Its
documentation string has an example of its own call. Compared is the function as it is loaded, and with the
guard that it got while strings and comments counted as code: pairs in the same environment.

    python -m benchmarks guard      prints the time of a call and the ratio
"""

from __future__ import annotations

import statistics
import time

from cxbridge.clipstext.syntax import blank
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.recursion import guards_at

CALLS = 5_000
ROUNDS = 41

FUNCTION = """(deffunction wm-key-prefix (?key $?prefix)
  "Whether a key begins with a prefix: (wm-key-prefix (create$ domain fact args? bar x) domain fact)"
  (if (> (length$ ?prefix) (length$ ?key)) then (return FALSE))
  (foreach ?p ?prefix
    (if (neq ?p (nth$ ?p-index ?key)) then (return FALSE)))
  (return TRUE))"""
LOOP = """(deffunction NAME-calls (?n)
  (bind ?key (create$ domain fact at args? r R-1 x START))
  (loop-for-count (?i 1 ?n) (NAME ?key domain fact at)))"""


def guarded(text: str, code: str) -> str:
    """Return the function with the guard that it needs by ``code``."""
    for at, guard in guards_at(code, 0, len(code), lambda _name: False):
        text = text[:at] + guard + text[at:]
    return text


def measure() -> tuple[list[float], list[float]]:
    """Return the times of a call, microseconds of CPU time: as it is, and with the guard."""
    env = ClipsEnvironment("bench", EventBus(VirtualClock()))
    now, before = guarded(FUNCTION, blank(FUNCTION)), guarded(FUNCTION, FUNCTION)
    assert now == FUNCTION != before
    env.build(now)
    env.build(before.replace("(deffunction wm-key-prefix", "(deffunction guarded-prefix"))
    times: dict[str, list[float]] = {"wm-key-prefix": [], "guarded-prefix": []}
    for name in times:
        env.build(LOOP.replace("NAME", name))
    for _ in range(ROUNDS):
        for name, found in times.items():
            begin = time.process_time()
            env.call(f"{name}-calls", CALLS)
            found.append((time.process_time() - begin) / CALLS * 1e6)
    return times["wm-key-prefix"], times["guarded-prefix"]


def main() -> None:
    """Measure and print."""
    now, before = measure()
    ratio = statistics.median(old / new for new, old in zip(now, before, strict=True))
    print(f"a call of wm-key-prefix: {min(now):.2f} us, with the guard {min(before):.2f} us")
    print(f"with the guard / without, median of {ROUNDS} pairs: {ratio:.2f}")


if __name__ == "__main__":
    main()
