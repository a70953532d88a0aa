"""Fawkes' plugins ``pddl-robot-memory`` and ``pddl-planner``, which plan on request over the blackboard.

``pddl-robot-memory``, the generator, fills a template with documents of the robot memory, and so writes a
PDDL problem. ``pddl-planner`` reads the problem, plans, and stores the plan in the robot memory. Each has an
interface for requests and status. docs/planning.md lists the differences from Fawkes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from cxbridge.blackboard import BlackBoard
from cxbridge.clock import Clock
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

    def resolve(self, *values: str) -> Path:
        """Return the path of a file in the configuration.

        :param values: the values of the configuration, which the path joins without blanks and quotes around
            them.
        """
        # Fawkes' configuration quotes some of these values within YAML
        text = "".join(value.strip().strip('"').strip() for value in values)
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

    def read(self, path: Path) -> str:
        """Return the stored text of a problem, or the content of its file.

        :raises PddlError: if the file cannot be read.
        """
        return self._texts.get(path) or read_text(path, "problem")


class PddlRobotMemory:
    """The generator: writes ``PddlGenInterface`` and fills the template of the problem.

    :raises BlackBoardError: if the interface has another writer.
    :raises ConfigError: if a setting is missing.
    """

    def __init__(
        self, board: BlackBoard, bus: EventBus, config: Configuration, store: Store, files: ProblemFiles
    ) -> None:
        self._board = board
        self._bus = bus
        self._log = bus.logger("PddlRobotMemory")
        self._store = store
        self._files = files
        self._collection = config.get_str(f"{_GENERATOR_KEY}/collection")
        source = Path("src") if "@BASEDIR@" in files.substitutions else Path()
        base = Path(files.substitutions.get("@BASEDIR@", str(files.folder))) / source
        template_path = config.get_str(f"{_GENERATOR_KEY}/input-problem-description")
        self._template_file = self._find_file(base, template_path)
        self._problem_file = self._find_file(
            base, config.get_str(f"{_GENERATOR_KEY}/output-problem-description")
        )
        self._goal = config.get_str(f"{_GENERATOR_KEY}/goal", default="")
        name = config.get_str(f"{_GENERATOR_KEY}/interface-name", default="pddl-gen")
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing("PddlGenInterface", name, owner="PddlRobotMemory")
        self._interface.write()
        self._is_requested = config.get_bool(f"{_GENERATOR_KEY}/generate-on-init", default=False)

    def _find_file(self, base: Path, text: str) -> Path:
        """Return a file in the scenario's folder if it exists there, or else in ``base``, Fawkes' sources."""
        path = self._files.resolve(text)
        return path if path.exists() or not base.is_dir() else self._files.resolve(str(base / text.strip()))

    def loop(self) -> None:
        """Handle requests. To be called once per main loop."""
        if self._is_requested:
            self._is_requested = False
            self._write_problem()
            self._interface.final = True
            self._interface.write()
        while (message := self._interface.msgq_first()) is not None:
            if message.type == "GenerateMessage":
                self._goal = message.goal or self._goal
                self._interface.msg_id = message.id
                self._interface.final = False
                self._interface.write()
                # the problem is written in the next loop, so that readers see `final` become false before
                self._is_requested = True
            self._interface.msgq_pop()

    def _write_problem(self) -> None:
        """Fill the template and write the problem; log an error."""
        try:
            source = read_text(self._template_file, "problem template")
            self._bus.emit_source("pddl", "", str(self._template_file), source.encode(), kind="template")
            template = ProblemTemplate(source, str(self._template_file))
            for warning in template.warnings:
                self._log.error(warning)
            text = template.fill(
                lambda queries: {
                    name: self._store.find(self._collection, query) for name, query in queries.items()
                },
                {"GOAL": self._goal or _EMPTY_GOAL},
            )
            self._files.write(self._problem_file, text)
        except CxbridgeError as error:
            self._log.error(f"Cannot generate the problem: {error}")
        except OSError as error:
            self._log.error(f"Cannot write the problem {self._problem_file}: {error.strerror}")
        else:
            self._log.info(f"Finished generation of problem {self._problem_file.name}")

    def close(self) -> None:
        self._board.close(self._interface)


class PddlPlanner:
    """Writes ``PddlPlannerInterface``: plans, and stores the plan in the robot memory.

    :param service: makes the plans.
    :raises BlackBoardError: if the interface has another writer.
    :raises ConfigError: if a setting is missing.
    """

    def __init__(
        self,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        config: Configuration,
        store: Store,
        files: ProblemFiles,
        service: PlanningService,
    ) -> None:
        self._board = board
        self._clock = clock
        self._bus = bus
        self._log = bus.logger("PddlPlanner")
        self._store = store
        self._files = files
        folder = config.get_str(f"{_PLANNER_KEY}/description-folder")
        self._domain_file = files.resolve(folder, config.get_str(f"{_PLANNER_KEY}/domain-description"))
        self._problem_file = files.resolve(folder, config.get_str(f"{_PLANNER_KEY}/problem-description"))
        self._collection = config.get_str(f"{_PLANNER_KEY}/collection", default="robmem.pddl-plan")
        self._settings = PlannerSettings.from_config(config)
        configured = config.get_str(f"{_PLANNER_KEY}/planner", default=AUTO)
        self._planner = self._usable_planner(configured)
        # Fawkes' options are those of Fast Downward, which is called fd
        options = config.get_str(f"{_PLANNER_KEY}/fd-search-opts", default="").strip()
        self._options = {"options": options} if self._planner == "fd" and options else {}
        self._service = service
        self._service.warm_up()
        self._running: tuple[PlanCall, PlannerCallReporter] | None = None
        name = config.get_str(f"{_PLANNER_KEY}/interface-name", default="pddl-planner")
        self._interface: Any = board.open_for_writing("PddlPlannerInterface", name, owner="PddlPlanner")
        self._interface.set("active_planner", configured[:_MAX_NAME_LENGTH])
        self._interface.write()

    def _usable_planner(self, name: str) -> str:
        """Return the configured planner, or ``auto`` if it is not installed."""
        if name == AUTO:
            return name
        exists = name in planner_names()
        reason = make_planner(name).not_installed if exists else f"planner '{name}' is unknown"
        if reason:
            self._log.warn(f"{reason}: the first planner that supports the problem is used")
            return AUTO
        return name

    def loop(self) -> None:
        """Handle requests. To be called once per main loop."""
        if self._running is not None:
            call, reporter = self._running
            # a virtual clock does not advance during the call, so that runs are reproducible
            result = call.wait() if self._clock.is_virtual else call.result
            if result is not None:
                self._running = None
                reporter.report_end(result)
                self._store_result(result)
        while (message := self._interface.msgq_first()) is not None:
            if message.type == "PlanMessage":
                self._start_request(message.id)
            self._interface.msgq_pop()

    def _start_request(self, message_id: int) -> None:
        """Start to plan for a message; cancel the running call."""
        if self._running is not None:
            call, reporter = self._running
            self._running = None
            call.cancel()
            reporter.report_end(
                PlanResult(PlanStatus.CANCELLED, self._planner, message="another call replaced it")
            )
        self._interface.msg_id = message_id
        self._interface.final = False
        self._interface.success = False
        self._interface.write()
        try:
            source = read_text(self._domain_file, "domain")
            self._bus.emit_source("pddl", "", str(self._domain_file), source.encode(), kind="domain")
            domain = parse_domain(source, str(self._domain_file))
            source = self._files.read(self._problem_file)
            self._bus.emit_source("pddl", "", str(self._problem_file), source.encode(), kind="problem")
            problem = parse_problem(source, domain, self._problem_file)
        except PddlError as error:
            # no environment and no goal: the request came over the blackboard
            reporter = PlannerCallReporter(
                self._bus, "", "", "nil", self._planner, "", str(self._problem_file)
            )
            reporter.report_refusal(str(error))
            self._store_result(PlanResult(PlanStatus.FAILED, self._planner, message=str(error)))
            return
        request = PlanRequest(domain, problem, self._planner, self._options, self._settings.timeout)
        reporter = PlannerCallReporter(self._bus, "", "", "nil", self._planner, domain.name, problem.name)
        reporter = reporter.report_start(f"message-{message_id}")
        self._running = (self._service.call(request), reporter)

    def _store_result(self, result: PlanResult) -> None:
        """Store the plan, or its absence, in the robot memory, then update the interface."""
        # as in Fawkes, agents cannot distinguish an empty plan from a missing plan
        success = result.status is PlanStatus.PLANNED and bool(result.actions)
        if success:
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
            success = False
        self._interface.final = True
        self._interface.success = success
        self._interface.write()

    def close(self) -> None:
        """Cancel all planning and close the interface."""
        self._service.close()
        if self._running is not None:
            call, reporter = self._running
            if call.result is not None:
                reporter.report_end(call.result)
        self._board.close(self._interface)
