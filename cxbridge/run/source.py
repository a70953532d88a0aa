"""Sources of an agent's files, and their differences from the default executive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from msgspec import Struct

from cxbridge.config import Configuration
from cxbridge.config.checkouts import Checkouts
from cxbridge.config.documents import Mark
from cxbridge.errors import CxbridgeError
from cxbridge.executive.executive import BUILTIN_CX, ENVIRONMENT, ActionMapper, CoreFiles, Executive
from cxbridge.executive.manager import HOST_LIBRARY, EnvironmentManager
from cxbridge.mainloop import DEFAULT_PERIOD_US
from cxbridge.plugins import Table
from cxbridge.resources import shipped_dir, shipped_scenarios
from cxbridge.run.paths import (
    FAWKES_INTERFACES,
    FAWKES_PLUGIN_INTERFACES,
    SCENARIO_FILE,
    RunPaths,
    find_fawkes_folder,
    find_fawkes_interface_dirs,
)
from cxbridge.run.specs import check_spec, choose_spec, find_key_mistakes
from cxbridge.skiller.backend import DEFAULT_SKILLER, INSTANCES

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.executive.feature import Feature, LazyFeature
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.options import RunOptions
    from cxbridge.skiller.board.board import SkillBoard
    from cxbridge.skiller.board.executor import SkillExecutor
    from cxbridge.skiller.board.settings import BoardSettings

SOURCES: Final[Table[Callable[[RunOptions], Source]]] = Table(
    "SOURCES",
    callable,
    "a subclass of cxbridge.run.source.Source",
)
"""The sources of plug-ins. A row's ``needed`` returns whether the options of a run name the source."""

CLIPS_SUFFIX = ".clp"
"""The suffix of a scenario in a single CLIPS file."""

_EXECUTIVE_KEY = "/clips-executive"
_TIME_KEY = f"{_EXECUTIVE_KEY}/assert-time-each-loop"

_FAWKES_LIBRARY = "src/plugins/clips/clips"
_FAWKES_CX = "src/plugins/clips-executive/clips"
_FAWKES_LUA = "src/lua"
_SCENARIO_INTERFACES = "interfaces"  # subfolder of the scenario's folder

_PERIOD_KEY: Final = "/fawkes/mainapp/desired_loop_time"
_MIN_PERIOD_US: Final = 100


class LoadedFile(Struct, frozen=True):
    """A file loaded by an agent.

    :param is_batch: whether it contains commands rather than constructs.
    :param mark: the configuration entry or command that loads the file.
    """

    path: Path
    is_batch: bool
    mark: Mark


def source_of(options: RunOptions) -> Source:
    """Return the source of a run: the first of :data:`SOURCES` that matches the options, or the default."""
    row = next((row for row in SOURCES.rows if row.needed(options)), None)
    return Source(options) if row is None else SOURCES.load_target(row)(options)


