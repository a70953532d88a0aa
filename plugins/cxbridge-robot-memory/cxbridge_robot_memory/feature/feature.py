"""The feature ``robot_memory``: documents, collections, triggers and mutexes for rules.

The functions for rules are in :mod:`.documents`, :mod:`.collections` and :mod:`.mutexes`.
docs/several-agents.md lists the differences from Fawkes.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cxbridge.config import substitute_path
from cxbridge.errors import ClipsError
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.run.agent import Run
from cxbridge_robot_memory.component import robot_memory
from cxbridge_robot_memory.feature.collections import CollectionFunctions
from cxbridge_robot_memory.feature.context import RobotMemoryContext
from cxbridge_robot_memory.feature.documents import DocumentFunctions
from cxbridge_robot_memory.feature.handles import Trigger
from cxbridge_robot_memory.feature.mutexes import MutexFunctions
from cxbridge_robot_memory.memory import RobotMemory

LIBRARY = CORE_DIR / "cx" / "robot-memory.clp"
"""cxbridge's helper functions in CLIPS."""

# assert_ordered() refuses a relation that no construct has named before
_RELATIONS = (
    "(deffunction robmem-relations () (assert (mutex-op-feedback) (mutex-trigger-register-feedback)))"
)


def make_feature(run: Run) -> RobotMemoryFeature:
    """Return the feature of a run. Fawkes' core needs Fawkes' helper functions."""
    # below Fawkes' folder `plugins`, whose `clips-executive/clips` is the core
    fawkes_library = run.paths.core_dir.parents[1] / "clips-robot-memory" / "robot-memory.clp"
    library = fawkes_library if fawkes_library.is_file() else LIBRARY
    return RobotMemoryFeature(robot_memory(run), library, run.paths.placeholders)


class RobotMemoryFeature(Feature):
    """Provides ``bson-*``, ``robmem-*``, ``robmem-mutex-*`` and robot-memory.clp.

    :param library: robot-memory.clp, by default cxbridge's. Fawkes' core needs Fawkes' file.
    :param placeholders: values of ``@BASEDIR@`` and other placeholders, by name without ``@``.
    """

    name = "robot_memory"

    def __init__(
        self, memory: RobotMemory, library: Path = LIBRARY, placeholders: Mapping[str, str] | None = None
    ) -> None:
        self._memory = memory
        self._library = library
        self._placeholders = dict(placeholders or {})
        self._contexts: dict[str, RobotMemoryContext] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        context = RobotMemoryContext(env, self._memory)
        self._contexts[env.name] = context
        DocumentFunctions(env, context.handles, context.log)
        CollectionFunctions(env, context, self._expand_path)
        MutexFunctions(env, context)
        env.build(_RELATIONS)
        env.build("(deffacts have-feature-mongodb (have-feature MongoDB))")
        if not env.batch(self._library):
            raise ClipsError("the helpers of the robot memory do not load", file=self._library)

    def before_run(self, env: ClipsEnvironment) -> None:
        """Assert the events and replies since the last run."""
        # RobotMemoryComponent, which calls `loop` in each cycle, is absent if only a rule requests the
        # feature; a second call in a cycle writes only a status that has changed in between
        self._memory.loop()
        self._contexts[env.name].assert_queued_facts()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Unregister the triggers and wait for running calls."""
        context = self._contexts.pop(env.name)
        context.close()
        for trigger in context.handles.objects_of_kind(Trigger):
            trigger.close()

    def _expand_path(self, text: str) -> Path:
        """Return a path that a rule gives, with values in place of placeholders."""
        return Path(substitute_path(text, self._placeholders))
