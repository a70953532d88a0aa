"""The command `cxbridge run --break` with debugger commands from a pipe."""

from __future__ import annotations

import os

import pytest

from cxbridge.cli.input_lines import InputLines
from cxbridge.cli.main import invoke
from tests.run.mini import write_scenario


@pytest.fixture(name="folder", scope="module")
def _folder(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("mini"))


@pytest.fixture(name="run")
def _run(folder, monkeypatch, capsys):
    """Run the small scenario with breakpoints and commands; return exit status, stdout and stderr."""

    def run(specs, *commands, options=()):
        inlet, outlet = os.pipe()
        os.write(outlet, "\n".join(commands).encode())
        os.close(outlet)
        with os.fdopen(inlet) as stream:
            monkeypatch.setattr("sys.stdin", stream)
            breaks = [word for spec in specs for word in ("--break", spec)]
            status = invoke(["run", str(folder), *breaks, *options])
        return status, *capsys.readouterr()

    return run


def test_run_stops_at_breakpoint_answers_and_continues(run):
    status, out, _ = run(["goal:MINI:DISPATCHED", "rule:mini-evaluate"], "goals", "b", "c", "agenda", "c")
    assert status == 0
    assert "stopped at goal G (MINI) is DISPATCHED (breakpoint 1)\n  fired last: mini-dispatch; next: " in out
    assert "\nG (MINI): DISPATCHED\n" in out
    assert "\n1  goal:MINI:DISPATCHED\n2  rule:mini-evaluate\n" in out
    assert out.count("stopped before rule mini-evaluate (breakpoint 2)") == 1
    assert "     0 mini-evaluate: f-" in out


def test_edited_fact_changes_outcome_of_goal(run):
    status, out, _ = run(
        ["rule:mini-evaluate"], "facts plan", "assert (not-there 1 2)", "facts not-there", "c"
    )
    assert status == 0
    number = int(out.partition("\nf-")[2].split()[0])
    assert number
    status, out, _ = run(["goal:MINI:FORMULATED"], "facts goal")
    index = out.partition("\nf-")[2].split()[0]
    failed = f"modify f-{index} (mode RETRACTED) (outcome FAILED)"
    status, out, _ = run(["goal:MINI:FORMULATED"], failed, "facts goal", "c")
    assert status == 1
    assert "(mode RETRACTED) (outcome FAILED)" in out
    assert "G ended FAILED" in out


def test_steps_stop_after_their_unit(run):
    status, out, _ = run(["goal:MINI:SELECTED"], "d 1", "s", "s rule", "s transition", "s loop", "c")
    assert status == 0
    reasons = [line.split(": ", 1)[1] for line in out.splitlines() if " s: stopped " in line]
    assert reasons[0] == "stopped at goal G (MINI) is SELECTED (breakpoint 1)"
    assert reasons[1].startswith("stopped after rule ")
    assert reasons[2].startswith("stopped after rule ")
    assert "mini-" in reasons[3] or " is " in reasons[3]
    assert reasons[4] == "stopped at the end of the loop"
    assert len(reasons) == 5


def test_invalid_commands_are_errors_and_run_waits(run):
    status, out, _ = run(
        ["goal:MINI:SELECTED"],
        "fly",
        "s year",
        "b fly",
        "d 9",
        "d one",
        "facts nothing",
        "modify 1",
        "modify x (a b)",
        "retract 99999",
        "assert nothing",
        "h",
        "c",
    )
    assert status == 0
    assert out.count("\nerror: ") == 10
    assert "modify INDEX (SLOT VALUE)..." in out


def test_run_continues_at_end_of_pipe(run):
    status, out, _ = run(["rule:*"])
    assert status == 0
    assert out.count(": stopped ") == 1


def test_quit_command_ends_run(run):
    status, out, error = run(["goal:MINI:SELECTED"], "q")
    assert status == 130
    assert "failed" not in error  # no rule fires after the end
    assert "every root goal" not in out


def test_json_output_has_only_result_on_stdout(run):
    status, out, error = run(["goal:MINI:SELECTED"], "c", options=["--json"])
    assert status == 0
    assert out.startswith("{")
    assert "stopped at goal G" in error


def test_invalid_breakpoint_is_an_error_before_run(run):
    status, out, error = run(["fly"])
    assert (status, out) == (2, "")
    assert "'fly' is not a breakpoint" in error


def test_command_lines_are_whole_and_end_on_request():
    inlet, outlet = os.pipe()
    with os.fdopen(inlet) as stream:
        lines = InputLines(stream)
        assert not lines.is_terminal
        os.write(outlet, b"one\n two ")
        assert lines.next(lambda: False) == "one"
        answers = iter((False, True))
        assert lines.next(lambda: next(answers)) is None
        os.write(outlet, b"2\nthree")
        os.close(outlet)
        assert [lines.next(lambda: False) for _ in range(3)] == ["two 2", "three", None]


@pytest.mark.parametrize(
    ("spec", "message", "hint"),
    [
        ("rule:mini-begn", "there is no rule 'mini-begn'", "did you mean mini-begin?"),
        ("goal:MINI:FINISHD", "goals have no mode 'FINISHD'", "did you mean FINISHED?"),
        ("skill:sya", "there is no skill 'sya'", "did you mean say?"),
    ],
)
def test_unreachable_breakpoint_is_an_error_at_start(run, spec, message, hint):
    status, out, error = run(["rule:mini-begin", spec], "c", options=["--quiet"])
    assert status == 2
    assert f"error: breakpoint {spec}: {message}\n  hint: {hint}" in error
    assert "every root goal" not in out


def test_unreached_breakpoint_is_reported_at_end(run):
    status, out, _ = run(["goal:MIMI", "goal:MINI:SELECTED", "goal:MUMU"], "d 3", "c")
    assert status == 0
    assert out.count("never") == out.count("\nbreakpoint 1 (goal:MIMI) was never reached\n") == 1
    assert "never" not in run(["goal:MINI:SELECTED", "goal:MIMI"], "q")[1]


def test_run_continues_without_stdin(folder, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", None)  # like `<&-` in a shell
    assert invoke(["run", str(folder), "--break", "goal:MINI:SELECTED"]) == 0
    assert ": stopped at goal G" in capsys.readouterr().out
