"""Members that this plug-in adds: ``explore`` of the pytest fixture, ``assert_properties`` of its runs."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from cxbridge.run.options import RunOptions
from cxbridge.run.stuck import StuckWatch
from cxbridge_explore.bounds import Bounds, ExecutionOptions
from cxbridge_explore.explore import explore as explore_scenario
from cxbridge_explore.forking import HAS_FORK
from cxbridge_explore.properties.monitor import Ending, Property, RunEnd
from cxbridge_explore.properties.reading import find_property
from cxbridge_explore.properties.selection import select_properties
from cxbridge_explore.properties.watch import PropertyWatch
from cxbridge_explore.worldmodel.reading import read_world

if TYPE_CHECKING:
    from cxbridge.pytest_plugin import RunMaker
    from cxbridge.testing.agent_run import AgentRun
    from cxbridge_explore.result import ExploreResult


def explore(
    cx: RunMaker,
    scenario: str | Path,
    *properties: str,
    faults: int = 1,
    depth: int | None = None,
    world: str | Path | None = None,
    timeout: float = 600.0,
    **options: Any,
) -> ExploreResult:
    """Play a scenario in every way that its world allows; see ``cxbridge explore``.

    :param cx: the fixture.
    :param properties: names or forms of properties; by default the properties that the command watches.
    :param faults: the maximum number of faults in a run.
    :param depth: see :class:`~cxbridge_explore.bounds.Bounds`.
    :param world: the file of possible events; by default ``world.yaml`` in the scenario's folder.
    :param timeout: the limit of a run's clock in seconds.
    :param options: further options of the command, such as ``config`` and ``spec``.
    :raises pytest.fail.Exception: if a property is violated.
    :raises CxbridgeError: if the scenario, the world or an option is invalid.
    """
    run_options = RunOptions(scenario=cx.find(scenario), skiller="none", timeout=timeout, **options)
    result = explore_scenario(
        run_options,
        Bounds(faults=faults, depth=depth),
        # A forked copy lacks the other threads of this process, but keeps the locks that those threads hold.
        ExecutionOptions(fork=HAS_FORK and threading.active_count() == 1),
        properties=select_properties(run_options, properties),
        world=None if world is None else read_world(cx.find(world)),
    )
    if result.violations:
        pytest.fail("\n".join(result.lines()), pytrace=False)
    return result


def assert_properties(run: AgentRun, *properties: str | Property, timeout: float = 600.0) -> None:
    """Run to the end while properties are checked, and finalise the agent.

    :param properties: properties, names of built-in properties, or forms. They are watched from this call on.
    :param timeout: the limit of the run's clock in seconds.
    :raises AssertionError: if a property is violated.
    :raises ConfigError: if a text is neither a built-in property nor a form.
    """
    assembly = run.assembly
    watch = PropertyWatch(
        [
            property_ if isinstance(property_, Property) else find_property(property_)
            for property_ in properties
        ],
        [assembly],
        assembly.clock,
    )
    stuck_watch = StuckWatch(assembly)
    is_stuck = False

    def is_done() -> bool:
        nonlocal is_stuck
        watch.check()
        is_stuck = not run.is_over and stuck_watch.observe_cycle()
        return is_stuck or run.is_over

    run.wait_for(is_done, timeout)
    # a run is at its end, too, if all of its open root goals are MAINTAIN goals at rest
    is_at_end = run.is_over or assembly.executive.maintaining_goals
    ending = Ending.OVER if is_at_end else Ending.STUCK if is_stuck else Ending.CUT
    watch.check_end(RunEnd(ending, "" if ending is not Ending.CUT else f"not within {timeout:g} s"))
    assembly.finalize()
    watch.check_shutdown()
    if watch.violations:
        raise AssertionError(
            "\n".join(
                f"{violation.property} is violated at {violation.seconds:.2f} s: {violation.message}"
                for violation in watch.violations
            )
        )
