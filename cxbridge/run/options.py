"""The options of runs, as dataclasses whose fields are options of the command line, too.

``cxbridge.cli.option_groups`` makes the parameters of commands from the fields and their descriptions.
Daemons have most of the groups (``cxbridge.daemon.options``), and plug-ins add groups (:data:`OPTIONS`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, TypeVar, dataclass_transform

from msgspec import Meta

from cxbridge.errors import CxbridgeError
from cxbridge.plugins import Table
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from cxbridge.run.servers import RunServer

CORES = ("builtin", "fawkes")
SKILLERS = ("lua", "simulator", "none")
SPEECH_CHOICES = ("off", "on")
MAX_TIMEOUT_S = 1e9
"""The longest timeout of a run in seconds: about 32 years, far within the range of clocks."""

# `--trace scenario.yaml` is a likely slip, e.g. after an option without its value.
_INPUT_SUFFIXES = (".clp", ".lua", ".pddl", ".xml", ".yaml")

TRACE_LEVELS = ("transitions", "rules", "facts")

REPLAY_ORDERS = ("total", "partial")

# Prefixes of clocks that run faster or slower than a remote Skiller.
_SIMULATED_CLOCKS = ("virtual", "scaled")

Setting = bool | int | str | list[str]
"""The type of values below ``cxbridge:`` in a daemon's configuration."""


class PluginOptions:
    """Base class of option groups of plug-ins. A subclass is a dataclass; its fields become options."""

    commands: ClassVar[frozenset[str]] = frozenset({"agent"})
    """The commands with these options: ``agent`` (all that run or read an agent), ``run`` or ``daemon``."""

    @property
    def needs_real_time(self) -> bool:
        """Whether the default clock is the real clock."""
        return False

    @property
    def is_interactive(self) -> bool:
        """Whether a user may stop the rules: a cycle may then take any time, and no waiting run is stuck."""
        return False

    def check(self, options: RunOptions) -> None:
        """Raise :class:`CxbridgeError` if options contradict each other."""

    def servers(self) -> Sequence[RunServer]:
        """Return the servers of a run."""
        return ()

    def settings(self) -> Iterable[tuple[str, Setting]]:
        """Return the equivalent daemon settings, by path below ``cxbridge``."""
        return ()


G = TypeVar("G", bound=PluginOptions)
T = TypeVar("T")

OPTIONS: Final[Table[type[PluginOptions]]] = Table(
    "OPTIONS",
    lambda loaded: is_dataclass(loaded) and isinstance(loaded, type) and issubclass(loaded, PluginOptions),
    "a dataclass derived from cxbridge.run.options.PluginOptions",
)
"""Option groups of plug-ins."""


def find_option_groups(commands: frozenset[str]) -> list[type[PluginOptions]]:
    """Return the option groups of plug-ins for these commands."""
    return [group for group in map(OPTIONS.load_target, OPTIONS.rows) if group.commands & commands]


@dataclass_transform(frozen_default=True, kw_only_default=True)
def option_base(cls: type[T]) -> type[T]:
    """Make a dataclass of a base class that has no instances, so that it needs no methods.

    Python compiles the methods of a dataclass at each start.
    """
    return dataclass(frozen=True, kw_only=True, init=False, repr=False, eq=False, match_args=False)(cls)


