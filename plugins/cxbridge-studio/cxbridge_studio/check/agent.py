"""The agent under check: its configuration and its CLIPS files, loaded into CLIPS without running rules.

CLIPS reads the constructs in the order of a run, in an environment with the features that the agent requests.
A construct is wrong exactly when a run would drop it. Since no rule fires, actions that affect later files
are taken from the text of the rules: loaded files, opened interfaces (each adds a deftemplate), and requested
features.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext import syntax
from cxbridge.clipstext.syntax import Definition, Lines, SyntaxNode, definitions, without_module
from cxbridge.clock import VirtualClock
from cxbridge.closing import Closing
from cxbridge.config import Configuration, ConfigValue
from cxbridge.errors import ClipsError
from cxbridge.events import Sink, SourceRead
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.robmem.embedded import EmbeddedStore
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.file_access import is_readable_file
from cxbridge.run.agent import Run, make_base
from cxbridge.run.agents import agent_names
from cxbridge.run.components.executive import make_executive, unasked_features
from cxbridge.run.options import RunOptions
from cxbridge.run.source import CLIPS_SUFFIX, source_of
from cxbridge.run.specs import STAGES
from cxbridge_studio.agent.model import AgentModel, read_source
from cxbridge_studio.agent.names import NameKind, SourceFile
from cxbridge_studio.check.findings import SourcePlace
from cxbridge_studio.check.stubbed_environment import StubbedEnvironment
from cxbridge_studio.check.usage import Construct, Usage, constructs_of

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.robmem.store import Store

_LOADERS: Final = frozenset({"path-load", "path-load*", "load", "load*"})
_BATCHES: Final = frozenset({"path-batch", "path-batch*", "batch", "batch*"})
_INTERFACES: Final = frozenset(
    {"blackboard-preload", "blackboard-open", "blackboard-open-reading", "blackboard-open-writing"}
)
_FIRST_FILES: Final = "BATCH|blackboard-init.clp"
_FROM_CORE: Final = "the core"
_MAIN: Final = Symbol("MAIN")
# The number of parent folders of a CLIPS file to search for its scenario and its loaded files.
MAX_FOLDERS: Final = 4


@dataclass(frozen=True)
class ClipsFile:
    """A CLIPS file of the agent.

    :param diagnostics: CLIPS' messages about the file.
    :param is_core: whether the file belongs to the built-in core.
    """

    path: Path
    text: str
    diagnostics: tuple[Diagnostic, ...]
    is_core: bool

    @cached_property
    def constructs(self) -> tuple[Definition, ...]:
        """The closed constructs, in order."""
        return tuple(definitions(self.text))

    @cached_property
    def lines(self) -> Lines:
        return Lines(self.text)

    def place(self, node: SyntaxNode) -> SourcePlace:
        return self.place_at(node.start)

    def place_at(self, offset: int) -> SourcePlace:
        return SourcePlace(str(self.path), self.lines.at(offset), self.lines.column(offset))

    def calls(self, *names: str) -> Iterator[SyntaxNode]:
        """Yield the lists that begin with one of these words."""
        for head, node in self._lists:
            if head in names:
                yield node

    @cached_property
    def _lists(self) -> tuple[tuple[str, SyntaxNode], ...]:
        """All lists in the constructs, each with its first word."""
        nodes = (node for construct in self.constructs for node in construct.node.walk())
        return tuple((node.head, node) for node in nodes if node.head)

    @cached_property
    def names(self) -> SourceFile | None:
        """The names in the file; None for an unknown suffix."""
        return read_source(str(self.path), self.text)

    @cached_property
    def used(self) -> tuple[Construct, ...]:
        """The constructs with their uses, unclosed constructs included."""
        return () if self.names is None else constructs_of(self.names)


@cache
def _file_of_core(path: Path, text: str, diagnostics: tuple[Diagnostic, ...]) -> ClipsFile:
    """Return a file of the built-in core; the cache shares the file between agents."""
    return ClipsFile(path, text, diagnostics, is_core=True)


@dataclass(frozen=True, slots=True)
class RequestedFile:
    """A file that the agent loads.

    :param place: the position of the load command or configuration entry.
    """

    name: str
    place: SourcePlace


@dataclass
class Agent(Closing):
    """An agent under check. A context manager.

    :param sources: receives each source file when it is read.
    """

    options: RunOptions
    sources: Sink | None = None
    files: list[ClipsFile] = field(default_factory=list, init=False)
    asked: list[RequestedFile] = field(default_factory=list, init=False)
    missing: list[RequestedFile] = field(default_factory=list, init=False)
    _requested: set[str] = field(default_factory=set, init=False)
    _allowed: dict[tuple[str, str], frozenset[str]] = field(default_factory=dict, init=False)
    _full_names: dict[str, str] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        base = make_base(self.options, VirtualClock())
        if self.sources is not None:
            base.bus.subscribe(self.sources, SourceRead)
        options = replace(self.options, skiller="none", strict=False)
        self.context = context = Run(options, base, is_look=True)
        context.memory = _VolatileMemory(context.config, context.clock, context.bus, context.board)
        try:
            self.manager, self.executive = make_executive(context, StubbedEnvironment)
            assert isinstance(self.env, StubbedEnvironment)
            self.env.folders = self._around = folders_around(options.scenario)
            try:
                self.executive.load_core()
                for name in unasked_features(context):
                    self._request(name)
                self._load_files()
            except Exception:
                self.close()
                raise
        except Exception:
            context.release()
            raise

    @property
    def is_lenient(self) -> bool:
        """Whether a run starts the agent despite errors."""
        return source_of(self.options).is_lenient

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
    def model(self) -> AgentModel:
        """The names in all files."""
        model = AgentModel()
        for file in self.files:
            if file.names is not None:
                model.take(file.names)
        return model

    @cached_property
    def usage(self) -> Usage:
        """The uses of all constructs."""
        values = list(self.config.walk("/"))
        words = {word for each in values for text in (each.text, *each.items) for word in text.split()}
        functions = (each.mention.name.text for each in self.model.defined(NameKind.FUNCTION))
        words.update(filter(self.context.source.calls, functions))
        of_core = (
            mention.name.text
            for file in self.model.files
            if self.is_of_core(file.path)
            for mention in file.mentions
            if mention.name.kind is NameKind.TEMPLATE
        )
        constructs = tuple(construct for file in self.files for construct in file.used)
        return Usage(self.model, frozenset(words), self.deftemplates, frozenset(of_core), constructs)

    @cached_property
    def dropped(self) -> frozenset[tuple[str, str, str]]:
        """The constructs that CLIPS drops, as (file, keyword, name)."""
        return frozenset(
            (str(file.path), kind, without_module(name))
            for file in self.files
            for diagnostic in file.diagnostics
            for kind, _, name in [diagnostic.construct.partition(" ")]
        )

    def is_of_core(self, file: str) -> bool:
        """Return whether a file belongs to the built-in core or to Fawkes' core."""
        folders = (self.context.paths.cx, *self.context.paths.before)
        return any(Path(file).is_relative_to(folder) for folder in folders)

    @cached_property
    def deftemplates(self) -> frozenset[str]:
        """The names of CLIPS' deftemplates with slots, in any module."""
        return frozenset(self._slots_of_clips)

    @cached_property
    def _slots_of_clips(self) -> dict[str, set[str]]:
        template_names = self.env.eval("(get-deftemplate-list *)")
        slots: dict[str, set[str]] = {}
        for name in map(str, template_names if isinstance(template_names, tuple) else ()):
            names = self.env.eval(f"(deftemplate-slot-names {name})")
            if isinstance(names, tuple) and names != ("implied",):
                self._full_names[without_module(name)] = name
                slots.setdefault(without_module(name), set()).update(map(str, names))
        return slots

    @cached_property
    def slots(self) -> dict[str, set[str]]:
        """The slots by deftemplate, of deftemplates in CLIPS and in dropped constructs."""
        slots = {name: set(names) for name, names in self._slots_of_clips.items()}
        for each in self.model.defined(NameKind.SLOT):
            slots.setdefault(each.mention.name.owner, set()).add(each.mention.name.text)
        return slots

    def allowed(self, template: str, slot: str) -> frozenset[str]:
        """Return the allowed values of a slot; empty if any value is allowed or the slot is unknown."""
        key = template, slot
        if key not in self._allowed:
            found = ()
            if slot in self._slots_of_clips.get(template, ()):
                name = self._full_names[template]
                found = self.env.eval(f"(deftemplate-slot-allowed-values {name} {slot})")
            self._allowed[key] = frozenset(map(str, found)) if isinstance(found, tuple) else frozenset()
        return self._allowed[key]

    @property
    def time_fields(self) -> int:
        """The number of fields in the executive's (time ...) facts."""
        now = self.env.call("now")
        return len(now) if isinstance(now, tuple) else 1

    @property
    def domains(self) -> list[Path]:
        """The existing PDDL domains that the files parse."""
        calls = (call for file in self.files for call in file.calls("parse-pddl-domain") if call.arguments)
        paths = (self.find(name) for call in calls if (name := self.text_of(call.arguments[0])))
        return [*dict.fromkeys(path for path in paths if path is not None)]

    def find(self, name: str) -> Path | None:
        """Resolve a file name as the agent does; return None if no folder has the file."""
        module = self._enter(_MAIN)  # a loaded file may have left another module current
        resolved_path = (
            self.env.call("path-resolve", name) if self.env.has_deffunction("path-resolve") else None
        )
        self._enter(module)
        if isinstance(resolved_path, str) and resolved_path != "FALSE":
            return Path(resolved_path)
        paths = [
            *((Path(name),) if resolved_path is None else ()),
            *(folder / name for folder in self._around),
        ]
        # `path-resolve` is missing: a CLIPS program without our library
        return next(filter(is_readable_file, paths), None)

    def feature_with(self, function: str) -> str:
        """Return the first unrequested feature that provides a function; empty if none does.

        Call this after loading all files: the features tried stay in the environment.
        """
        for feature in self.manager.features:
            if feature not in self._requested:
                self._request(feature)
                if self.env.has_function(function):
                    return feature
        return ""

    def text_of(self, node: SyntaxNode) -> str:
        """Return the value of a literal expression; empty for a computed value."""
        return _written_text(node)

    # ---- loading

    def _load_files(self) -> None:
        loaded_files = self.context.source.loaded_files(self.manager)
        if loaded_files is not None:
            for each in loaded_files:
                place = SourcePlace(each.mark.file, each.mark.line, each.mark.column)
                self.asked.append(RequestedFile(str(each.path), place))
                self._load_found(each.path, batch=each.is_batch)
            return
        for name in ("saliences.clp", "init.clp"):
            self._note(self.context.paths.cx / name, ())
        self._request("blackboard")
        for interface in self.config.get_strings(
            f"/clips-executive/specs/{self.spec}/blackboard-preload", default=[]
        ):
            self._preload(interface)
        for stage in STAGES:
            for name in self._core_files(stage):
                self._load(name, SourcePlace(_FROM_CORE))
            for path in self._entries(stage):
                self._load_entry(stage, path)

    def _core_files(self, stage: str) -> tuple[str, ...]:
        """Return the files that the core loads before the entries of a stage."""
        if stage == STAGES[0]:
            return (_FIRST_FILES,) if self.context.source.has_fawkes_configuration else ()
        if stage != STAGES[1]:
            return ()
        try:
            files = self.env.call("cx-stage2-files")
        except ClipsError:  # Fawkes' core has a global variable instead of the function
            files = self.env.eval("?*CX-STAGE2-FILES*")
        return tuple(map(str, files)) if isinstance(files, tuple) else ()

    def _entries(self, stage: str) -> list[str]:
        base = f"/clips-executive/specs/{self.spec}/init/{stage}"
        return [f"{base}/{index}" for index in self.config.keys(base)]

    def _load_entry(self, stage: str, path: str) -> None:
        name = self.config.get_str(f"{path}/name", default="")
        if self.config.get_bool(f"{path}/feature-request", default=stage == STAGES[0]):
            self._request(name)
        for key in ("file", "files"):
            if not self.config.exists(f"{path}/{key}"):
                continue
            value = self.config.get(f"{path}/{key}")
            for file in value.items if value.is_list else (value.text,):
                is_batch = bool(self._around) and has_commands(self._around[0] / file)
                self._load(f"BATCH|{file}" if is_batch else file, place_of(value))
                self._enter(_MAIN)  # In a run, functions of MAIN load each file.

    def _enter(self, module: Value) -> Value:
        """Make a module current and return the previous one."""
        return self.env.call("set-current-module", module)

    def _load(self, name: str, place: SourcePlace) -> None:
        """Load a file and its loaded files, each once."""
        loader_prefix, _, bare = name.rpartition("|")
        path = self.find(bare)
        asked_file = RequestedFile(bare, place)
        if place.file != _FROM_CORE:
            self.asked.append(asked_file)
        if path is None:
            self.missing.append(asked_file)
        else:
            self._load_found(path, batch=loader_prefix.startswith("BATCH"))

    def _load_found(self, found: Path, *, batch: bool) -> None:
        """Load an existing file and its loaded files."""
        if any(file.path == found for file in self.files):
            return
        loader = self.env.loader
        known_diagnostics, known_files = len(loader.diagnostics), len(loader.files)
        (loader.batch if batch else loader.load)(str(found))
        new_diagnostics = loader.diagnostics[known_diagnostics:]
        paths = dict.fromkeys((found, *loader.files[known_files:]))  # a batch file loads further files
        files = [
            self._note(path, tuple(each for each in new_diagnostics if each.file == str(path)))
            for path in paths
            if all(file.path != path for file in self.files)
        ]
        for file in files:
            self._follow(file)

    def _follow(self, file: ClipsFile) -> None:
        """Carry out the requests of a loaded file: load files, request features, open interfaces."""
        for call in file.calls("ff-feature-request"):
            self._request(_literal(call))
        for call in file.calls(*_INTERFACES):
            self._preload(_literal(call))
        for call in file.calls(*_LOADERS, *_BATCHES):
            if literal := _literal(call):
                prefix = "BATCH|" if call.head in _BATCHES else ""
                self._load(f"{prefix}{literal}", file.place(call))

    def _note(self, path: Path, diagnostics: tuple[Diagnostic, ...]) -> ClipsFile:
        text = path.read_text("utf-8", "surrogateescape")
        is_core = path.is_relative_to(self.context.paths.cx) and self.context.paths.builtin
        if is_core:
            file = _file_of_core(path, text, diagnostics)
        else:
            file = ClipsFile(path, text, diagnostics, is_core=False)
        self.files.append(file)
        return file

    def _request(self, feature: str) -> None:
        if feature in self.manager.features and feature not in self._requested:
            self._requested.add(feature)
            self.manager.request(self.env.name, feature)

    def _preload(self, interface: str) -> None:
        """Add the deftemplate of an interface to the environment, as opening the interface does."""
        if interface:
            self.env.call("blackboard-preload", interface)

    # ---- closing

    def close(self) -> None:
        self.executive.close()
        self.manager.close()
        self.context.close()


