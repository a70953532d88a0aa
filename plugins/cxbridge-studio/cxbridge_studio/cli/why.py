"""``cxbridge why``: explains why a rule has not fired, the outcome of a goal, or a whole run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.connect import DEFAULT_URL, TIMED_OUT, AsJson, Connect, connect
from cxbridge.cli.console import say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions

if TYPE_CHECKING:
    from cxbridge_studio.explain.evidence import Evidence

_RUN = "run"  # the word that asks about the whole run, in place of a name
_RUN_END = "end"  # the value of --at for the end of the run
_EXECUTIVE = "executive"  # the name of the executive's CLIPS environment
_ANSWER_TIMEOUT_S = 30.0  # the time limit of the daemon's answer, chosen freely: an answer takes seconds


@dataclass(frozen=True, kw_only=True)
class _AgentOptions:
    """The options for running a scenario."""

    spec: Annotated[
        str | None,
        typer.Option(
            help="The spec to run; by default the spec that the configuration names.", show_default=False
        ),
    ] = None
    config: Annotated[
        tuple[Path, ...],
        typer.Option(
            help="A configuration file that overrides the scenario's. Repeatable: the last file wins.",
            show_default=False,
        ),
    ] = ()
    fawkes_dir: Annotated[
        Path | None,
        typer.Option(help="A Fawkes checkout; its files are used unchanged.", show_default=False),
    ] = None
    core: Annotated[str | None, typer.Option(help="The CX core, builtin or fawkes.", show_default=False)] = (
        None
    )
    clips_dirs: Annotated[
        tuple[Path, ...],
        typer.Option("--clips-dir", help="A folder of CLIPS files, searched first. Repeatable."),
    ] = ()
    skiller: Annotated[
        str, typer.Option(metavar="lua|simulator|none", help="The Skiller that executes skills.")
    ] = "lua"

    def check_unused(self) -> None:
        """Check that each option has its default, since without a scenario the options have no effect.

        :raises CxbridgeError: if an option has another value.
        """
        for field in fields(self):
            if getattr(self, field.name) != field.default:
                # The only plural: the field clips_dirs has the values of --clips-dir.
                option = field.name.removesuffix("s").replace("_", "-")
                raise CxbridgeError(
                    f"--{option} needs a scenario",
                    hint="name the scenario after the rule or the goal",
                )


@option_groups
def why(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="[rule|goal|action|fact] NAME [SCENARIO]",
            help="What to explain: a rule, a goal by id or class, a plan-action GOAL/ID, a fact f-12, or "
            "with 'run' the whole run. Without SCENARIO and --run, the daemon explains its present run. With "
            "SCENARIO, the command runs the scenario up to --at; with both, it explains the recording "
            "with the rules of the scenario.",
        ),
    ],
    url: Connect = DEFAULT_URL,
    run: Annotated[
        Path | None, typer.Option("--run", metavar="FILE", help="Explain a recording.", show_default=False)
    ] = None,
    moment: Annotated[
        str,
        typer.Option(
            "--at", metavar="SECONDS|end", help="Explain the run at this moment, in seconds since its start."
        ),
    ] = _RUN_END,
    env: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="The CLIPS environment to explain, by default the executive's; or the name of an agent, if "
            "there are several.",
            show_default=False,
        ),
    ] = None,
    *,
    agent_options: _AgentOptions,
    rules: Annotated[
        int, typer.Option(min=0, max=3, help="Number of rules to show before each step of a goal.")
    ] = 1,
    as_json: AsJson = False,
) -> int:
    """Explain why a rule has not fired, the outcome of a goal or an action, or the whole run.

    If a rule and a goal have the same name, write `why rule NAME` or `why goal NAME`. `why run` explains
    the whole run.

    Exit status: 0 explained; 2 the name is unknown, or the source lacks the needed events; 3 the daemon did
    not answer.

    Example: cxbridge why goal TESTGOAL-PARENT --run out/run.mcap
    """
    from cxbridge_studio.explain.answer import explain

    kind, name, scenario = _parse_words(words)
    if scenario is None and agent_options.fawkes_dir is None:
        agent_options.check_unused()
    if scenario is None and run is None and agent_options.fawkes_dir is None:
        return _ask_daemon(url, kind, name, rules, moment, env, as_json=as_json)
    options = RunOptions(scenario=scenario, **vars(agent_options))
    with _open_evidence(options, run, _parse_moment(moment), env) as evidence:
        explanation = explain(evidence, name, kind, rules)
    _print_explanation(explanation.lines, explanation.json_report, as_json=as_json)
    return 0


def _ask_daemon(
    url: str, kind: str, name: str, rule_count: int, moment: str, env: str | None, *, as_json: bool
) -> int:
    """Print the explanation of a daemon, and return the exit status.

    :raises CxbridgeError: if a daemon cannot explain this moment, environment or name, or there is no daemon.
    """
    from cxbridge.daemon.client import ask_why

    if moment != _RUN_END:
        raise CxbridgeError(
            f"--at {moment}: a daemon explains only its present state",
            hint="name a scenario, or --run a recording",
        )
    if env not in (None, _EXECUTIVE):
        raise CxbridgeError(f"a daemon has no CLIPS environment '{env}'", hint=f"it has one: {_EXECUTIVE}")
    with connect(url, None) as board:
        explanation = ask_why(board, name, kind, rule_count, _ANSWER_TIMEOUT_S)
    if explanation is None:
        say(f"the daemon did not answer within {_ANSWER_TIMEOUT_S:g} s", err=True)
        return TIMED_OUT
    _print_explanation(explanation["lines"], explanation["data"], as_json=as_json)
    return 0


def _print_explanation(lines: Sequence[str], json_report: object, *, as_json: bool) -> None:
    if as_json:
        say_json(json_report, indent=2)
    else:
        for line in lines:
            say(line)


@contextmanager
def _open_evidence(
    options: RunOptions, run: Path | None, at_s: float | None, env: str | None
) -> Iterator[Evidence]:
    """Yield the evidence from a scenario, a recording, or a recording with the rules of a scenario.

    :param run: the recording; None to run the scenario.
    :param at_s: the moment to explain, in seconds since the start of the run; None for the end.
    :param env: the CLIPS environment or the agent to explain; None for the executive's.
    """
    from cxbridge_studio.explain.scenario import collect_scenario_evidence

    has_scenario = options.scenario is not None or options.fawkes_dir is not None
    if run is None:
        with collect_scenario_evidence(options, at_s, env) as evidence:
            yield evidence
        return
    from cxbridge.trace.formats.registry import open_run
    from cxbridge_studio.check.sources import load_scenario_rules
    from cxbridge_studio.explain.recorded import RecordedEvidence

    recording = open_run(run)
    constructs = load_scenario_rules(options, env=env) if has_scenario else None
    yield RecordedEvidence(recording, at_s, env, constructs)


def _parse_words(words: list[str]) -> tuple[str, str, Path | None]:
    """Return the kind, the name and the scenario from the words of the command.

    The kind is empty if it is not named, the name is empty for the whole run, and the scenario may be None.

    :raises typer.BadParameter: if there are too many words.
    """
    from cxbridge_studio.explain.answer import KINDS

    kind = ""
    if words[0] == _RUN:
        kind, words = _RUN, ["", *words[1:]]
    elif words[0] in KINDS and len(words) > 1:
        kind, *words = words
    if len(words) > 2:  # noqa: PLR2004 - NAME and SCENARIO
        raise typer.BadParameter(f"too many: {' '.join(words[2:])}", param_hint="NAME [SCENARIO]")
    return kind, words[0], Path(words[1]) if len(words) > 1 else None


def _parse_moment(moment: str) -> float | None:
    """Return the seconds of the option ``--at``; None for the end of the run.

    :raises CxbridgeError: if the option is neither ``end`` nor a number of seconds.
    """
    if moment == _RUN_END:
        return None
    try:
        seconds = float(moment)
    except ValueError:
        seconds = -1.0  # refused below, as other impossible times
    if not 0 <= seconds < float("inf"):  # false for NaN, too
        raise CxbridgeError(f"--at cannot be '{moment}'", hint="seconds since the start of the run, or end")
    return seconds