@option_base
class SourceOptions:
    """Options of runs and daemons about the sources of an agent's files.

    :param plugin_groups: one option group for each plug-in with a given option.
    """

    commands: ClassVar[frozenset[str]] = frozenset({"agent"})
    """See :attr:`PluginOptions.commands`."""

    plugin_groups: tuple[PluginOptions, ...] = ()

    @classmethod
    def added_groups(cls) -> list[type[PluginOptions]]:
        """Return the option groups of plug-ins for the commands of this class."""
        return find_option_groups(cls.commands)

    fawkes_dir: Annotated[
        Path | None, Meta(description="A Fawkes checkout; its files are used unchanged.")
    ] = None
    core: Annotated[
        str | None,
        Meta(
            description="The CX core, builtin or fawkes; by default the core of "
            "the checkout, if there is one."
        ),
    ] = None
    clips_dirs: Annotated[
        tuple[Path, ...],
        Meta(description="A folder of CLIPS files, searched first. Repeatable."),
    ] = ()
    interface_dirs: Annotated[
        tuple[Path, ...], Meta(description="A folder of interface XML files. Repeatable.")
    ] = ()
    skill_dirs: Annotated[tuple[Path, ...], Meta(description="A folder with Lua skills. Repeatable.")] = ()

    def find_group(self, group_class: type[G]) -> G | None:
        """Return the option group of a plug-in; None if the user gave none of its options."""
        return next((group for group in self.plugin_groups if isinstance(group, group_class)), None)

    def option(self, name: str) -> Any:
        """Return the value of a plug-in's option; None if the user gave none of the plug-in's options."""
        return next((getattr(group, name) for group in self.plugin_groups if hasattr(group, name)), None)


@option_base
class LogOptions:
    """Options of runs and daemons for logs in Fawkes' formats."""

    log: Annotated[Path | None, Meta(description="Write a log in the format of Fawkes.")] = None
    bblog: Annotated[
        Path | None, Meta(description="Write files in the format of Fawkes' bblogger into this folder.")
    ] = None


@option_base
class StrictnessOptions:
    """The option of runs and daemons that decides whether a broken agent starts.

    :param strict: True refuses a broken agent, False starts it without its broken parts; None: False for an
        agent of a checkout, else True.
    """

    strict: Annotated[
        bool | None,
        Meta(
            description="--strict refuses to start a broken agent, --lenient starts it without its broken "
            "parts. Default: strict, but lenient with a checkout."
        ),
    ] = None


@option_base
class ScenarioOptions:
    """The agent and its configuration.

    :param agent: the agent to run, in a scenario with several agents; None: all agents.
    :param config: overlays of the scenario's configuration; later files win.
    """

    scenario: Annotated[
        Path | None,
        Meta(
            description="A folder with a scenario.yaml, or a Fawkes configuration file or folder. With "
            "--fawkes-dir: that checkout's configuration by default."
        ),
    ] = None
    agent: Annotated[
        str | None,
        Meta(description="Run only this agent of a scenario with several agents."),
    ] = None
    spec: Annotated[
        str | None, Meta(description="The spec to run; by default the spec that the configuration names.")
    ] = None
    config: Annotated[
        Path | tuple[Path, ...] | None,
        Meta(
            description="A configuration file that overrides the scenario's and the files before it. "
            "Repeatable."
        ),
    ] = None
    overlays: Annotated[
        tuple[Path, ...],
        Meta(
            description="A team's checkout: its files hide those of --fawkes-dir. Repeatable: the first wins."
        ),
    ] = ()


@option_base
class ExecutionOptions:
    """Clock, Skiller, speech and timeout.

    :param clock: the name of the clock; by default real with a remote Skiller or a plug-in that needs real
        time, else virtual.
    :param timeout: the time limit in seconds of the run's clock.
    """

    clock: Annotated[
        str | None,
        Meta(
            description="The clock by which the run measures time; virtual by default, real with a Skiller "
            "elsewhere."
        ),
    ] = None
    skiller: Annotated[
        str,
        Meta(
            description="The Skiller that executes skills. A URL, e.g. fawkes://robot:1910, is the address "
            "of a blackboard with a Skiller."
        ),
    ] = "lua"
    speech: Annotated[str, Meta(description="Speak the texts that skills say.")] = "off"
    timeout: Annotated[float, Meta(description="Time limit of the run, in seconds of its clock.")] = 600.0


@option_base
class TraceOptions:
    """Options of the recording of a run."""

    trace: Annotated[Path | None, Meta(description="Record the run to this mcap file.")] = None
    trace_level: Annotated[str, Meta(description="Detail of the recording: transitions, rules or facts.")] = (
        "transitions"
    )
    trace_files: Annotated[
        bool, Meta(description="Attach the files of the run (configuration, CLIPS, ...) to --trace.")
    ] = True