class _VolatileMemory(RobotMemory):
    """A robot memory in process memory: the check must not open the agent's file or database."""

    def _open_store(self) -> Store:
        return EmbeddedStore(self.clock)


def place_of(value: ConfigValue) -> SourcePlace:
    """Return the position of a configuration value."""
    return SourcePlace(value.file, value.line, value.mark.column or 0)


def folders_around(program: Path | None) -> tuple[Path, ...]:
    """Return the folders to search for files that a CLIPS program loads; empty for an agent."""
    is_program = program is not None and program.suffix == CLIPS_SUFFIX and program.is_file()
    return tuple(program.resolve().parents[:MAX_FOLDERS]) if program is not None and is_program else ()


def has_commands(file: Path) -> bool:
    """Return whether a file has top-level commands, so that CLIPS must load it with ``batch``."""
    return is_readable_file(file) and syntax.has_commands(file.read_text("utf-8", "surrogateescape"))


def agents(options: RunOptions) -> list[str | None]:
    """Return the names of a scenario's agents; ``[None]`` for a single agent."""
    if options.agent:
        return [options.agent]
    return [*agent_names(source_of(options).load_configuration()[0])] or [None]


def _literal(call: SyntaxNode) -> str:
    """Return the literal first argument of a call; empty for a computed argument."""
    if not call.arguments:
        return ""
    return _written_text(call.arguments[0])


def _written_text(node: SyntaxNode) -> str:
    if node.head == "path-resolve":
        return _literal(node)
    if node.items is not None or node.text.startswith(("?", "$?")):
        return ""
    return node.text[1:-1] if node.text.startswith('"') else node.text
