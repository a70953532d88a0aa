"""Skillers and speech as components."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Final

from cxbridge.errors import SkillError
from cxbridge.executive.executive import place_of_skill
from cxbridge.mainloop import Hook
from cxbridge.plugins import Table
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.run.components.table import local_skillers
from cxbridge.run.skillers import SkillerGroup, SkillerSettings
from cxbridge.skiller.backend import SkillerBackend

if TYPE_CHECKING:
    from cxbridge.skiller.simulation.deciders import Decider

_SPACE = "/skiller/skillspace"


class Skillers(Component):
    """Executes skill strings.

    :param skillers: Skillers of a replay; None: those of the configuration.
    :raises CxbridgeError: if skills cannot be loaded or an interface has another writer.
    """

    hooks = (Hook.SKILL,)
    description = "Executes skills, or mirrors the Skiller that does"

    def __init__(self, context: Run, skillers: SkillerGroup | None = None) -> None:
        self._skillers = skillers or make_skillers(context, local_skillers(context))
        context.known_skills.update(self._skillers.known_by_name)

    def loop(self) -> None:
        self._skillers.loop()

    @property
    def running(self) -> bool:
        return self._skillers.running

    @property
    def is_quiet(self) -> bool:
        return self._skillers.is_quiet

    def close(self) -> None:
        self._skillers.close()


class Speech(Component):
    """Writes ``SpeechSynthInterface``.

    :raises CxbridgeError: if the output fails or the interface has another writer.
    """

    # behind Hook.SKILL, so that speech starts in the loop of its message
    hooks = (Hook.ACT,)
    description = "Speech synthesis that skills use"

    def __init__(self, context: Run) -> None:
        from cxbridge.skiller.make import make_speech  # noqa: PLC0415 - start-up time is a feature

        self._writer = make_speech(context.board, context.clock, context.bus, speech=context.options.speech)

    def loop(self) -> None:
        self._writer.loop()

    @property
    def is_quiet(self) -> bool:
        return True

    def close(self) -> None:
        self._writer.close()


DECIDERS: Final[Table[Callable[[Run, str], Decider]]] = Table(
    "DECIDERS",
    callable,
    "a function that makes a decider from the context of a run and the name of a Skiller or an agent",
)
"""The deciders of plug-ins for simulated skills. ``make_simulator`` makes those of cxbridge."""


def make_deciders(context: Run, skiller: str) -> list[Decider]:
    """Return the plug-ins' deciders for a simulated Skiller, or for an agent on the skill board."""
    return [DECIDERS.load(row)(context, skiller) for row in DECIDERS.rows if row.needed(context)]


def make_skillers(context: Run, settings: Sequence[SkillerSettings]) -> SkillerGroup:
    """Make Skillers.

    :raises CxbridgeError: if skills cannot be loaded or an interface has another writer.
    """
    with ExitStack() as undo:
        made = [undo.enter_context(_make(context, item)) for item in settings]
        undo.pop_all()
    return SkillerGroup(made)


def _make(context: Run, item: SkillerSettings) -> SkillerBackend:
    # import on use, because Lua and the estimators slow down the start of every run
    from cxbridge.skiller.make import make_lua_skiller, skills_see_navgraph  # noqa: PLC0415

    config = context.config
    navgraph = None
    if skills_see_navgraph(config):
        navgraph = context.navgraph
    if item.kind == "simulator":
        from cxbridge.run.skill_history import read_samples  # noqa: PLC0415
        from cxbridge.skiller.simulation.make import make_simulator  # noqa: PLC0415

        return make_simulator(
            context.board,
            context.clock,
            context.bus,
            config=config,
            name=item.name,
            read_samples=read_samples,
            navgraph=navgraph,
            more=make_deciders(context, item.name),
        )
    from cxbridge.skiller.lua.limits import limits_of  # noqa: PLC0415

    try:
        return make_lua_skiller(
            context.board,
            context.clock,
            context.bus,
            folders=context.paths.skill_dirs,
            config=config,
            space=item.space,
            name=item.name,
            mode=item.mode,
            limits=limits_of(config),
            navgraph=navgraph,
            place_of=partial(place_of_skill, config, context.spec),
        )
    except SkillError as error:
        if error.file is None and config.exists(_SPACE):
            place = config.get(_SPACE)
            error.file, error.line = place.file or None, place.line or None
        raise
