"""The agent under check: its configuration, and the CLIPS files that it loads, read by CLIPS, not run.

CLIPS itself reads the constructs, in the order in which the executive loads the files, in an environment with
the features that the agent asks for: a construct is wrong exactly when a run would drop it. No rule fires.
What rules do while the executive starts, as far as it matters for files that come later, is taken from their
text: files that they load, interfaces that they open (each brings a deftemplate), features that they request.
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
from cxbridge.executive.host.looking import LookEnvironment
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
MOST_FOLDERS: Final = 4
"""How many folders around a file may have its scenario, and the files that it loads."""


@dataclass(frozen=True)
class ClipsFile:
    """A CLIPS file of the agent.

    :param path: where it is.
    :param text: its content.
    :param diagnostics: CLIPS' messages when it read the file.
    :param is_core: whether it belongs to the executive's core.
    """

    path: Path
    text: str
    diagnostics: tuple[Diagnostic, ...]
    is_core: bool

    @cached_property
    def constructs(self) -> tuple[Definition, ...]:
        """The constructs that are closed, in their order."""
        return tuple(definitions(self.text))

    @cached_property
    def lines(self) -> Lines:
        """Its lines."""
        return Lines(self.text)

    def place(self, node: SyntaxNode) -> SourcePlace:
        """Return where a node of it begins."""
        return self.place_at(node.start)

    def place_at(self, offset: int) -> SourcePlace:
        """Return a place by its offset."""
        return SourcePlace(str(self.path), self.lines.at(offset), self.lines.column(offset))

    def calls(self, *names: str) -> Iterator[SyntaxNode]:
        """Yield the lists of the file that begin with one of these words."""
        for head, node in self._lists:
            if head in names:
                yield node

    @cached_property
    def _lists(self) -> tuple[tuple[str, SyntaxNode], ...]:
        """The lists in the constructs that begin with a word, each with that."""
        nodes = (node for construct in self.constructs for node in construct.node.walk())
        return tuple((node.head, node) for node in nodes if node.head)

    @cached_property
    def names(self) -> SourceFile | None:
        """The names in it."""
        return read_source(str(self.path), self.text)

    @cached_property
    def used(self) -> tuple[Construct, ...]:
        """Its constructs, with their uses; those that never close, too."""
        return () if self.names is None else constructs_of(self.names)


@cache
def _file_of_core(path: Path, text: str, diagnostics: tuple[Diagnostic, ...]) -> ClipsFile:
    """Return a file of the built-in core: the result is the same for all checked agents."""
    return ClipsFile(path, text, diagnostics, is_core=True)


@dataclass(frozen=True, slots=True)
class AskedFile:
    """A file that the agent wants to load.

    :param place: what asks for it.
    """

    name: str
    place: SourcePlace


@dataclass
class Agent(Closing):
    """An agent that is checked. A context manager.

    :param options: as those of a run.
    :param sources: gets the source files, when they are read.
    :raises CxbridgeError: when the configuration cannot be read, or names no spec.
    """

    options: RunOptions
    sources: Sink | None = None
    files: list[ClipsFile] = field(default_factory=list, init=False)
    asked: list[AskedFile] = field(default_factory=list, init=False)
    missing: list[AskedFile] = field(default_factory=list, init=False)
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
            self.manager, self.executive = make_executive(context, LookEnvironment)
            assert isinstance(self.env, LookEnvironment)
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
        """Whether a run would start the agent with its mistakes."""
        return source_of(self.options).is_lenient

    @property
    def config(self) -> Configuration:
        """The configuration."""
        return self.context.config

    @property
    def spec(self) -> str:
        """The spec that is checked."""
        return self.context.spec

    @property
    def env(self) -> ClipsEnvironment:
        """The environment that has all constructs and no facts of the agent."""
        return self.executive.env

    @property
    def own_files(self) -> list[ClipsFile]:
        """The files that are not the core's."""
        return [file for file in self.files if not file.is_core]

    @cached_property
    def model(self) -> AgentModel:
        """The names in the files."""
        model = AgentModel()
        for file in self.files:
            if file.names is not None:
                model.take(file.names)
        return model

    @cached_property
    def usage(self) -> Usage:
        """The uses of the constructs."""
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
        """The constructs that CLIPS drops: file, keyword and name."""
        return frozenset(
            (str(file.path), kind, without_module(name))
            for file in self.files
            for diagnostic in file.diagnostics
            for kind, _, name in [diagnostic.construct.partition(" ")]
        )

    def is_of_core(self, file: str) -> bool:
        """Whether a file is one of the core's, ours or Fawkes'."""
        folders = (self.context.paths.cx, *self.context.paths.before)
        return any(Path(file).is_relative_to(folder) for folder in folders)

    @cached_property
    def deftemplates(self) -> frozenset[str]:
        """The names of the deftemplates with slots that CLIPS has, in any module."""
        return frozenset(self._slots_of_clips)

    @cached_property
    def _slots_of_clips(self) -> dict[str, set[str]]:
        found = self.env.eval("(get-deftemplate-list *)")
        slots: dict[str, set[str]] = {}
        for name in map(str, found if isinstance(found, tuple) else ()):
            names = self.env.eval(f"(deftemplate-slot-names {name})")
            if isinstance(names, tuple) and names != ("implied",):
                self._full_names[without_module(name)] = name
                slots.setdefault(without_module(name), set()).update(map(str, names))
        return slots

    @cached_property
    def slots(self) -> dict[str, set[str]]:
        """The slots of all deftemplates: those that CLIPS has, and those that files define."""
        slots = {name: set(names) for name, names in self._slots_of_clips.items()}
        for each in self.model.defined(NameKind.SLOT):
            slots.setdefault(each.mention.name.owner, set()).add(each.mention.name.text)
        return slots

    def allowed(self, template: str, slot: str) -> frozenset[str]:
        """Return the values that a slot allows; none when it allows any, or they are unknown."""
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
        """How many fields the executive's facts (time ...) have."""
        now = self.env.call("now")
        return len(now) if isinstance(now, tuple) else 1

    @property
    def domains(self) -> list[Path]:
        """The existing PDDL domains that its files parse."""
        calls = (call for file in self.files for call in file.calls("parse-pddl-domain") if call.arguments)
        paths = (self.find(name) for call in calls if (name := self.text_of(call.arguments[0])))
        return [*dict.fromkeys(path for path in paths if path is not None)]

    def find(self, name: str) -> Path | None:
        """Return the file that the agent finds by a name; None when no folder has it."""
        module = self._enter(_MAIN)  # a file may have entered another one
        found = self.env.call("path-resolve", name) if self.env.has_deffunction("path-resolve") else None
        self._enter(module)
        if isinstance(found, str) and found != "FALSE":
            return Path(found)
        paths = [*((Path(name),) if found is None else ()), *(folder / name for folder in self._around)]
        return next(filter(is_readable_file, paths), None)  # None: an agent without our library

    def feature_with(self, function: str) -> str:
        """Return the feature that has a function and that the agent has not requested; empty when none has.

        It is to be asked when everything is loaded: the environment has the features afterwards.
        """
        for feature in self.manager.features:
            if feature not in self._requested:
                self._request(feature)
                if self.env.has_function(function):
                    return feature
        return ""

    def text_of(self, node: SyntaxNode) -> str:
        """Return what an expression is when that is written out; empty when it is computed."""
        return _written_text(node)

    # ---- loading

    def _load_files(self) -> None:
        own = self.context.source.loaded_files(self.manager)
        if own is not None:
            for each in own:
                place = SourcePlace(each.mark.file, each.mark.line, each.mark.column)
                self.asked.append(AskedFile(str(each.path), place))
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
        except ClipsError:  # Fawkes' core has a global only
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
                self._enter(_MAIN)  # as in a run, where functions of MAIN load each file

    def _enter(self, module: Value) -> Value:
        """Make a module the current one, in which names are found; return the one before."""
        return self.env.call("set-current-module", module)

    def _load(self, name: str, place: SourcePlace) -> None:
        """Load a file and those that it loads, each once."""
        how, _, bare = name.rpartition("|")
        found = self.find(bare)
        asked = AskedFile(bare, place)
        if place.file != _FROM_CORE:
            self.asked.append(asked)
        if found is None:
            self.missing.append(asked)
        else:
            self._load_found(found, batch=how.startswith("BATCH"))

    def _load_found(self, found: Path, *, batch: bool) -> None:
        """Load an existing file, and those that it loads."""
        if any(file.path == found for file in self.files):
            return
        loader = self.env.loader
        before, loaded = len(loader.diagnostics), len(loader.files)
        (loader.batch if batch else loader.load)(str(found))
        said = loader.diagnostics[before:]
        paths = dict.fromkeys((found, *loader.files[loaded:]))  # a batch loads files, too
        files = [
            self._note(path, tuple(each for each in said if each.file == str(path)))
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
                how = "BATCH|" if call.head in _BATCHES else ""
                self._load(f"{how}{literal}", file.place(call))

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
        """Give the environment the deftemplate of an interface, as opening it does."""
        if interface:
            self.env.call("blackboard-preload", interface)

    # ---- the end

    def close(self) -> None:
        """Release everything."""
        self.executive.close()
        self.manager.close()
        self.context.close()


class _VolatileMemory(RobotMemory):
    """A robot memory that opens neither a file nor a database."""

    def _open_store(self) -> Store:
        return EmbeddedStore(self.clock)


def place_of(value: ConfigValue) -> SourcePlace:
    """Return where a value of the configuration was read."""
    return SourcePlace(value.file, value.line, value.mark.column or 0)


def folders_around(program: Path | None) -> tuple[Path, ...]:
    """Return the folders where a program finds the files that its commands load; none for an agent."""
    is_program = program is not None and program.suffix == CLIPS_SUFFIX and program.is_file()
    return tuple(program.resolve().parents[:MOST_FOLDERS]) if program is not None and is_program else ()


def has_commands(file: Path) -> bool:
    """Whether a file is to be executed by CLIPS' ``batch``, since it has commands at its top level."""
    return is_readable_file(file) and syntax.has_commands(file.read_text("utf-8", "surrogateescape"))


def agents(options: RunOptions) -> list[str | None]:
    """Return the names of the agents of a scenario, None for the only one.

    :raises CxbridgeError: when the configuration cannot be read.
    """
    if options.agent:
        return [options.agent]
    return [*agent_names(source_of(options).load_configuration()[0])] or [None]


def _literal(call: SyntaxNode) -> str:
    """Return the text of the first argument of a call when it is written out; empty else."""
    if not call.arguments:
        return ""
    return _written_text(call.arguments[0])


def _written_text(node: SyntaxNode) -> str:
    if node.head == "path-resolve":
        return _literal(node)
    if node.items is not None or node.text.startswith(("?", "$?")):
        return ""
    return node.text[1:-1] if node.text.startswith('"') else node.text
