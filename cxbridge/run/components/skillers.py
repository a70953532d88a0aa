"""Skillers and speech as components."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial

from cxbridge.errors import SkillError
from cxbridge.executive.executive import find_skill_location
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.run.components.table import local_skillers
from cxbridge.run.skillers import SkillerSettings, make_deciders
from cxbridge.skiller.backend import SkillerBackend

_SPACE_KEY = "/skiller/skillspace"


class Skillers(Component):
    """Executes skill strings.

    :param skillers: the Skillers of a replay, in the order of their steps; None: the configured Skillers.
    :raises CxbridgeError: if skills cannot be loaded or an interface has another writer.
    """

    hooks = (Hook.SKILL,)
    description = "Executes skills"

    def __init__(self, context: Run, skillers: Sequence[SkillerBackend] | None = None) -> None:
        self._skillers = _make_skillers(context) if skillers is None else skillers
        context.known_skills.update({skiller.name: skiller.known_skills for skiller in self._skillers})

    def loop(self) -> None:
        for skiller in self._skillers:
            skiller.loop()

    @property
    def running(self) -> bool:
        return any(skiller.running for skiller in self._skillers)

    @property
    def is_quiet(self) -> bool:
        return all(skiller.is_quiet for skiller in self._skillers)

    def close(self) -> None:
        for skiller in reversed(self._skillers):
            skiller.close()


class Speech(Component):
    """Writes ``SpeechSynthInterface``.

    :raises CxbridgeError: if the output fails or the interface has another writer.
    """

    # after Hook.SKILL, so that speech starts in the same cycle as the skill that sends the message
    hooks = (Hook.ACT,)
    description = "Speaks the texts that skills say"

    def __init__(self, context: Run) -> None:
        from cxbridge.skiller.make import make_speech  # noqa: PLC0415 - runs without speech start faster

        self._writer = make_speech(context.board, context.clock, context.bus, speech=context.options.speech)

    def loop(self) -> None:
        self._writer.loop()

    @property
    def is_quiet(self) -> bool:
        # a rule that waits for the end of a text reads the interface: a writer other than the rules keeps the
        # run from being stuck
        return True

    def close(self) -> None:
        self._writer.close()


def _make_skillers(context: Run) -> list[SkillerBackend]:
    """Make the Skillers of the configuration; after a failure, none stays open."""
    with ExitStack() as undo:
        skillers = [
            undo.enter_context(_make_skiller(context, settings)) for settings in local_skillers(context)
        ]
        undo.pop_all()
    return skillers


def _make_skiller(context: Run, settings: SkillerSettings) -> SkillerBackend:
    # import on use, because Lua and the estimators slow down the start of every run
    from cxbridge.skiller.make import make_lua_skiller, skills_see_navgraph  # noqa: PLC0415

    config = context.config
    if settings.kind == "simulator":
        from cxbridge.run.skill_history import read_samples  # noqa: PLC0415
        from cxbridge.skiller.simulation.make import make_simulator  # noqa: PLC0415

        return make_simulator(
            context.board,
            context.clock,
            context.bus,
            config=config,
            name=settings.name,
            read_samples=read_samples,
            further_deciders=make_deciders(context, settings.name),
        )
    try:
        return make_lua_skiller(
            context.board,
            context.clock,
            context.bus,
            folders=context.paths.skill_dirs,
            config=config,
            space=settings.space,
            name=settings.name,
            mode=settings.mode,
            navgraph=context.navgraph if skills_see_navgraph(config) else None,
            find_mapping_place=partial(find_skill_location, config, context.spec),
        )
    except SkillError as error:
        # an error outside a Lua file is about the configured name of the skill space
        if error.file is None and config.exists(_SPACE_KEY):
            value = config.get(_SPACE_KEY)
            error.file, error.line = value.file or None, value.line or None
        raise