@dataclass(frozen=True, kw_only=True)
class RunOptions(
    ScenarioOptions, SourceOptions, ExecutionOptions, TraceOptions, LogOptions, StrictnessOptions
):
    """The options of ``cxbridge run``."""

    commands: ClassVar[frozenset[str]] = frozenset({"agent", "run"})

    replay: Annotated[
        tuple[Path, ...],
        Meta(
            description="Replay the environment of a recorded run, and check that the agent decides the "
            "same. Repeatable."
        ),
    ] = ()
    replay_order: Annotated[
        str, Meta(description="Order in which the transitions are compared with the recorded ones.")
    ] = "total"

    def check(self) -> None:
        """Raise :class:`CxbridgeError` if a value is invalid or options contradict each other."""
        for name, value, values in (
            ("core", self.core, (None, *CORES)),
            ("skiller", self.skiller, (self.skiller,) if self.has_remote_skiller else SKILLERS),
            ("speech", self.speech, SPEECH_CHOICES),
            ("trace-level", self.trace_level, TRACE_LEVELS),
            ("replay-order", self.replay_order, REPLAY_ORDERS),
        ):
            if value not in values:
                choices = list(filter(None, values))
                hint = f"{did_you_mean(value or '', choices)} use one of: {', '.join(choices)}".strip()
                hint += ", or the URL of a blackboard; in tests also: scripted" if name == "skiller" else ""
                raise CxbridgeError(f"--{name} cannot be '{value}'", hint=hint)
        for group in self.plugin_groups:
            group.check(self)
        if self.replay:
            self._check_replay()
        if self.has_remote_skiller and self.clock is not None and self.clock.startswith(_SIMULATED_CLOCKS):
            raise CxbridgeError(
                f"--clock {self.clock} cannot be combined with a Skiller on another blackboard",
                hint="the Skiller there works in real time: use --clock real (the default)",
            )
        if not 0 < self.timeout <= MAX_TIMEOUT_S:
            raise CxbridgeError(
                f"--timeout cannot be {self.timeout:g}",
                hint=f"use seconds, more than 0, up to {MAX_TIMEOUT_S:g}",
            )
        for folder in (*self.clips_dirs, *self.interface_dirs, *self.skill_dirs):
            if not folder.is_dir():
                raise CxbridgeError("there is no such folder", file=folder)
        self._check_outputs()

    @property
    def has_remote_skiller(self) -> bool:
        """Whether the Skiller is on another blackboard."""
        return "://" in self.skiller

    @property
    def clock_name(self) -> str:
        """The name of the chosen clock, by default of the clock that Skiller and plug-ins require."""
        is_real = self.has_remote_skiller or any(group.needs_real_time for group in self.plugin_groups)
        return self.clock or ("real" if is_real else "virtual")

    def _check_replay(self) -> None:
        """Raise if an option contradicts a replay."""
        for name, value, permitted in (
            ("skiller", self.skiller, "lua"),
            ("speech", self.speech, "off"),
            ("clock", self.clock_name, "virtual"),
        ):
            if value != permitted:
                raise CxbridgeError(
                    f"--{name} {value} cannot be combined with --replay",
                    hint="the recordings replace Skillers and sensors, on the virtual clock",
                )

    def _check_outputs(self) -> None:
        """Raise if the recording or the log would overwrite an input, or if both are the same file."""
        if self.trace is not None and self.log is not None and self.trace.absolute() == self.log.absolute():
            raise CxbridgeError("--trace and --log name the same file", file=self.log, hint="name two files")
        for name, file in (("trace", self.trace), ("log", self.log)):
            if file is not None and file.suffix in _INPUT_SUFFIXES and file.is_file():
                raise CxbridgeError(
                    f"--{name} would overwrite this file, which looks like an input",
                    file=file,
                    hint="name another one, e.g. out/run.mcap, out/run.log",
                )
