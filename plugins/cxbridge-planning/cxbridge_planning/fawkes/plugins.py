"""Fawkes' plugins ``pddl-robot-memory`` and ``pddl-planner``, which plan on request over the blackboard.

``pddl-robot-memory``, the generator, fills a template with documents of the robot memory, and so writes a
PDDL problem. ``pddl-planner`` reads the problem, plans, and stores the plan in the robot memory. Each has an
interface for requests and status. docs/planning.md lists the differences from Fawkes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from cxbridge.blackboard import BlackBoard
from cxbridge.closing import Closing
from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.events import EventBus
from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.pddl.decoding import read_text
from cxbridge_planning.call_events import PlannerCallReporter
from cxbridge_planning.fawkes.templates import ProblemTemplate
from cxbridge_planning.planner import PlanResult, PlanStatus
from cxbridge_planning.registry import AUTO, make_planner, planner_names
from cxbridge_planning.service.service import PlanCall, PlanningService, PlanRequest
from cxbridge_planning.settings import PlannerSettings
from cxbridge_robot_memory.store import Store

_GENERATOR_KEY: Final = "/plugins/pddl-robot-memory"
_PLANNER_KEY: Final = "/plugins/pddl-planner"
_EMPTY_GOAL: Final = "(and)"  # a goal that always holds
# The length of the field `active_planner` in the interface, without the final NUL.
_MAX_NAME_LENGTH: Final = 29


@dataclass(frozen=True, slots=True)
class ProblemFiles:
    """The problems that the generator writes and the planner reads: in memory, and optionally on disk.

    :param substitutions: the values of ``@BASEDIR@`` and other placeholders.
    :param folder: the base of relative paths.
    :param writes_to_disk: whether generated problems are also written to disk.
    """

    substitutions: Mapping[str, str]
    folder: Path
    writes_to_disk: bool = False
    _texts: dict[Path, str] = field(default_factory=dict)

    def resolve(self, *path_parts: str) -> Path:
        """Return the path of a file in the configuration.

        :param path_parts: the parts of the path, which are joined without a separator. Blanks and quotes at
            the ends of a part are removed.
        """
        # Fawkes' configuration quotes some of these values within YAML
        text = "".join(part.strip().strip('"').strip() for part in path_parts)
        for placeholder, value in self.substitutions.items():
            text = text.replace(placeholder, value)
        return (self.folder / text).resolve()

    def write(self, path: Path, text: str) -> None:
        """Store the text of a problem.

        :raises OSError: if the text cannot be written to disk.
        """
        self._texts[path] = text
        if self.writes_to_disk:
            path.write_text(text, encoding="utf-8")

    def read(self, path: Path, kind: str) -> str:
        """Return the stored text of a problem, or the content of a file.

        :param kind: the expected content, for the error.
        :raises PddlError: if the file cannot be read.
        """
        return self._texts.get(path) or read_text(path, kind)


class _Plugin(Closing):
    """A plugin with an interface for requests and status.

    :param name: the name of the plugin in the log, and of the writer of its interface.
    """

    _interface: Any  # the class of the interface is made from XML at run time, so it has no static type

    def __init__(
        self, name: str, board: BlackBoard, bus: EventBus, store: Store, files: ProblemFiles
    ) -> None:
        self._name, self._log = name, bus.logger(name)
        self._board, self._bus, self._store, self._files = board, bus, store, files

    def _open_interface(self, interface_type: str, name: str, **fields: Any) -> None:
        """Open the interface for writing, and write its first fields.

        The caller must read all settings before: an error of a setting would leave the interface open.

        :raises BlackBoardError: if the interface has another writer.
        """
        self._interface = self._board.open_for_writing(interface_type, name, owner=self._name)
        self._write_fields(**fields)

    def _write_fields(self, **fields: Any) -> None:
        for name, value in fields.items():
            self._interface.set(name, value)
        self._interface.write()

    def _take_requests(self, message_type: str) -> Iterator[Any]:
        """Yield the requests in the interface's queue; drop messages of other types."""
        while (message := self._interface.msgq_first()) is not None:
            if message.type == message_type:
                yield message
            self._interface.msgq_pop()

    def _read_source(self, file: Path, kind: str) -> str:
        """Return the text of a file or a stored problem, and emit the text as a source of the run.

        :param kind: the expected content; its last word is the kind of the source.
        """
        text = self._files.read(file, kind)
        self._bus.emit_source("pddl", "", str(file), text.encode(), kind=kind.rpartition(" ")[2])
        return text

    def close(self) -> None:
        self._board.close(self._interface)