class Source:
    """The default source: a scenario, a CLIPS file or a Fawkes checkout. Subclasses override the differences.

    The ``context`` of methods is a :class:`cxbridge.run.agent.Run`, whose module imports this one.
    """

    has_fawkes_configuration: ClassVar[bool] = True
    """Whether keys, stages and specs follow Fawkes' executive."""

    def __init__(self, options: RunOptions) -> None:
        self.options = options

    def check(self) -> None:
        """Raise :class:`CxbridgeError` if the options name no configuration, or an absent checkout."""
        self.check_folders()
        if not self.is_named:
            raise CxbridgeError(
                "no scenario given",
                hint="name a folder with a scenario.yaml, or a Fawkes checkout with --fawkes-dir",
            )

    @property
    def is_named(self) -> bool:
        """Whether the options name a scenario or a checkout."""
        return self.options.scenario is not None or bool(self.folders)

    @property
    def needs_skiller(self) -> bool:
        """Whether actions may use the run's Skiller."""
        return True

    @property
    def folders(self) -> tuple[Path, ...]:
        """The checkouts of the options: the overlays, then the Fawkes checkout."""
        fawkes = self.options.fawkes_dir
        return (*self.options.overlays, *(() if fawkes is None else (fawkes,)))

    def check_folders(self) -> None:
        """Raise :class:`CxbridgeError` if a checkout does not exist."""
        for folder in self.folders:
            if not folder.is_dir():
                raise CxbridgeError("there is no such folder", file=folder)

    @property
    def is_lenient(self) -> bool:
        """Whether a broken agent starts without its broken parts, the default for checkouts."""
        strict = self.options.strict
        return self.is_checkout if strict is None else not strict

    @property
    def is_checkout(self) -> bool:
        """Whether the agent's files belong to a checkout."""
        return self.options.fawkes_dir is not None

    @property
    def checkouts(self) -> Checkouts:
        """The checkouts of the options in search order."""
        return Checkouts(tuple(folder.resolve() for folder in self.folders))

    def config_file(self) -> Path:
        """Return the configuration file of the options.

        :raises CxbridgeError: if the file does not exist.
        """
        checkouts, path = self.checkouts, self.options.scenario
        if path is None:
            assert checkouts.folders  # checked by check()
            path = checkouts.find_configuration(Path())
        if not path.exists():
            path = checkouts.find_configuration(path)
        # a name without a folder may also be the name of a shipped scenario
        if not path.exists() and len(path.parts) == 1 and (shipped_dir("scenarios") / path).is_dir():
            path = shipped_dir("scenarios") / path
        if path.is_dir():
            return _find_configuration_file(path)
        if not path.is_file():
            raise CxbridgeError(
                "there is no such scenario",
                file=path,
                hint=f"shipped with cxbridge: {', '.join(shipped_scenarios())}",
            )
        return path

    def load_configuration(self) -> tuple[Configuration, Path]:
        """Return the configuration with overlays, and its file.

        :raises CxbridgeError: if a file or checkout is missing, or a file is wrong.
        """
        self.check()
        file = self.config_file()
        config = self.read_configuration(file)
        config.overlay_files(self.find_overlays())
        if file.name == SCENARIO_FILE and config.keys(_EXECUTIVE_KEY) and not config.exists(_TIME_KEY):
            # Fawkes' own configuration sets the key; without time facts, interfaces are read only in the
            # first loop, and time-outs never pass
            config.set(_TIME_KEY, True)
        return config, file

    def read_configuration(self, file: Path) -> Configuration:
        """Return the configuration in a file, without overlays.

        :raises CxbridgeError: if the file is wrong.
        """
        return (
            _make_program_configuration(file)
            if file.suffix == CLIPS_SUFFIX
            else Configuration.load(file, confdir=self.checkouts.confdir(file))
        )

    def find_overlays(self) -> Sequence[Path]:
        """Return the files that overlay the scenario's configuration."""
        files = self.options.config
        return (files,) if isinstance(files, Path) else tuple(files or ())

    def choose_spec(self, config: Configuration, config_file: Path) -> tuple[str, list[str]]:
        """Return the spec of options and configuration, and warnings about the configuration.

        :raises ConfigError: if there is no such spec, or its settings are wrong.
        """
        spec = choose_spec(config, self.options.spec, config_file)
        key_mistakes = find_key_mistakes(config, spec)
        if key_mistakes and not self.is_lenient:
            raise key_mistakes[0]
        warnings = [str(warning) for warning in check_spec(config, spec)]
        # a misspelt key of a spec is unread, too, and one warning suffices
        warning_lines = "\n".join([*map(str, config.warnings), *warnings])
        return spec, warnings + [
            str(mistake) for mistake in key_mistakes if mistake.location not in warning_lines
        ]

    def find_paths(self, config: Configuration, config_file: Path) -> RunPaths:
        """Return the files and folders of options and configuration.

        :raises CxbridgeError: if a checkout lacks a folder, or Fawkes' core is chosen without a checkout.
        """
        options, checkouts = self.options, self.checkouts
        confdir = checkouts.confdir(config_file).resolve()
        fawkes = options.fawkes_dir.resolve() if options.fawkes_dir else None
        basedir = checkouts.find_checkout(config_file)
        placeholders = {
            "BASEDIR": str(basedir),
            "FAWKES_BASEDIR": str(fawkes or basedir),
            "RESDIR": str(basedir / "res"),
            "CONFDIR": str(confdir),
        }
        uses_fawkes_core = (options.core or ("fawkes" if fawkes else "builtin")) == "fawkes"
        if uses_fawkes_core and fawkes is None:
            raise CxbridgeError("--core fawkes needs a Fawkes checkout", hint="name it with --fawkes-dir")
        core_dir, library_dir = BUILTIN_CX, HOST_LIBRARY
        clips_dirs = [*options.clips_dirs]
        for configured_path in config.get_strings("/clips-executive/clips-dirs", default=[]):
            clips_dirs += checkouts.expand(configured_path, placeholders, confdir)
        overlays = Checkouts(checkouts.folders[: len(options.overlays)])  # the folders begin with them
        interface_dirs = [*options.interface_dirs, *overlays.find_matching_folders(FAWKES_INTERFACES)]
        interface_dirs += overlays.find_matching_folders(FAWKES_PLUGIN_INTERFACES)
        skill_dirs = [*options.skill_dirs, *overlays.find_matching_folders(_FAWKES_LUA)]
        if config_file.name == SCENARIO_FILE:
            clips_dirs.append(confdir)
            if (confdir / _SCENARIO_INTERFACES).is_dir():
                interface_dirs.append(confdir / _SCENARIO_INTERFACES)
        if fawkes is not None:
            fawkes_cx = find_fawkes_folder(fawkes, _FAWKES_CX)
            interface_dirs += find_fawkes_interface_dirs(fawkes)
            skill_dirs.append(find_fawkes_folder(fawkes, _FAWKES_LUA))
            if uses_fawkes_core:
                core_dir, library_dir = fawkes_cx, find_fawkes_folder(fawkes, _FAWKES_LIBRARY)
            else:
                # Fawkes' own agents are in the folder of its core
                clips_dirs.append(fawkes_cx)
        return RunPaths(
            config_file=config_file,
            library_dir=library_dir,
            core_dir=core_dir,
            clips_dirs=tuple(dict.fromkeys(clips_dirs)),
            interface_dirs=(*interface_dirs, shipped_dir("interfaces")),
            skill_dirs=(*skill_dirs, shipped_dir("luaskills")),
            substitutions={f"@{name}@": folder for name, folder in placeholders.items()},
            checkouts=checkouts,
        )

    def loop_period_us(self, config: Configuration) -> int:
        """Return the target period of the main loop in microseconds.

        :raises ConfigError: if the configured period is too short.
        """
        period_us = config.get_uint(_PERIOD_KEY, default=DEFAULT_PERIOD_US)
        # with a shorter period, a virtual clock would hardly advance
        if period_us < _MIN_PERIOD_US:
            raise config.error(
                _PERIOD_KEY,
                f"{_PERIOD_KEY} cannot be {period_us}",
                f"microseconds, {_MIN_PERIOD_US} at least; Fawkes has {DEFAULT_PERIOD_US}",
            )
        return period_us

    def board_settings(
        self, config: Configuration, paths: RunPaths, executors: tuple[type[SkillExecutor], ...] = ()
    ) -> BoardSettings | None:
        """Return the settings of the run's skill board; None for no skill board.

        :param executors: executors of a program. They need a skill board even if none is configured.
        :raises ConfigError: if a setting is wrong.
        """
        if not config.keys("/skill-board") and not executors:
            return None
        from cxbridge.skiller.board.settings import BoardSettings  # noqa: PLC0415 - start-up time is a feature

        settings = BoardSettings.from_config(config, paths.confdir) or BoardSettings()
        if executors:
            settings = settings.replace_executors(executors, config.keys(INSTANCES) or [DEFAULT_SKILLER])
        return settings

    def board_class(self, config: Configuration) -> type[SkillBoard] | None:  # noqa: ARG002 - for subclasses
        """Return the class of the skill board, which decides how executors are asked; None: the default."""
        return None

    def prepare_board(self, context: Any) -> None:
        """Add executors to the skill board of a run before it starts.

        :raises CxbridgeError: if an executor cannot be made.
        """

    def features(self, context: Any) -> list[Feature] | None:  # noqa: ARG002 - for subclasses
        """Return replacements for cxbridge's features; None keeps them."""
        return None

    def make_manager(
        self,
        context: Any,
        features: Sequence[Feature | LazyFeature],
        environment: type[ClipsEnvironment],
    ) -> EnvironmentManager:
        """Make the manager of the executive's environments."""
        return EnvironmentManager(context.bus, features, context.paths.library_dir, environment)

    def make_executive(
        self, context: Any, manager: EnvironmentManager, mapper: ActionMapper, files: CoreFiles
    ) -> Executive:
        """Make the executive with its environment, without loading the agent.

        :raises CxbridgeError: if the configuration is wrong.
        """
        return Executive(manager, context.config, mapper, files, context.name or ENVIRONMENT)

    def calls(self, function: str) -> bool:  # noqa: ARG002 - for subclasses
        """Return whether Python code of the source calls a deffunction of this name."""
        return False

    def loaded_files(self, manager: EnvironmentManager) -> list[LoadedFile] | None:  # noqa: ARG002
        """Return the CLIPS files of an agent that is read but not run; None: the files of spec and core."""
        return None

    def core_files(self, paths: RunPaths, config: Configuration) -> CoreFiles:  # noqa: ARG002 - for subclasses
        """Return the CLIPS files of core and agent, and the features and functions that the core needs."""
        return CoreFiles(paths.core_dir, paths.clips_dirs, paths.substitutions, paths.override_dirs)

    def start_thinking(self, clock: Clock, config: Configuration) -> None:
        """Prepare :meth:`think`. Called once, after the executive has loaded the core and the agent."""

    def think(self, executive: Executive) -> int:
        """Run the rules of one loop; return the number of firings."""
        return executive.loop()


def _find_configuration_file(folder: Path) -> Path:
    for name in (SCENARIO_FILE, "config.yaml"):
        if (folder / name).exists():  # the reader of the file reports a folder of this name
            return folder / name
    raise CxbridgeError(
        "this folder has no scenario.yaml and no config.yaml",
        file=folder,
        hint="name a scenario's folder, or a Fawkes configuration file or folder",
    )


def _make_program_configuration(file: Path) -> Configuration:
    """Return the configuration of an agent in a single CLIPS file."""
    config = Configuration()
    stage = f"{_EXECUTIVE_KEY}/specs/program/init/stage-3/0"
    config.set(f"{_EXECUTIVE_KEY}/spec", "program")
    config.set(f"{_EXECUTIVE_KEY}/clips-dirs", [str(file.parent.absolute())])
    config.set(f"{stage}/name", "program")
    config.set(f"{stage}/files", [file.name])
    config.set(_TIME_KEY, True)
    return config
