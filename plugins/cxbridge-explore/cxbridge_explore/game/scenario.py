"""Games of scenarios whose referee writes GameInterface and OrderInterface."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import yaml

from cxbridge.errors import CxbridgeError
from cxbridge.events import Sink
from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of
from cxbridge_explore.game.blackboard_judge import BlackBoardJudge
from cxbridge_explore.game.playing import play_game
from cxbridge_explore.game.score import GameResult
from cxbridge_explore.worldmodel.model import NOTHING_FAILS
from cxbridge_explore.worldmodel.reading import find_world, read_world

if TYPE_CHECKING:
    from cxbridge.config import Configuration
    from cxbridge.run.agent import Run

# Keys of a scenario's configuration. The value of each key is the path of another value, which the referee
# reads: the seed, or the minutes of the production.
SEED_KEY: Final = "/game/seed"
MINUTES_KEY: Final = "/game/minutes"


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioGame:
    """A game of a scenario.

    :param run_options: the scenario, its configuration and recordings.
    :param minutes: the duration of the production; None for the duration in the scenario.
    :param world: the file of possible events; None for the scenario's ``world.yaml``. Without either file,
        nothing fails.
    """

    run_options: RunOptions
    minutes: float | None = None
    world: Path | None = None

    @property
    def quiet_components(self) -> Collection[str]:
        return ()

    def replace_agent(self, agent: Path) -> ScenarioGame:
        return replace(self, run_options=replace(self.run_options, scenario=agent))

    def play(
        self,
        seed: int,
        console: Sink | None = None,
        attach: Callable[[Run], None] | None = None,
    ) -> GameResult:
        """Play the game.

        :param seed: the seed of all draws, by the referee and by the world.
        :param console: a sink for log lines.
        :param attach: called with each agent before the game.
        :raises CxbridgeError: if the scenario is not a game, or the agent is broken.
        """
        world_file = self.world or find_world(source_of(self.run_options).config_file().parent)
        world_model = NOTHING_FAILS if world_file is None else read_world(world_file)
        # a file, since a run takes changes of its configuration only from files
        with tempfile.TemporaryDirectory(prefix="cxbridge-game-") as folder:
            overlay = Path(folder) / "game.yaml"
            overlay.write_text(yaml.safe_dump(self._referee_values(seed)))
            options = replace(self.run_options, config=(*_list_overlays(self.run_options), overlay))
            return play_game(options, seed, world_model, BlackBoardJudge, console=console, attach=attach)

    def _referee_values(self, seed: int) -> dict[str, int | float]:
        """Return the referee's configuration values for this game."""
        config, file = source_of(self.run_options).load_configuration()
        values: dict[str, int | float] = {_find_referee_path(config, file, SEED_KEY): seed}
        if self.minutes is not None:
            values[_find_referee_path(config, file, MINUTES_KEY)] = self.minutes
        return values


def _list_overlays(options: RunOptions) -> tuple[Path, ...]:
    overlays = options.config
    return (overlays,) if isinstance(overlays, Path) else overlays or ()


def _find_referee_path(config: Configuration, file: Path, key: str) -> str:
    """Return the path of the referee's value for a key.

    :param key: the key, such as :data:`SEED_KEY`.
    :raises CxbridgeError: if the configuration lacks the key, or the value at its path.
    """
    path = config.get_str(key, default=None)
    if path is None:
        raise CxbridgeError(
            f"this scenario is not a game: its configuration has no {key}",
            file=file,
            hint="set it to the path of the referee's own value; see docs/games.md",
        )
    if not config.exists(path):
        raise CxbridgeError(f"{key} names '{path}', which the configuration does not have", file=file)
    return path