class PddlRobotMemory(_Plugin):
    """The generator: writes ``PddlGenInterface`` and fills the template of the problem.

    :raises BlackBoardError: if the interface has another writer.
    :raises ConfigError: if a setting is missing or has the wrong type.
    """

    def __init__(
        self, board: BlackBoard, bus: EventBus, config: Configuration, store: Store, files: ProblemFiles
    ) -> None:
        super().__init__("PddlRobotMemory", board, bus, store, files)
        self._collection = config.get_str(f"{_GENERATOR_KEY}/collection")
        # Fawkes looks for the files in @BASEDIR@/src
        source_folder = "src" if "@BASEDIR@" in files.substitutions else ""
        base = Path(files.substitutions.get("@BASEDIR@", str(files.folder)), source_folder)
        self._template_file, self._problem_file = (
            self._find_file(base, config.get_str(f"{_GENERATOR_KEY}/{key}"))
            for key in ("input-problem-description", "output-problem-description")
        )
        self._goal = config.get_str(f"{_GENERATOR_KEY}/goal", default="")
        self._is_requested = config.get_bool(f"{_GENERATOR_KEY}/generate-on-init", default=False)
        name = config.get_str(f"{_GENERATOR_KEY}/interface-name", default="pddl-gen")
        self._open_interface("PddlGenInterface", name)

    def _find_file(self, base: Path, text: str) -> Path:
        """Return a file in the scenario's folder, or in ``base``, the folder where Fawkes looks for it.

        The file is in ``base`` only if the scenario's folder lacks the file and ``base`` is a folder.

        :param text: the path in the configuration.
        """
        path = self._files.resolve(text)
        return path if path.exists() or not base.is_dir() else self._files.resolve(str(base / text.strip()))

    def loop(self) -> None:
        """Handle requests. The main loop calls this method in each cycle."""
        if self._is_requested:
            self._is_requested = False
            self._write_problem()
            self._write_fields(final=True)
        for message in self._take_requests("GenerateMessage"):
            self._goal = message.goal or self._goal
            self._write_fields(msg_id=message.id, final=False)
            # the problem is written in the next loop, so that readers see `final` become false before
            self._is_requested = True

    def _write_problem(self) -> None:
        """Fill the template and write the problem; log an error."""
        try:
            template_text = self._read_source(self._template_file, "problem template")
            template = ProblemTemplate(template_text, str(self._template_file))
            for warning in template.warnings:
                self._log.error(warning)
            documents = {
                name: self._store.find(self._collection, query) for name, query in template.queries.items()
            }
            text = template.fill(documents, {"GOAL": self._goal or _EMPTY_GOAL})
            self._files.write(self._problem_file, text)
        except CxbridgeError as error:
            self._log.error(f"Cannot generate the problem: {error}")
        except OSError as error:
            self._log.error(f"Cannot write the problem {self._problem_file}: {error.strerror}")
        else:
            self._log.info(f"Finished generation of problem {self._problem_file.name}")


