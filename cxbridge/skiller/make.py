"""Construction of the Lua Skiller and the speech synthesis of a run."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.resources import shipped_dir
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.lua.engine import LuaEngine
from cxbridge.skiller.lua.limits import Limits
from cxbridge.skiller.lua.modulepath import ModuleWatch
from cxbridge.skiller.skiller import LOG_COMPONENT, Skiller
from cxbridge.skiller.speech import SilentVoice, SpeakerVoice, SpeechSynthWriter
from cxbridge.space.tf.listener import TransformListener

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.config import Configuration
    from cxbridge.space.navgraph import NavGraph

FAWKES_LUA_DIR = Path("src/lua")
"""The Lua folder in a Fawkes checkout."""

SKILL_SPACE = "/skiller/skillspace"
"""The configuration key of the skill space."""

DEFAULT_SPACE = "test"
"""The skill space without a configured one, that of Fawkes' shipped configuration."""

FAWKES_INTERFACES_DIR = Path("src/libs/interfaces")
"""The folder of interface definitions in a Fawkes checkout."""


def skill_folders(
    skill_dirs: Sequence[Path] = (), fawkes_dir: Path | None = None, *, shipped: bool = True
) -> list[Path]:
    """Return the folders of skills: those of the user, of a Fawkes checkout, and of cxbridge.

    A module in an earlier folder precedes a module of the same name in a later folder.

    :param skill_dirs: the folders of the user.
    :param fawkes_dir: the Fawkes checkout, if any.
    :param shipped: whether to include the skills of cxbridge.
    """
    folders = list(skill_dirs)
    if fawkes_dir is not None:
        folders.append(fawkes_dir / FAWKES_LUA_DIR)
    if shipped:
        folders.append(shipped_dir("luaskills"))
    return folders


def skills_see_navgraph(config: Configuration) -> bool:
    """Return whether ``/skiller/features/navgraph/enable`` is true."""
    enable_key = "/skiller/features/navgraph/enable"
    return config.exists(enable_key) and config.get_bool(enable_key)


def load_configured_navgraph(config: Configuration, folder: Path) -> NavGraph:
    """Read the graph file ``/navgraph/graph_file``, relative to a folder.

    :raises CxbridgeError: if the file is not configured, unreadable or invalid.
    """
    from cxbridge.space.navgraph import load_navgraph  # noqa: PLC0415 - most runs have no graph, and start faster without this import

    multi_graph_key = "/navgraph/allow_multi_graph"
    allow_multi_graph = config.exists(multi_graph_key) and config.get_bool(multi_graph_key)
    return load_navgraph(folder / config.get_str("/navgraph/graph_file"), allow_multi_graph=allow_multi_graph)


def make_lua_skiller(  # noqa: PLR0913 - each is an option of the command line
    board: BlackBoard,
    clock: Clock,
    bus: EventBus,
    *,
    folders: Sequence[Path] | None = None,
    config: Configuration | None = None,
    space: str | None = None,
    name: str = "Skiller",
    mode: Mode = "strict",
    limits: Limits | None = None,
    navgraph: NavGraph | None = None,
    watch: ModuleWatch | None = None,
    seed: int = 0,
    find_mapping_place: Callable[[str], str] = lambda _skill_string: "",
) -> Skiller:
    """Load a skill space and make its Skiller.

    :param folders: the folders of skills, see :func:`skill_folders`; None: only cxbridge's skills.
    :param config: the configuration for skills; ``/skiller/skillspace`` is the default of ``space``.
    :param name: the id of the SkillerInterface.
    :param mode: ``strict``: skill strings are calls with literal arguments; ``fawkes``: Lua code.
    :param limits: the limits of the skills; None: the default limits.
    :param navgraph: the graph for ``navgraph``, see :func:`skills_see_navgraph`.
    :param watch: detects changed skill files; None: a watch is made if ``/skiller/watch_files`` is true.
    :param seed: the seed of the random numbers of skills.
    :param find_mapping_place: returns the place of a skill string's mapping, for messages.
    :raises ConfigError: if a setting of the Skiller has the wrong type.
    :raises SkillError: if the space or a skill cannot be loaded, with file and line.
    :raises BlackBoardError: if an interface has another writer.
    """
    if space is None:
        is_configured = config is not None and config.exists(SKILL_SPACE)
        space = config.get_str(SKILL_SPACE) if config is not None and is_configured else DEFAULT_SPACE
    if watch is None and config is not None and config.exists("/skiller/watch_files"):
        watch = ModuleWatch() if config.get_bool("/skiller/watch_files") else None
    bus.logger("SkillerExecutionThread").debug(f"Skill space: {space}")
    log = bus.logger(LOG_COMPONENT)
    transforms = TransformListener(board, owner=LOG_COMPONENT)
    with contextlib.ExitStack() as cleanup:
        cleanup.callback(transforms.close)
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
        cleanup.callback(engine.close)
        skiller = Skiller(
            board,
            engine,
            transforms,
            bus,
            name=name,
            mode=mode,
            watch=watch,
            find_mapping_place=find_mapping_place,
        )
        # from here on the Skiller closes the transforms and the engine
        cleanup.pop_all()
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

    :param speech: ``off``: silent, but with the duration of speech; ``on``: the speaker.
    :param greeting: a first text, see :data:`cxbridge.skiller.speech.LOADED_TEXT`; None: no greeting.
    :raises SkillerError: if speech is unavailable; the hint names the missing package.
    :raises BlackBoardError: if the interface has another writer.
    """
    return SpeechSynthWriter(
        board,
        clock,
        bus,
        voice=SpeakerVoice() if speech == "on" else SilentVoice(clock),
        name=name,
        greeting=greeting,
    )
