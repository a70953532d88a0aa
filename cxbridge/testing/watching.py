"""Properties of a run that a test drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cxbridge.run.assembly import Assembly
from cxbridge.run.ending.stuck import StuckWatch
from cxbridge_explore.properties.monitor import Ending, Property, RunEnd, Violation
from cxbridge_explore.properties.reading import find_property
from cxbridge_explore.properties.watch import PropertyWatch


def violations_of(
    properties: Sequence[str | Property],
    agent: Assembly,
    run_until: Callable[[Callable[[], object], float], None],
    is_over: Callable[[], bool],
    timeout: float,
) -> list[Violation]:
    """Play a run to its end, and return the properties that it lacks; its agent is finalized then.

    :param run_until: runs until a condition is true, or so many seconds have passed.
    :param is_over: whether the run is over.
    """
    watch = PropertyWatch(
        [each if isinstance(each, Property) else find_property(each) for each in properties],
        [agent],
        agent.clock,
    )
    stuck = StuckWatch([agent], on=True)
    is_stuck = False

    def done() -> bool:
        nonlocal is_stuck
        watch.look()
        is_stuck = not is_over() and stuck.look()
        return is_stuck or is_over()

    run_until(done, timeout)
    is_at_end = is_over() or agent.executive.maintained
    ending = Ending.OVER if is_at_end else Ending.STUCK if is_stuck else Ending.CUT
    watch.end(RunEnd(ending, "" if ending is not Ending.CUT else f"not within {timeout:g} s"))
    agent.stop()
    watch.released()
    return watch.violations