class PddlPlanner(_Plugin):
    """Writes ``PddlPlannerInterface``: plans, and stores the plan in the robot memory.

    :param service: makes the plans.
    :raises BlackBoardError: if the interface has another writer.
    :raises ConfigError: if a setting is missing or has the wrong type.
    """

    def __init__(
        self,
        board: BlackBoard,
        bus: EventBus,
        config: Configuration,
        store: Store,
        files: ProblemFiles,
        service: PlanningService,
    ) -> None:
        super().__init__("PddlPlanner", board, bus, store, files)
        folder = config.get_str(f"{_PLANNER_KEY}/description-folder")
        self._domain_file, self._problem_file = (
            files.resolve(folder, config.get_str(f"{_PLANNER_KEY}/{key}"))
            for key in ("domain-description", "problem-description")
        )
        self._collection = config.get_str(f"{_PLANNER_KEY}/collection", default="robmem.pddl-plan")
        self._timeout = PlannerSettings.from_config(config).timeout
        configured_planner = config.get_str(f"{_PLANNER_KEY}/planner", default=AUTO)
        self._planner = self._find_usable_planner(configured_planner)
        # Fawkes' options are those of Fast Downward, which is called fd
        options = config.get_str(f"{_PLANNER_KEY}/fd-search-opts", default="").strip()
        self._options = {"options": options} if self._planner == "fd" and options else {}
        self._service = service
        self._service.warm_up()
        # the call without a result, and its reporter
        self._running_call: tuple[PlanCall, PlannerCallReporter] | None = None
        name = config.get_str(f"{_PLANNER_KEY}/interface-name", default="pddl-planner")
        active_planner = configured_planner[:_MAX_NAME_LENGTH]
        self._open_interface("PddlPlannerInterface", name, active_planner=active_planner)

    def _find_usable_planner(self, name: str) -> str:
        """Return a planner's name, or ``auto`` if the planner is unknown or not installed."""
        if name == AUTO:
            return name
        is_known = name in planner_names()
        reason = make_planner(name).unavailable_reason if is_known else f"planner '{name}' is unknown"
        if reason:
            self._log.warn(f"{reason}: the first planner that supports the problem is used")
        return AUTO if reason else name

    def loop(self) -> None:
        """Handle requests. The main loop calls this method in each cycle."""
        if self._running_call is not None:
            call, reporter = self._running_call
            # a virtual clock does not advance during the call, so that runs are reproducible
            result = call.wait() if self._bus.clock.is_virtual else call.result
            if result is not None:
                self._running_call = None
                reporter.report_end(result)
                self._store_result(result)
        for message in self._take_requests("PlanMessage"):
            self._start_request(message.id)

    def _start_request(self, message_id: int) -> None:
        """Start to plan for a message; cancel the running call."""
        if self._running_call is not None:
            call, reporter = self._running_call
            self._running_call = None
            call.cancel()
            reporter.report_end(
                PlanResult(PlanStatus.CANCELLED, self._planner, message="another call replaced it")
            )
        self._write_fields(msg_id=message_id, final=False, success=False)
        try:
            domain = parse_domain(self._read_source(self._domain_file, "domain"), self._domain_file)
            problem = parse_problem(
                self._read_source(self._problem_file, "problem"), domain, self._problem_file
            )
        except PddlError as error:
            self._make_reporter("", str(self._problem_file)).report_refusal(str(error))
            self._store_result(PlanResult(PlanStatus.FAILED, self._planner, message=str(error)))
            return
        request = PlanRequest(domain, problem, self._planner, self._options, self._timeout)
        reporter = self._make_reporter(domain.name, problem.name)
        reporter.report_start(f"message-{message_id}")
        self._running_call = (self._service.call(request), reporter)

    def _make_reporter(self, domain: str, problem: str) -> PlannerCallReporter:
        # without environment and goal, because requests come over the blackboard
        return PlannerCallReporter(
            self._bus, env="", goal="nil", planner=self._planner, domain=domain, problem=problem
        )

    def _store_result(self, result: PlanResult) -> None:
        """Store the plan, or its absence, in the robot memory, then update the interface."""
        # as in Fawkes, agents cannot distinguish an empty plan from a missing plan
        has_succeeded = result.status is PlanStatus.PLANNED and bool(result.actions)
        if has_succeeded:
            actions = [{"name": step.name, "args": list(step.arguments)} for step in result.actions]
            document = {"plan": 1, "msg_id": self._interface.msg_id, "actions": actions}
            self._log.info(f"{result.planner} found a plan of {len(actions)} actions")
        else:
            document = {"plan": 0}
            self._log.error(f"No plan: {result.message or 'the goal holds already'}")
        try:
            self._store.insert(self._collection, document)
        except CxbridgeError as error:
            self._log.error(f"Cannot store the plan: {error}")
            has_succeeded = False
        self._write_fields(final=True, success=has_succeeded)

    def close(self) -> None:
        """Cancel all planning and close the interface."""
        self._service.close()
        if self._running_call is not None:
            call, reporter = self._running_call
            if call.result is not None:
                reporter.report_end(call.result)
        super().close()
