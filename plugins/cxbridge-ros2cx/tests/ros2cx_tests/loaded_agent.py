"""The files, functions and constructs of a run with ``--ros2cx`` after the load of the agent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from cxbridge.events import Event, SourceRead
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.agent import Run
from cxbridge.run.program.plain_options import options_from_keywords
from tests.support import ROS2CX_DIR

LOOPS = 2
"""The number of loops that load the agent."""

KINDS = ("defrule", "deftemplate", "deffunction", "defglobal", "deffacts")
"""The compared kinds of constructs."""


@dataclass
class LoadedAgent:
    """The files, functions and constructs of a run.

    :param files: the CLIPS files in load order, and whether each file is a batch.
    :param functions: the minimum and maximum number of arguments of each function of a feature.
    :param constructs: names, by kind.
    """

    files: list[tuple[Path, bool]] = field(default_factory=list)
    functions: dict[str, tuple[int, int]] = field(default_factory=dict)
    constructs: dict[str, frozenset[str]] = field(default_factory=dict)


def load_agent(
    spec: str, config: Path | None = None, look: Callable[[ClipsEnvironment], None] = lambda _env: None
) -> LoadedAgent:
    """Run a spec until the agent is loaded."""
    loaded = LoadedAgent()

    def record_source(event: Event) -> None:
        assert isinstance(event, SourceRead)
        if event.role == "clips":
            loaded.files.append((Path(event.name), event.details["how"] == "batch"))
        elif event.role == "function":
            loaded.functions[event.name] = int(event.details["minimum"]), int(event.details["maximum"])

    def attach(agent: Run) -> None:
        env = agent.executive.env
        loaded.files += [(file, False) for file in env.loader.files]  # files of the library
        agent.bus.subscribe(record_source, SourceRead)
        loops = iter(range(LOOPS))

        def step() -> None:
            if next(loops, None) is None and not loaded.constructs:
                for kind in KINDS:
                    loaded.constructs[kind] = find_names(env, kind)
                look(env)
                agent.loop.stop()

        agent.loop.add(Hook.POST_LOOP, step)

    run_scenario(
        options_from_keywords(None, ros2cx=ROS2CX_DIR, spec=spec, config=config, timeout=40.0), None, attach
    )
    assert loaded.constructs, "the agent was not loaded"
    return loaded


def find_names(env: ClipsEnvironment, kind: str) -> frozenset[str]:
    """Return the names of all constructs of a kind."""
    value = env.eval(f"(get-{kind}-list MAIN)")
    assert isinstance(value, tuple)
    return frozenset(map(str, value))
