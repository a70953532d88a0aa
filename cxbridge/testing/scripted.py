"""The Skillers of a run with scripted skills."""

from __future__ import annotations

import re
import sys
from collections.abc import Hashable, Sequence
from typing import Final

from cxbridge.run.agent import Run
from cxbridge.run.skillers import skiller_settings
from cxbridge.skiller.simulation.deciders import Decider
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.execution import DecidedExecution
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge.testing.skills import SkillScript
from cxbridge.testing.world import OWNER

# The name of a skill at the start of its template in an action mapping.
_LEADING_SKILL_NAME: Final = re.compile(r"\w+")


class ScriptedSkillers(SkillScript):
    """Replaces the Skillers, and directs the executors of the skill board, by the script of a test.

    The object must be created before the components of the run, which otherwise create the usual Skillers.

    :param usual_deciders: the deciders for skills without an entry in the script. A skill without a decider
        succeeds after a second.
    """

    def __init__(self, run: Run, usual_deciders: Sequence[Decider] = ()) -> None:
        super().__init__(run.clock)
        board_skillers = () if run.skill_board is None else run.skill_board.skillers
        self._run = run
        # the lowest priority: the last resort if no decider knows the skill
        self._usual_deciders = (*usual_deciders, StaticEstimator(seconds=1.0, priority=-sys.maxsize))
        self._skiller_names = [
            settings.name for settings in skiller_settings(run.config, "simulator", board_skillers)
        ]
        self._skillers: dict[str, SkillerSimulator] = {}
        self.execute = DecidedExecution(lambda agent: [self.decider(agent)])
        """Executes the skills of the skill board by the script."""
        run.execution = self.execute
        for name in self._skiller_names:
            self.come_back(name)

    @property
    def running(self) -> bool:
        """Whether any Skiller executes a skill."""
        return any(skiller.running for skiller in self._skillers.values())

    def state(self, now_us: int) -> tuple[Hashable, ...]:
        """Return the state that determines the Skillers' next events, with times relative to ``now_us``."""
        return tuple(skiller.state(now_us) for skiller in self._skillers.values())

    def loop(self) -> None:
        """Run a step of each Skiller; for the hook ``skill``."""
        # a copy, because the effect of a skill may let a Skiller vanish
        for skiller in list(self._skillers.values()):
            skiller.loop()

    def close(self) -> None:
        """Close all Skillers."""
        for name in list(self._skillers):
            self.vanish(name)

    def unmet(self) -> list[str]:
        """Return the complaints about entries of the script that no call used and that are not optional."""
        mappings = (
            item.text
            for item in self._run.config.search("/clips-executive/specs")
            if "/action-mapping/" in item.path and not item.is_list
        )
        name_matches = (_LEADING_SKILL_NAME.match(text) for text in mappings)
        return self.list_complaints({match.group() for match in name_matches if match})

    def vanish(self, skiller: str = "Skiller") -> None:
        """Let a Skiller crash: its interface loses its writer, and its current skill never ends.

        :raises AssertionError: if no Skiller with this name is running.
        """
        self._check_skiller_name(skiller)
        self._skillers.pop(skiller).close()

    def come_back(self, skiller: str = "Skiller") -> None:
        """Restart a crashed Skiller.

        :raises AssertionError: if the Skiller is running, or the run has no Skiller with this name.
        """
        if skiller in self._skillers:
            raise AssertionError(f"Skiller '{skiller}' is already running")
        if skiller not in self._skiller_names:
            raise AssertionError(
                f"there is no Skiller '{skiller}'; there are: {', '.join(self._skiller_names)}"
            )
        run, deciders = self._run, [self.decider(skiller), *self._usual_deciders]
        self._skillers[skiller] = SkillerSimulator(run.board, run.clock, run.bus, deciders, name=skiller)

    def take_control(self, skiller: str = "Skiller") -> None:
        """Let another client steal a Skiller's exclusive control in the next cycle.

        :raises AssertionError: if no Skiller with this name is running.
        """
        self._check_skiller_name(skiller)
        # the reader stays open: a Skiller revokes the control of a reader that closes
        reader = self._run.board.open_for_reading("SkillerInterface", skiller, owner=OWNER)
        message = reader.create_message("AcquireControlMessage")
        message.set("steal_control", True)
        reader.msgq_enqueue(message)

    def _check_skiller_name(self, skiller: str) -> None:
        if skiller not in self._skillers:
            raise AssertionError(f"there is no Skiller '{skiller}'; there are: {', '.join(self._skillers)}")
