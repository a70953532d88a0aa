"""The robot memory of a run."""

from __future__ import annotations

from functools import partial

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run, RunBase
from cxbridge.run.components.component import Component
from cxbridge_robot_memory.memory import RobotMemory
from cxbridge_robot_memory.settings import RobotMemorySettings
from cxbridge_robot_memory.store import Store


def robot_memory(run: Run) -> RobotMemory:
    """Return the robot memory of a run."""
    return run.shared_object(_make_memory)


def _make_memory(run: Run) -> RobotMemory:
    make_embedded = None if run.team is None else partial(_open_team_store, run.team, run.name)
    # an inspection must not open the agent's file or database
    return RobotMemory(
        run.config, run.clock, run.bus, run.board, make_embedded=make_embedded, is_volatile=run.is_inspection
    )


def _open_team_store(team: RunBase, agent: str, settings: RobotMemorySettings) -> Store:
    """Open an agent's store: its own databases, and the databases that all agents of the team share."""
    from cxbridge_robot_memory.embedded import EmbeddedStore  # noqa: PLC0415 - only teams need it
    from cxbridge_robot_memory.split import SplitStore  # noqa: PLC0415 - as above

    file = settings.file
    own_file = None if file is None else file.with_name(f"{file.stem}-{agent}{file.suffix}")
    return SplitStore(
        EmbeddedStore(team.clock, own_file),
        team.shared.get_or_make(_open_shared_store, team),
        settings.distributed_databases,
    )


def _open_shared_store(team: RunBase) -> Store:
    from cxbridge_robot_memory.embedded import EmbeddedStore  # noqa: PLC0415 - as above

    return EmbeddedStore(team.clock, RobotMemorySettings.read(team.config).file)


class RobotMemoryComponent(Component):
    """Opens the robot memory at the start, for agents that wait for it before they request the feature.

    :raises CxbridgeError: if the robot memory cannot be opened.
    """

    # before Hook.THINK: rules see a changed status of a replica set in the same cycle
    hooks = (Hook.WORLDSTATE,)
    # the documents outlive a reset of the daemon, as with a database
    steady = True
    description = "Keeps the documents of the robot memory"

    def __init__(self, run: Run) -> None:
        self._memory = robot_memory(run)
        self._memory.open()

    def loop(self) -> None:
        self._memory.loop()
