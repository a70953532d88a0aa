"""The agent under check: its configuration and its CLIPS files, loaded into CLIPS without running rules.

CLIPS reads the constructs in the order of a run, in an environment with the features that the agent requests
(groups of functions and deftemplates that the executive adds). A construct is wrong exactly when a run would
drop the construct. Since no rule fires, the check finds the actions that affect later files in the text of
the rules: loading a file, opening an interface, which adds a deftemplate, and requesting a feature.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.syntax import (
    Definition,
    SyntaxNode,
    definitions,
    has_top_level_calls,
    literal,
    without_module,
)
from cxbridge.clock import VirtualClock
from cxbridge.closing import Closing
from cxbridge.config import Configuration, ConfigValue
from cxbridge.events import Sink, SourceRead
from cxbridge.executive.executive import read_action_mapping
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.file_access import is_readable_file
from cxbridge.run.agent import Run, make_base
from cxbridge.run.agents import agent_names
from cxbridge.run.components.executive import make_executive, unasked_features
from cxbridge.run.options import RunOptions
from cxbridge.run.source import CLIPS_SUFFIX, source_of
from cxbridge.run.specs import STAGES
from cxbridge_studio.agent.clips import read_clips
from cxbridge_studio.agent.model import AgentModel
from cxbridge_studio.agent.names import NameKind, SourceFile
from cxbridge_studio.check.findings import SourcePlace
from cxbridge_studio.check.stubbed_environment import StubbedEnvironment
from cxbridge_studio.check.usage import Construct, FactUse, Usage, make_constructs

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_LOAD_FUNCTIONS: Final = frozenset({"path-load", "path-load*", "load", "load*"})
_BATCH_FUNCTIONS: Final = frozenset({"path-batch", "path-batch*", "batch", "batch*"})
_INTERFACE_FUNCTIONS: Final = frozenset(
    {"blackboard-preload", "blackboard-open", "blackboard-open-reading", "blackboard-open-writing"}
)
# The file of Fawkes' core that opens the interfaces.
_BLACKBOARD_FILE: Final = "BATCH|blackboard-init.clp"
_CORE_REQUEST: Final = "the core"  # shown in place of the file of a request by the core
_MAIN_MODULE: Final = Symbol("MAIN")
# The number of parent folders of a CLIPS file in which to search for its scenario and for the files that it
# loads. The limit is chosen freely.
MAX_PARENT_FOLDERS: Final = 4


@dataclass(frozen=True)
class ClipsFile:
    """A CLIPS file of the agent.

    :param diagnostics: CLIPS' messages about the file.
    :param is_core: whether the file belongs to the built-in core.
    """

    path: Path
    text: str
    diagnostics: tuple[Diagnostic, ...]
    is_core: bool = False

    @cached_property
    def constructs(self) -> tuple[Definition, ...]:
        """The closed constructs, in order."""
        return tuple(definitions(self.text))

    def place(self, node: SyntaxNode) -> SourcePlace:
        """Return the position of a node."""
        return SourcePlace.at(str(self.path), self.source.lines, node.start)

    def find_calls(self, *names: str) -> Iterator[SyntaxNode]:
        """Yield the calls of functions, or other lists that begin with one of these words."""
        return (node for head, node in self._headed_lists if head in names)

    @cached_property
    def _headed_lists(self) -> tuple[tuple[str, SyntaxNode], ...]:
        """All lists in the constructs, each with its first word, cached because many checks search them."""
        nodes = (node for construct in self.constructs for node in construct.node.walk())
        return tuple((node.head, node) for node in nodes if node.head)

    @cached_property
    def source(self) -> SourceFile:
        """The file with its names."""
        return read_clips(str(self.path), self.text)

    @cached_property
    def all_constructs(self) -> tuple[Construct, ...]:
        """The constructs and commands, including unclosed constructs and the constructs after those."""
        return make_constructs(self.source)


@cache
def _make_core_file(path: Path, text: str, diagnostics: tuple[Diagnostic, ...]) -> ClipsFile:
    """Return a file of the built-in core. All checked agents share the file, so that it is parsed once."""
    return ClipsFile(path, text, diagnostics, is_core=True)


@dataclass(frozen=True, slots=True)
class RequestedFile:
    """A file that the configuration or a CLIPS file loads.

    :param name: the written name, without ``BATCH|``.
    :param place: the position of the load command, or of the entry in the configuration.
    """

    name: str
    place: SourcePlace


class Agent(Closing):
    """An agent under check. Use as a context manager, which frees the CLIPS environment.

    :param options: the options of a run.
    :param sources: receives each source file when the file is read; None for no receiver.
    :ivar files: the loaded CLIPS files, in the order of loading.
    :ivar requested_files: the files that the configuration and the CLIPS files load, including missing files.
    :ivar missing_files: the requested files that no folder contains.
    :ivar late_interfaces: the interfaces that a CLIPS file opens and no configuration entry preloads. The
        values are, by type, the paths of the files that CLIPS loads before it has the deftemplate.
    """

    def __init__(self, options: RunOptions, sources: Sink | None = None) -> None:
        self.options = options
        self.files: list[ClipsFile] = []
        self.requested_files: list[RequestedFile] = []
        self.missing_files: list[RequestedFile] = []
        self.late_interfaces: dict[str, frozenset[Path]] = {}
        self._requested_features: set[str] = set()
        self._full_names: dict[str, str] = {}  # the deftemplates' names with modules, by the names without
        base = make_base(options, VirtualClock())
        if sources is not None:
            base.bus.subscribe(sources, SourceRead)
        # No skill is executed, and the check continues after a mistake in one file.
        run_options = replace(options, skiller="none", strict=False)
        self.context = context = Run(run_options, base, is_inspection=True)
        with ExitStack() as cleanup:
            cleanup.callback(context.release)
            self.manager, self.executive = make_executive(context, StubbedEnvironment)
            cleanup.callback(self.close)
            assert isinstance(self.env, StubbedEnvironment)
            self.env.folders = self._search_folders = find_search_folders(options.scenario)
            self.executive.load_core()
            for name in unasked_features(context):
                self._request_feature(name)
            self._load_files()
            cleanup.pop_all()  # the agent is ready, and its user closes it

    @property
    def config(self) -> Configuration:
        return self.context.config

    @property
    def spec(self) -> str:
        """The name of the checked spec."""
        return self.context.spec

    @property
    def env(self) -> ClipsEnvironment:
        """The CLIPS environment, with all constructs and without the agent's facts."""
        return self.executive.env

    @property
    def own_files(self) -> list[ClipsFile]:
        """The files that are not part of the built-in core."""
        return [file for file in self.files if not file.is_core]

    @cached_property
    def own_constructs(self) -> list[Construct]:
        """The constructs that belong neither to the built-in core nor to Fawkes' core."""
        return [
            construct for construct in self.usage.constructs if not self.is_core_path(construct.file.path)
        ]

    def own_facts(self, template: str) -> list[FactUse]:
        """Return the facts of a template that the agent's own constructs assert."""
        asserted = self.usage.asserted_facts.get(template, ())
        return [fact for construct, fact in asserted if not self.is_core_path(construct.file.path)]

    @cached_property
    def model(self) -> AgentModel:
        """The names in all files."""
        model = AgentModel()
        for file in self.files:
            model.add_file(file.source)
        return model

    @cached_property
    def usage(self) -> Usage:
        """The facts and words in all constructs."""
        values = list(self.config.walk("/"))
        words = {word for value in values for text in (value.text, *value.items) for word in text.split()}
        functions = (
            definition.mention.name.text
            for definition in self.model.find_definitions_of_kind(NameKind.FUNCTION)
        )
        # The source of a run, such as a ROS 2 program, may call functions that no file calls.
        words.update(filter(self.context.source.calls, functions))
        core_templates = frozenset(
            mention.name.text
            for file in self.model.files
            if self.is_core_path(file.path)
            for mention in file.mentions
            if mention.name.kind is NameKind.TEMPLATE
        )
        constructs = tuple(construct for file in self.files for construct in file.all_constructs)
        return Usage(self.model, frozenset(words), self.deftemplates, core_templates, constructs)

    @cached_property
    def dropped_constructs(self) -> frozenset[tuple[str, str, str]]:
        """The constructs that CLIPS drops, as (file, keyword, name)."""
        return frozenset(
            (str(file.path), keyword, without_module(name))
            for file in self.files
            for diagnostic in file.diagnostics
            for keyword, _, name in [diagnostic.construct.partition(" ")]
        )

    def is_loaded(self, construct: Construct) -> bool:
        """Return whether CLIPS has the construct as its file defines it.

        Another check reports a dropped construct, and the end of an unclosed construct is a guess.
        """
        key = construct.file.path, construct.keyword, construct.name
        return construct.placed_piece.piece.is_closed and key not in self.dropped_constructs

    def is_core_path(self, file: str) -> bool:
        """Return whether a path belongs to the built-in core or to Fawkes' core."""
        folders = (self.context.paths.core_dir, *self.context.paths.override_dirs)
        return any(Path(file).is_relative_to(folder) for folder in folders)

    @cached_property
    def deftemplates(self) -> frozenset[str]:
        """The names of CLIPS' deftemplates in all modules, except those of ordered facts."""
        return frozenset(self._clips_slots)

    @cached_property
    def _clips_slots(self) -> dict[str, set[str]]:
        """The slot names by deftemplate in CLIPS. Two modules may have deftemplates with the same name."""
        slots: dict[str, set[str]] = {}
        for name in self.eval_words("(get-deftemplate-list *)"):
            slot_names = self.eval_words(f"(deftemplate-slot-names {name})")
            if slot_names != ["implied"]:  # the only slot of ordered facts
                self._full_names[without_module(name)] = name
                slots.setdefault(without_module(name), set()).update(slot_names)
        return slots

    def eval_words(self, expression: str) -> list[str]:
        """Return the texts of the fields in a multifield value; empty if the value has another type."""
        value = self.env.eval(expression)
        return list(map(str, value)) if isinstance(value, tuple) else []

    @cached_property
    def slots(self) -> dict[str, set[str]]:
        """The slot names by deftemplate, including deftemplates that CLIPS drops."""
        slots = {name: set(names) for name, names in self._clips_slots.items()}
        for definition in self.model.find_definitions_of_kind(NameKind.SLOT):
            slots.setdefault(definition.mention.name.owner, set()).add(definition.mention.name.text)
        return slots

    def allowed_values(self, template: str, slot: str) -> frozenset[str]:
        """Return the allowed values of a slot; empty if any value is allowed, or the slot is unknown."""
        if slot not in self._clips_slots.get(template, ()):
            return frozenset()
        name = self._full_names[template]
        return frozenset(self.eval_words(f"(deftemplate-slot-allowed-values {name} {slot})"))

    def action_mappings(self) -> Iterator[tuple[str, str, SourcePlace | None]]:
        """Yield each mapped action, the template of its skill string, and the position of the mapping.

        The position is None if a plug-in defines the mapping, not a configuration file.
        """
        for action, template in read_action_mapping(self.config, self.spec).items():
            key = f"/clips-executive/specs/{self.spec}/action-mapping/{action}"
            yield action, template, place_of(self.config.get(key)) if self.config.exists(key) else None

    def find_file(self, name: str) -> Path | None:
        """Resolve a file name as the agent does; return None if no folder has the file."""
        module = self._set_module(_MAIN_MODULE)  # a loaded file may have left another module current
        # A CLIPS program may run without the core.
        has_path_resolve = self.env.has_deffunction("path-resolve")
        resolved_path = self.env.call("path-resolve", name) if has_path_resolve else None
        self._set_module(module)
        if isinstance(resolved_path, str) and resolved_path != "FALSE":
            return Path(resolved_path)
        paths = [folder / name for folder in self._search_folders]
        return next(filter(is_readable_file, paths if has_path_resolve else [Path(name), *paths]), None)

    def find_feature(self, function: str) -> str:
        """Return a feature that provides a function and is not requested; empty if there is none.

        Call this after all files are loaded, because the tried features stay in the environment.
        """
        for feature in self.manager.features:
            if feature not in self._requested_features:
                self._request_feature(feature)
                if self.env.has_function(function):
                    return feature
        return ""

    # ---- loading

    def _load_files(self) -> None:
        """Load the files of the source, or else those of the core and the configuration, as a run does."""
        loaded_files = self.context.source.loaded_files(self.manager)
        if loaded_files is not None:
            for file in loaded_files:
                place = SourcePlace(file.mark.file, file.mark.line, file.mark.column)
                self.requested_files.append(RequestedFile(str(file.path), place))
                self._load_path(file.path, is_batch=file.is_batch)
            return
        # The constructor has loaded these two files. The order below is that of a run's initialisation.
        for name in ("saliences.clp", "init.clp"):
            self._add_file(self.context.paths.core_dir / name, ())
        self._request_feature("blackboard")
        for interface in self.config.get_strings(
            f"/clips-executive/specs/{self.spec}/blackboard-preload", default=[]
        ):
            self._preload_interface(interface)
        for stage in STAGES:
            for name in self._list_core_stage_files(stage):
                self._load_file(name, SourcePlace(_CORE_REQUEST))
            stage_path = f"/clips-executive/specs/{self.spec}/init/{stage}"
            for index in self.config.keys(stage_path):
                self._load_entry(stage, f"{stage_path}/{index}")

    def _list_core_stage_files(self, stage: str) -> tuple[str, ...]:
        """Return the files that the core loads before the entries of a stage."""
        if stage == STAGES[0] and self.context.source.has_fawkes_configuration:
            return (_BLACKBOARD_FILE,)
        if stage != STAGES[1]:
            return ()
        # Fawkes' core has a global variable in place of the function.
        has_function = self.env.has_deffunction("cx-stage2-files")
        return tuple(self.eval_words("(cx-stage2-files)" if has_function else "?*CX-STAGE2-FILES*"))

    def _load_entry(self, stage: str, path: str) -> None:
        """Load the file and request the feature of an entry of a stage.

        :param path: the path of the entry in the configuration.
        """
        name = self.config.get_str(f"{path}/name", default="")
        # As in Fawkes' init.clp, only entries of stage-1 request a feature by default.
        if self.config.get_bool(f"{path}/feature-request", default=stage == STAGES[0]):
            self._request_feature(name)
        for key in ("file", "files"):
            if not self.config.exists(f"{path}/{key}"):
                continue
            value = self.config.get(f"{path}/{key}")
            for file in value.items if value.is_list else (value.text,):
                # A scenario writes BATCH| itself, and has no search folders. The file of a CLIPS program is
                # in the first search folder.
                is_batch = any(needs_batch(folder / file) for folder in self._search_folders[:1])
                self._load_file(f"BATCH|{file}" if is_batch else file, place_of(value))
                # In a run, a function of MAIN loads each file, so a file cannot leave another module current.
                self._set_module(_MAIN_MODULE)

    def _set_module(self, module: Value) -> Value:
        """Make a module current and return the previous module."""
        return self.env.call("set-current-module", module)

    def _load_file(self, name: str, place: SourcePlace) -> None:
        """Load a requested file and the files that it loads, each once.

        :param name: the name of the file, with the prefix ``BATCH|`` for a file with commands.
        :param place: the position of the request.
        """
        loader_prefix, _, file_name = name.rpartition("|")
        path = self.find_file(file_name)
        requested_file = RequestedFile(file_name, place)
        if place.file != _CORE_REQUEST:
            self.requested_files.append(requested_file)
        if path is None:
            self.missing_files.append(requested_file)
        else:
            self._load_path(path, is_batch=loader_prefix.startswith("BATCH"))

    def _load_path(self, path: Path, *, is_batch: bool) -> None:
        """Load an existing file and the files that it loads.

        :param is_batch: whether CLIPS executes the file as commands, instead of loading its constructs.
        """
        if any(file.path == path for file in self.files):
            return
        loader = self.env.loader
        diagnostic_count, file_count = len(loader.diagnostics), len(loader.files)
        (loader.batch if is_batch else loader.load)(str(path))
        diagnostics = loader.diagnostics[diagnostic_count:]
        known_paths = {file.path for file in self.files}
        new_files = [
            self._add_file(
                new_path, tuple(diagnostic for diagnostic in diagnostics if diagnostic.file == str(new_path))
            )
            for new_path in dict.fromkeys((path, *loader.files[file_count:]))  # a batch file may load others
            if new_path not in known_paths
        ]
        # All new files are listed before the first request is carried out, so that a request for a new file
        # does not load the file again.
        for file in new_files:
            self._carry_out_requests(file)

    def _carry_out_requests(self, file: ClipsFile) -> None:
        """Load the files, request the features and open the interfaces that a loaded file names."""
        for call in file.find_calls("ff-feature-request"):
            self._request_feature(read_first_argument(call))
        for call in file.find_calls(*_INTERFACE_FUNCTIONS):
            interface = read_first_argument(call)
            if interface and not self._has_interface(interface):
                self.late_interfaces.setdefault(interface, frozenset(file.path for file in self.files))
            self._preload_interface(interface)
        for call in file.find_calls(*_LOAD_FUNCTIONS, *_BATCH_FUNCTIONS):
            if name := read_first_argument(call):
                prefix = "BATCH|" if call.head in _BATCH_FUNCTIONS else ""
                self._load_file(f"{prefix}{name}", file.place(call))

    def _add_file(self, path: Path, diagnostics: tuple[Diagnostic, ...]) -> ClipsFile:
        """Add a file that CLIPS has loaded to the list of files, and return the file."""
        text = path.read_text("utf-8", "surrogateescape")
        is_core = path.is_relative_to(self.context.paths.core_dir) and self.context.paths.has_builtin_core
        file = (_make_core_file if is_core else ClipsFile)(path, text, diagnostics)
        self.files.append(file)
        return file

    def _request_feature(self, feature: str) -> None:
        """Add a feature to the environment; unknown features have no effect, as in a run."""
        if feature in self.manager.features and feature not in self._requested_features:
            self._requested_features.add(feature)
            self.manager.request(self.env.name, feature)

    def _has_interface(self, interface: str) -> bool:
        """Return whether CLIPS has the deftemplate of an interface.

        The deftemplate of each interface has a slot ``id``. For the pattern of a rule that CLIPS drops, CLIPS
        itself makes a deftemplate of this name without slots.
        """
        has_template = self.env.has_template(interface)
        return has_template and "id" in self.eval_words(f"(deftemplate-slot-names {interface})")

    def _preload_interface(self, interface: str) -> None:
        """Add the deftemplate of an interface to the environment, as opening the interface in a run does.

        An empty type has no effect. The type is empty if it is computed, and thus known only in a run.
        """
        if interface:
            self.env.call("blackboard-preload", interface)

    # ---- closing

    def close(self) -> None:
        self.manager.close()
        self.context.close()


