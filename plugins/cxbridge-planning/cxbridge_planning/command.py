"""Planners that are programs: on the PATH, as in Fawkes, or in packages of unified-planning."""

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
from cxbridge.executive.planning.errors import PlanningError
from cxbridge.executive.planning.needs import Need, problem_needs
from cxbridge.executive.planning.planner import PlannedAction
from cxbridge_planning.engine import FOLDER, EnginePlanner
from cxbridge_planning.plan_files import PlanNames, load_plan
from cxbridge_planning.programs import PROGRAMS, PlannerProgram
from cxbridge_planning.texts import PddlTexts, named, original_texts, plain_texts

_PLAN: Final = "plan"  # prefix of plan files
_TASK: Final = "task"  # name of the problem in the text for a program
_STATUS: Final = "exit status "  # precedes the exit status at the end of a call's output

# Seconds: a program that fails earlier has refused the text, a later failure is a failure of the search.
_REFUSAL_S: Final = 2.0
_EXCERPT: Final = 300  # characters of a program's output in an error


class CommandPlanner(EnginePlanner):
    """A planner that is a program.

    :param name: a key of :data:`PROGRAMS`.
    :param options: additional command-line options.
    :param program: the program to use instead of the one on the PATH.
    :param improve: seconds to search for better plans if the problem has a metric and the program supports
        that.
    """

    def __init__(self, name: str, options: str = "", program: str = "", improve: str = "1.0") -> None:
        self._program: PlannerProgram = PROGRAMS[name]
        super().__init__(name, self._program, improve)
        self._options = shlex.split(options or self._program.options)
        self._own_program = program

    @property
    def not_installed(self) -> str:
        """The reason why the program cannot be called; empty if it can."""
        hint = self._program.install_hint(self._own_program)
        return f"{self.name} is not installed: {hint}" if hint else ""

    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None if the program proves that none exists.

        The program reads the user's text. If the program rejects that text at once, it gets a text in basic
        PDDL.
        """
        texts = original_texts(domain, problem)
        start = time.monotonic()
        try:
            return self._solve(texts, domain, problem)
        except PlanningError:
            if time.monotonic() - start > _REFUSAL_S or not any(texts.files):
                raise
            with suppress(PlanningError):
                return self._solve(plain_texts(domain, problem), domain, problem)
            raise

    def _solve(self, pddl: PddlTexts, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        names = PlanNames(domain, problem)
        with tempfile.TemporaryDirectory(prefix=FOLDER) as folder:
            files = {key: Path(folder, f"{key}.pddl") for key in ("domain", "problem")}
            files["domain"].write_text(pddl.domain)
            # LPG rejects a problem with the name "problem"
            files["problem"].write_text(named(pddl.problem, _TASK))
            texts = {**{key: str(path) for key, path in files.items()}, "plan": str(Path(folder, _PLAN))}
            if self._program.improving and self.improve > 0 and Need.COSTS in problem_needs(domain, problem):
                texts["improve"] = str(max(1, round(self.improve)))
                self._call(self._program.improving, texts, folder)
                if plan := self.plan_in(Path(folder), names):
                    return plan
            output = self._call(self._program.arguments, texts, folder)
            if not self._program.step:
                plan = self.plan_in(Path(folder), names)
                if plan is not None:
                    return plan
        # errors refer to the user's files, not to the temporary copies
        for key, file in zip(files, pddl.files, strict=True):
            output = output.replace(texts[key], file or f"the {key}")
        return self._parse_output(output, names)

    def _call(self, arguments: tuple[str, ...], texts: dict[str, str], folder: str) -> str:
        """Run the program and return its output with its exit status.

        :param texts: the texts for the placeholders in the arguments.
        :raises PlanningError: if the program cannot be started.
        """
        words = [argument.format(**texts) for argument in arguments]
        command = [*self._program.command(self._own_program), *words, *self._options]
        try:
            process = subprocess.run(  # noqa: S603 - no shell, and the program that the user chose
                command, cwd=folder, capture_output=True, check=False, stdin=subprocess.DEVNULL
            )
        except OSError as error:
            raise PlanningError(f"cannot start {command[0]}: {error.strerror}") from error
        output = (process.stdout + process.stderr).decode(errors="replace")
        return f"{output}\n{_STATUS}{process.returncode}"

    def plan_in(self, folder: Path, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the program's last plan file, which is the best plan; None without a plan file."""
        paths = [path for path in folder.glob(f"{_PLAN}*") if path.is_file()]
        for path in sorted(paths, key=lambda path: (path.stat().st_mtime_ns, path.name), reverse=True):
            if self._program.no_plan and self._program.no_plan in path.read_text(errors="replace"):
                continue
            try:
                steps = load_plan(path, names)
            except PlanningError as error:
                raise PlanningError(f"{self.name} made no sense: {error.message}") from None
            return steps if self._program.times and names.durative else _untimed(steps)
        return None

    def _parse_output(self, output: str, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the printed plan, or None if the program states that no plan exists.

        :raises PlanningError: if the output is neither a plan nor a proof.
        """
        text, _, status = output.rpartition(_STATUS)
        program = self._program
        if program.step and program.solved in text:
            return tuple(self._steps(text.split(program.solved, 1)[1], names))
        if program.unsolvable.search(text):
            return None
        excerpt = " ".join(text.split())[-_EXCERPT:]
        raise PlanningError(f"{self.name} ended with exit status {status} and without a plan: {excerpt}")

    def _steps(self, output: str, names: PlanNames) -> Iterator[PlannedAction]:
        assert self._program.step
        for match in self._program.step.finditer(output):
            name, *arguments = match["step"].split()
            if name.upper() == "REACH-GOAL":
                continue  # the last step of FF's plans, which is no action of the domain
            times = {key: float(value) for key, value in match.groupdict().items() if key != "step"}
            yield names.step(name, arguments, **times)


def _untimed(steps: tuple[PlannedAction, ...]) -> tuple[PlannedAction, ...]:
    return tuple(PlannedAction(step.name, step.arguments) for step in steps)


fast_downward = partial(CommandPlanner, "fast-downward")
enhsp = partial(CommandPlanner, "enhsp")
lpg = partial(CommandPlanner, "lpg")
ff = partial(CommandPlanner, "ff")
fd = partial(CommandPlanner, "fd")
popf = partial(CommandPlanner, "popf")
optic = partial(CommandPlanner, "optic")
