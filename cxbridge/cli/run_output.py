"""The output of a run: a line per ended goal, then the goal tree and the result."""

from __future__ import annotations

import os
import re
import shutil
import sys
import threading
from collections.abc import Iterator, Mapping
from typing import IO, TYPE_CHECKING, Final

from cxbridge.cli.console import ConsoleLog
from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, GoalTransition, Level, LogLine
from cxbridge.history.failure_reasons import REASON_TYPES, FailureReasons, forget_oldest
from cxbridge.history.outcome import ENDED_MODES, OutcomeKind, goal_outcome
from cxbridge.history.tree import GoalLine, goal_title, latest_lines
from cxbridge.mainloop import Hook
from cxbridge.printing import one_line, unfiltered_stream
from cxbridge.run.result import COMPLETED

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.result import RunResult

_WORD_WIDTH: Final = max(len(outcome.word) for outcome in OutcomeKind)
# Shorter durations of goals are not printed: with one decimal, they are 0.0 s.
_MIN_SHOWN_DURATION_S: Final = 0.05

# The number of characters of a reason, with the colon before it, that are shown even on a narrow terminal;
# chosen freely.
_MIN_REASON_WIDTH: Final = 24

# The start of the lines of a Lua error that only the log shows; the field of an interface may truncate it.
_STACK_TRACE_START: Final = "stack traceback:"

# The start of error messages of CLIPS.
_CLIPS_ERROR: Final = re.compile(r"\[[A-Z]+\d+\] ")


def _drop_stack_trace(reason: str) -> str:
    """Return the first line of a Lua error with a stack trace; other reasons unchanged."""
    first_line, _, further_lines = reason.partition("\n")
    # the further lines may be only the first letters of the start
    is_stack_trace = _STACK_TRACE_START.startswith(further_lines[: len(_STACK_TRACE_START)])
    return first_line if is_stack_trace else reason


class RunLogPrinter(ConsoleLog):
    """Prints the log lines of the run.

    Without ``verbose``, the output of rules is left out, except errors of CLIPS and the output of agents
    without goals.

    :param quiet: whether to print errors only.
    :param verbose: whether to print all lines.
    """

    def __init__(self, *, quiet: bool = False, verbose: bool = False) -> None:
        super().__init__(quiet=quiet, verbose=verbose)
        self._verbose = verbose
        self._printing_thread_id = 0  # the thread in which a rule prints; 0 without one
        self._is_in_clips_error = False  # whether the last line belongs to an error report of CLIPS

    def attach(self, run: Run) -> None:
        """Separate the output of an agent's rules from the other log lines of its environment.

        An agent without goals has no other output, so its rules' output is printed.
        """
        if not run.executive.knows_goals:
            self.show_info()
            return
        output = run.executive.env.output

        def print_line(level: Level, line: str) -> None:
            self._printing_thread_id = threading.get_ident()
            try:
                print_to_log(level, line)
            finally:
                self._printing_thread_id = 0

        print_to_log = output.redirect(print_line)  # the previous receiver of the lines

    def __call__(self, event: Event) -> None:
        """Print a log line.

        Of the separated output of rules, only errors of CLIPS are printed without ``verbose``.
        """
        if (
            self._verbose
            or self._printing_thread_id != threading.get_ident()
            or (isinstance(event, LogLine) and self._follow_clips_error(event))
        ):
            super().__call__(event)

    def _follow_clips_error(self, line: LogLine) -> bool:
        """Return whether a line belongs to an error report of CLIPS, and remember it for the next line.

        The further lines of a report are indented.
        """
        self._is_in_clips_error = line.level is Level.ERROR and (
            _CLIPS_ERROR.match(line.text) is not None
            or (self._is_in_clips_error and line.text.startswith("  "))
        )
        return self._is_in_clips_error


