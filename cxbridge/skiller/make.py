"""Puts a Skiller together from what a run has."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.resources import shipped_dir
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.estimators import STATIC_PREFIX, EstimatorConfig, StaticEstimator
from cxbridge.skiller.lua.engine import Limits, LuaEngine
from cxbridge.skiller.lua.host import ConfigReader
from cxbridge.skiller.simulator import SkillerSimulator
from cxbridge.skiller.skiller import LOG_COMPONENT, Skiller
from cxbridge.skiller.speech import SilentVoice, SpeakerVoice, SpeechSynthWriter

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard

FAWKES_LUA_DIR = Path("src/lua")
"""Where the Lua files of skills lie in a Fawkes checkout."""


def skill_folders(
    skill_dirs: Sequence[Path] = (), fawkes_dir: Path | None = None, *, shipped: bool = True
) -> list[Path]:
    """Return where to look for skills: the user's folders, a Fawkes checkout, cxbridge's own."""
    folders = list(skill_dirs)
    if fawkes_dir is not None:
        folders.append(fawkes_dir / FAWKES_LUA_DIR)
    if shipped:
        folders.append(shipped_dir("luaskills"))
    return folders


def make_lua_skiller(  # noqa: PLR0913 - each is an option of the command line
    board: BlackBoard,
    clock: Clock,
    bus: EventBus,
    *,
    folders: Sequence[Path] | None = None,
    config: ConfigReader | None = None,
    space: str | None = None,
    name: str = "Skiller",
    mode: Mode = "strict",
    limits: Limits | None = None,
    seed: int = 0,
) -> Skiller:
    """Load a skill space and make the Skiller that runs it.

    :param folders: where skills lie, see :func:`skill_folders`; None: those that come with cxbridge.
    :param config: skills read it; ``/skiller/skillspace`` in it names the space unless ``space`` does.
    :param name: id of the SkillerInterface.
    :raises SkillError: when the space or one of its skills cannot be loaded; with file and line.
    :raises BlackBoardError: when somebody else writes one of the interfaces.
    """
    if space is None:
        known = config is not None and config.exists("/skiller/skillspace")
        space = config.get_str("/skiller/skillspace") if config is not None and known else "test"
    bus.logger("SkillerExecutionThread").debug(f"Skill space: {space}")
    log = bus.logger(LOG_COMPONENT)
    engine = LuaEngine(
        board,
        clock,
        log,
        skill_folders() if folders is None else folders,
        space=space,
        config=config,
        limits=limits,
        owner=LOG_COMPONENT,
        seed=seed,
    )
    try:
        skiller = Skiller(board, engine, bus, name=name, mode=mode)
    except Exception:
        engine.close()
        raise
    log.debug("Lua startup completed")
    return skiller


def make_simulator(
    board: BlackBoard,
    clock: Clock,
    bus: EventBus,
    *,
    config: EstimatorConfig | None = None,
    name: str = "Skiller",
    mode: Mode = "strict",
) -> SkillerSimulator:
    """Make a Skiller that only waits, as long as the static estimator in ``config`` says (else a second).

    :param name: id of the SkillerInterface.
    :raises BlackBoardError: when somebody else writes the interface.
    """
    configured = config is not None and config.keys(STATIC_PREFIX)
    estimators = [StaticEstimator.from_config(config)] if config is not None and configured else []
    return SkillerSimulator(board, clock, bus, estimators, name=name, mode=mode)


def make_speech(
    board: BlackBoard,
    clock: Clock,
    bus: EventBus,
    *,
    aloud: bool = False,
    name: str = "Flite",
    greeting: str | None = None,
) -> SpeechSynthWriter:
    """Make the writer of the SpeechSynthInterface.

    :param aloud: speak (``--speech on``); otherwise silent, for as long as it would take.
    :param greeting: a text to say first, see :data:`cxbridge.skiller.speech.LOADED_TEXT`.
    :raises SkillerError: when it cannot speak aloud; it tells what to install.
    :raises BlackBoardError: when somebody else writes the interface.
    """
    voice = SpeakerVoice() if aloud else SilentVoice(clock)
    return SpeechSynthWriter(board, clock, bus, voice=voice, name=name, greeting=greeting)
