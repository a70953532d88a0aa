"""Makes the Lua Skiller and the speech synthesis of a run."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.resources import shipped_dir
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.lua.engine import Limits, LuaEngine
from cxbridge.skiller.lua.host import ConfigReader
from cxbridge.skiller.lua.watch import ModuleWatch
from cxbridge.skiller.skiller import LOG_COMPONENT, Skiller
from cxbridge.skiller.speech import SilentVoice, SpeakerVoice, SpeechSynthWriter, Voice
from cxbridge.space.tf.listener import TransformListener

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.space.navgraph import NavGraph

FAWKES_LUA_DIR = Path("src/lua")
"""Where the Lua files of skills are in a Fawkes checkout."""

SKILL_SPACE = "/skiller/skillspace"
"""What names the skill space in the configuration."""

DEFAULT_SPACE = "test"
"""The skill space that a Skiller loads when nothing names one."""

FAWKES_INTERFACES_DIR = Path("src/libs/interfaces")
"""Where the definitions of interfaces are in a Fawkes checkout."""


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


def skills_see_navgraph(config: ConfigReader) -> bool:
    """Whether ``/skiller/features/navgraph/enable`` is true."""
    enable = "/skiller/features/navgraph/enable"
    return config.exists(enable) and config.get_bool(enable)


def load_configured_navgraph(config: ConfigReader, folder: Path) -> NavGraph:
    """Read the graph file that ``/navgraph/graph_file`` names, seen from a folder.

    :raises CxbridgeError: when none is named, it cannot be read or is invalid.
    """
    from cxbridge.space.navgraph import load_navgraph  # noqa: PLC0415 - start-up time is a feature

    multi = "/navgraph/allow_multi_graph"
    allow_multi_graph = config.exists(multi) and config.get_bool(multi)
    return load_navgraph(folder / config.get_str("/navgraph/graph_file"), allow_multi_graph=allow_multi_graph)


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
    navgraph: NavGraph | None = None,
    watch: ModuleWatch | None = None,
    seed: int = 0,
    place_of: Callable[[str], str] = lambda _skill_string: "",
) -> Skiller:
    """Load a skill space and make the Skiller that runs it.

    :param folders: where skills lie, see :func:`skill_folders`; None: those that come with cxbridge.
    :param config: skills read it; ``/skiller/skillspace`` in it names the space unless ``space`` does.
    :param name: id of the SkillerInterface.
    :param navgraph: what skills see as ``navgraph``, see :func:`skills_see_navgraph`.
    :param watch: says when skill files change; None: made when ``/skiller/watch_files`` is true.
    :param place_of: returns the source of a skill string, for messages.
    :raises SkillError: when the space or one of its skills cannot be loaded; with file and line.
    :raises BlackBoardError: when one of the interfaces has another writer.
    """
    if space is None:
        known = config is not None and config.exists(SKILL_SPACE)
        space = config.get_str(SKILL_SPACE) if config is not None and known else DEFAULT_SPACE
    if watch is None and config is not None and config.exists("/skiller/watch_files"):
        watch = ModuleWatch() if config.get_bool("/skiller/watch_files") else None
    bus.logger("SkillerExecutionThread").debug(f"Skill space: {space}")
    log = bus.logger(LOG_COMPONENT)
    transforms = TransformListener(board, owner=LOG_COMPONENT)
    with contextlib.ExitStack() as undo:
        undo.callback(transforms.close)
        engine = LuaEngine(
            board,
            clock,
            log,
            skill_folders() if folders is None else folders,
            space=space,
            config=config,
            limits=limits,
            transforms=transforms.buffer,
            navgraph=navgraph,
            owner=LOG_COMPONENT,
            seed=seed,
        )
        undo.callback(engine.close)
        skiller = Skiller(
            board, engine, bus, name=name, mode=mode, watch=watch, closing=[transforms], place_of=place_of
        )
        undo.pop_all()
    log.debug("Lua startup completed")
    return skiller


def make_speech(
    board: BlackBoard,
    clock: Clock,
    bus: EventBus,
    *,
    speech: str = "off",
    name: str = "Flite",
    greeting: str | None = None,
) -> SpeechSynthWriter:
    """Make the writer of the SpeechSynthInterface.

    :param speech: ``off``: silent, for as long as it would take; ``on``: to the speaker; else a wav file, or
        a folder for one file a text.
    :param greeting: a text to say first, see :data:`cxbridge.skiller.speech.LOADED_TEXT`.
    :raises SkillerError: when it cannot speak; it says what to install.
    :raises BlackBoardError: when the interface has another writer.
    """
    voice = _voice(clock, speech)
    try:
        return SpeechSynthWriter(board, clock, bus, voice=voice, name=name, greeting=greeting)
    except Exception:
        voice.close()
        raise


def _voice(clock: Clock, speech: str) -> Voice:
    if speech == "off":
        return SilentVoice(clock)
    if speech == "on":
        return SpeakerVoice()
    from cxbridge.skiller.speech_file import FileVoice  # noqa: PLC0415 - seldom needed

    return FileVoice(clock, Path(speech))
