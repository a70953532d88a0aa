"""Planners that are programs: on the PATH, as in Fawkes, or in Python packages of unified-planning.

The program reads files in a temporary folder, and writes the plan to a file there or to stdout;
:mod:`cxbridge_planning.engines.programs` has the command lines and the forms of plans.
"""

from __future__ import annotations

import shlex
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Final

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.engines.engine import WORK_FOLDER_PREFIX, EnginePlanner
from cxbridge_planning.engines.programs import PROGRAMS, PlannerProgram
from cxbridge_planning.engines.texts import PddlTexts, original_texts, plain_texts, rename_problem
from cxbridge_planning.errors import MAX_EXCERPT, PlanningError, UnknownPlannerError
from cxbridge_planning.needs import Need, problem_needs
from cxbridge_planning.plan_files import PlanNames, load_plan

_PLAN_PREFIX: Final = "plan"  # begins the names of plan files, to which programs add numbers
_PROBLEM_NAME: Final = "task"  # LPG refuses a problem with the name "problem"
_STATUS_PREFIX: Final = "exit status "  # precedes the exit status at the end of a program's output

# A program that fails earlier has probably refused the text; a later failure is one of the search.
_MAX_REFUSAL_S: Final = 2.0


class CommandPlanner(EnginePlanner):
    """A planner that is a program.

    :param name: a key of :data:`PROGRAMS`.
    :param options: additional command-line options.
    :param program: the program to use instead of the known program; empty for the known program.
    :param improve: the seconds of a search for better plans if the problem has a metric and the program
        supports the search.
    :raises UnknownPlannerError: if the options have unbalanced quotes, or ``improve`` is not a number.
    """

    def __init__(self, name: str, options: str = "", program: str = "", improve: str = "1.0") -> None:
        self._program: PlannerProgram = PROGRAMS[name]
        super().__init__(name, self._program, improve)
        try:
            self._options = shlex.split(options or self._program.default_options)
        except ValueError as error:
            raise UnknownPlannerError(f"the options of planner {name} are invalid: {error}") from None
        self._user_program = program

    @property
    def unavailable_reason(self) -> str:
        """The reason why the program cannot be called; empty if it can."""
        missing_text = self._program.explain_missing(self._user_program)
        return f"{self.name} is not installed: {missing_text}" if missing_text else ""

    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None if the program states that none exists.

        The program gets the user's text. If the program refuses this text at once, it gets a text in basic
        PDDL.

        :raises PlanningError: if the program fails, or its plan is not readable.
        """
        texts = original_texts(domain, problem)
        start_s = time.monotonic()
        try:
            return self._solve_texts(texts, domain, problem)
        except PlanningError:
            # without source texts, the program has got generated texts, which are much like basic PDDL
            if time.monotonic() - start_s > _MAX_REFUSAL_S or not (domain.text or problem.text):
                raise
            with suppress(PlanningError):  # of two errors, the error about the user's text is raised
                return self._solve_texts(plain_texts(domain, problem), domain, problem)
            raise

    def _solve_texts(
        self, texts: PddlTexts, domain: Domain, problem: Problem
    ) -> tuple[PlannedAction, ...] | None:
        names = PlanNames(domain, problem)
        with tempfile.TemporaryDirectory(prefix=WORK_FOLDER_PREFIX) as folder:
            contents = {"domain": texts.domain, "problem": rename_problem(texts.problem, _PROBLEM_NAME)}
            for key, text in contents.items():
                Path(folder, f"{key}.pddl").write_text(text)
            placeholder_values = {key: str(Path(folder, f"{key}.pddl")) for key in contents}
            placeholder_values["plan"] = str(Path(folder, _PLAN_PREFIX))
            can_improve = bool(self._program.improving_arguments) and self.improve_s > 0
            if can_improve and Need.COSTS in problem_needs(domain, problem):
                # the programs take whole seconds
                placeholder_values["improve"] = str(max(1, round(self.improve_s)))
                self._run_program(self._program.improving_arguments, placeholder_values, folder)
                if plan := self.read_plan(Path(folder), names):
                    return plan
            output = self._run_program(self._program.arguments, placeholder_values, folder)
            if not self._program.step_pattern and (plan := self.read_plan(Path(folder), names)) is not None:
                return plan
        # errors refer to the user's files, not to the temporary copies
        for key, file in zip(contents, texts.files, strict=True):
            output = output.replace(placeholder_values[key], file or f"the {key}")
        return self._parse_output(output, names)

    def _run_program(
        self, arguments: tuple[str, ...], placeholder_values: dict[str, str], folder: str
    ) -> str:
        """Run the program and return its output, followed by its exit status.

        :param placeholder_values: the texts that replace the placeholders in the arguments.
        :raises PlanningError: if the program cannot be started.
        """
        words = [argument.format(**placeholder_values) for argument in arguments]
        command = [*self._program.command(self._user_program), *words, *self._options]
        try:
            process = subprocess.run(  # noqa: S603 - no shell, and the program that the user chose
                command, cwd=folder, capture_output=True, check=False, stdin=subprocess.DEVNULL
            )
        except OSError as error:
            raise PlanningError(f"cannot start {command[0]}: {error.strerror}") from error
        output = (process.stdout + process.stderr).decode(errors="replace")
        return f"{output}\n{_STATUS_PREFIX}{process.returncode}"

    def read_plan(self, folder: Path, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the plan in the program's last plan file, the best plan; None without a plan.

        :raises PlanningError: if the file is not a plan.
        """
        paths = [path for path in folder.glob(f"{_PLAN_PREFIX}*") if path.is_file()]
        for path in sorted(paths, key=lambda path: (path.stat().st_mtime_ns, path.name), reverse=True):
            if self._program.no_plan_text and self._program.no_plan_text in path.read_text(errors="replace"):
                continue
            try:
                steps = load_plan(path, names)
            except PlanningError as error:
                raise PlanningError(f"{self.name} wrote an invalid plan: {error.message}") from None
            # LPG writes times for actions without duration, too
            has_times = self._program.has_times and names.has_durative_actions
            return steps if has_times else tuple(PlannedAction(step.name, step.arguments) for step in steps)
        return None

    def _parse_output(self, output: str, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the printed plan, or None if the program states that no plan exists.

        :raises PlanningError: if the output has neither a plan nor this statement, or if the plan names an
            unknown action or object.
        """
        text, _, status = output.rpartition(_STATUS_PREFIX)
        program = self._program
        if program.step_pattern and program.plan_heading in text:
            return tuple(self._parse_steps(text.split(program.plan_heading, 1)[1], names))
        if program.unsolvable_output.search(text):
            return None
        raise PlanningError(
            f"{self.name} ended with exit status {status} and without a plan: "
            + " ".join(text.split())[-MAX_EXCERPT:]
        )

    def _parse_steps(self, output: str, names: PlanNames) -> Iterator[PlannedAction]:
        assert self._program.step_pattern
        for match in self._program.step_pattern.finditer(output):
            name, *arguments = match["step"].split()
            if name.upper() == "REACH-GOAL":
                continue  # the last step of FF's plans is not an action of the domain
            times = {key: float(value) for key, value in match.groupdict().items() if key != "step"}
            yield names.make_step(name, arguments, **times)


# the objects that the rows of the plug-in name
fast_downward, enhsp, lpg, ff, fd, popf, optic = (
    partial(CommandPlanner, name) for name in ("fast-downward", "enhsp", "lpg", "ff", "fd", "popf", "optic")
)