def place_of(value: ConfigValue) -> SourcePlace:
    """Return the position of a configuration value."""
    return SourcePlace(value.file, value.line, value.mark.column or 0)


def find_search_folders(path: Path | None) -> tuple[Path, ...]:
    """Return the folders to search for the files that a CLIPS program loads; empty for other paths."""
    is_program = path is not None and path.suffix == CLIPS_SUFFIX and path.is_file()
    return tuple(path.resolve().parents[:MAX_PARENT_FOLDERS]) if path is not None and is_program else ()


def needs_batch(file: Path) -> bool:
    """Return whether a file has commands outside of constructs, which CLIPS executes only with ``batch``."""
    return is_readable_file(file) and has_top_level_calls(file.read_text("utf-8", "surrogateescape"))


def find_agent_names(options: RunOptions) -> list[str | None]:
    """Return the agent of the options, or else the names of all agents of the scenario.

    The result is ``[None]`` for a single agent without a name.
    """
    if options.agent:
        return [options.agent]
    config, _ = source_of(options).load_configuration()
    return [*agent_names(config)] or [None]


def read_first_argument(call: SyntaxNode) -> str:
    """Return the literal first argument of a call; empty for a computed or missing argument.

    The argument may also be ``(path-resolve LITERAL)``.
    """
    if not call.arguments:
        return ""
    argument = call.arguments[0]
    return read_first_argument(argument) if argument.head == "path-resolve" else literal(argument)