class RunPrinter:
    """Prints a line per ended goal, and finally the goal tree and the result.

    :param quiet: whether to leave out the lines of ended goals.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._colourer = TextColourer(is_on=wants_colour(sys.stdout))
        # the number of characters in a line of the terminal; 0 without a terminal: unlimited
        self._width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 0
        self._agent_count = 0
        self._stdout_error: OSError | None = None

    def attach(self, run: Run) -> None:
        """Follow the goals of an assembled agent before its start."""
        self._agent_count += 1
        if not self._quiet:
            run.bus.subscribe(_GoalFollower(run, self).follow, *REASON_TYPES)
            run.loop.add(Hook.POST_LOOP, self._raise_stdout_error)

    def _raise_stdout_error(self) -> None:
        """Raise the error that stdout has caused, if any."""
        # raised between cycles: goals end within a call of CLIPS, through which exceptions must not pass
        if self._stdout_error is not None:
            raise self._stdout_error

    def print_goal(
        self,
        agent: str,
        elapsed_s: float,
        goal: GoalTransition,
        duration_s: float | None,
        failure_reason: str,
    ) -> None:
        """Print the end of a goal.

        :param elapsed_s: the seconds since the start of the run.
        :param duration_s: the seconds since the selection of the goal; None if the goal was not selected.
        :param failure_reason: empty without a failure or a known reason.
        """
        outcome = goal_outcome(goal.mode, goal.outcome)
        duration_text = (
            "" if duration_s is None or duration_s < _MIN_SHOWN_DURATION_S else f" in {duration_s:.1f} s"
        )
        agent_text = f"{agent}  " if self._agent_count > 1 else ""
        title = one_line(f"{goal_title(goal.goal, goal.goal_class)}{duration_text}")
        time_text = f"{elapsed_s:7.1f} s"
        reason_text = one_line(f": {_drop_stack_trace(failure_reason)}" if failure_reason else "")
        # with the two gaps between the three columns
        used_width = sum(map(len, (time_text, agent_text, self._format_outcome(outcome), title))) + 2 * len(
            "  "
        )
        reason_width = max(self._width - used_width, _MIN_REASON_WIDTH)
        if self._width and len(reason_text) > reason_width:
            reason_text = reason_text[: reason_width - 1] + "…"
        if self._stdout_error is not None:
            return  # the loop raises the error after this cycle
        try:
            self._print(
                self._colourer(time_text, "dim"),
                f"{agent_text}{self._colourer(self._format_outcome(outcome), outcome.colour)}",
                title + self._colourer(reason_text, outcome.colour),
            )
        except OSError as error:
            self._stdout_error = error

    def _format_outcome(self, outcome: OutcomeKind) -> str:
        return (f"{outcome.icon} " if self._colourer.is_on else "") + f"{outcome.word:{_WORD_WIDTH}}"

    def _print(self, *columns: str) -> None:
        stream = unfiltered_stream(sys.stdout)
        stream.write("  ".join(columns) + "\n")
        stream.flush()

    def finish(self, result: RunResult) -> None:
        """Print the goal tree and the result of the run."""
        self._raise_stdout_error()
        for line in self._format_result(result):
            self._print(line)

    def _format_result(self, result: RunResult) -> Iterator[str]:
        for line in latest_lines(result.tree()):
            yield self._format_tree_line(line) if isinstance(line, GoalLine) else one_line(line)
        for text in () if result.replay is None else result.replay.lines:
            yield one_line(text)
        outcome = OutcomeKind.COMPLETED if result.status == COMPLETED else OutcomeKind.FAILED
        yield self._colourer(one_line(result.verdict), outcome.colour) + self._colourer(
            one_line(result.figures), "dim"
        )

    def _format_tree_line(self, line: GoalLine) -> str:
        if not self._colourer.is_on:
            return one_line(line.text)
        error = f"  [{line.error}]" if line.error else ""
        return (
            self._colourer(line.branch, "dim")
            + self._colourer(line.outcome.icon, line.outcome.colour)
            + one_line(f" {line.title}: ")
            + self._colourer(one_line(line.state + error), line.outcome.colour)
        )


class _GoalFollower:
    """Follows the goals of one agent."""

    def __init__(self, run: Run, printer: RunPrinter) -> None:
        self._name = run.name
        self._env = run.executive.env
        self._printer = printer
        self._reasons = FailureReasons(self._read_slots)
        self._start_us = run.clock.start_us
        self._printed_outcomes: dict[str, str] = {}  # by goal
        self._selected_us: dict[str, int] = {}  # the time of the selection by goal

    def _read_slots(self, template: str) -> Iterator[Mapping[str, object]]:
        for _, _, slots in self._env.facts(template):
            yield slots

    def follow(self, event: Event) -> None:
        """Process a transition and print an ended goal."""
        self._reasons.record_event(event)
        if not isinstance(event, GoalTransition):
            return
        if event.mode in ENDED_MODES:
            self._report_end(event)
            return
        self._printed_outcomes.pop(event.goal, None)  # a goal may be tried again, from any mode
        if event.mode == "FORMULATED":
            self._selected_us.pop(event.goal, None)
        elif event.mode == "SELECTED":
            self._selected_us[event.goal] = event.time_us

    def _report_end(self, goal: GoalTransition) -> None:
        # a goal passes several ended modes and may skip FINISHED, so the first of them prints the end
        if self._printed_outcomes.get(goal.goal) == goal.outcome:
            return
        self._printed_outcomes[goal.goal] = goal.outcome
        forget_oldest(self._printed_outcomes)  # bounds the memory of a long run
        selected_us = self._selected_us.pop(goal.goal, None)
        duration_s = None if selected_us is None else (goal.time_us - selected_us) / MICROSECONDS
        elapsed_s = (goal.time_us - self._start_us) / MICROSECONDS
        self._printer.print_goal(
            self._name, elapsed_s, goal, duration_s, self._reasons.find_failure_reason(goal)
        )


_COLOUR_CODES: Final[Mapping[str, str]] = {
    "red": "31",
    "green": "32",
    "yellow": "33",
    "cyan": "36",
    "dim": "2",
    "bold": "1",
}


def wants_colour(stream: IO[str], environ: Mapping[str, str] = os.environ) -> bool:
    """Return whether text for a stream is to be coloured.

    ``FORCE_COLOR`` enables colours, ``NO_COLOR`` or ``FORCE_COLOR=0`` disables them; by default output to
    terminals is coloured, except with ``TERM=dumb``. Empty variables are ignored, see https://no-color.org.
    """
    if environ.get("NO_COLOR") or environ.get("FORCE_COLOR") == "0":
        return False
    return bool(environ.get("FORCE_COLOR")) or (stream.isatty() and environ.get("TERM") != "dumb")


class TextColourer:
    """Colours text, or leaves it unchanged.

    :param is_on: whether to use colours and icons.
    """

    def __init__(self, *, is_on: bool) -> None:
        self.is_on = is_on

    def __call__(self, text: str, colour: str) -> str:
        """Return a text in a colour, dim or bold; unchanged if colours are off or ``colour`` is empty."""
        return f"\x1b[{_COLOUR_CODES[colour]}m{text}\x1b[0m" if self.is_on and colour and text else text
