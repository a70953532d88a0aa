"""The pytest plug-in, in separate runs of pytest."""

from __future__ import annotations

from itertools import count

import pytest

from tests.forked import IGNORED, nursery
from tests.run.mini import write_scenario
from tests.support import needs_plugin

pytest_plugins = ["pytester"]

TEST = """
def test_mini(cx):
    run = cx.run("mini")
    run.skills("work").{says}
    run.to_end()
    run.assert_golden()
"""


@pytest.fixture
def project(pytester, monkeypatch):
    numbers = count()
    # the import of further plug-ins would take longer than the run
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    write_scenario(pytester.path / "mini", mapping="act: work{what=?(text)s}")

    def run(says, *arguments, more=""):
        pytester.makepyfile(test_agent=TEST.format(says=says) + more)
        # a separate process: CLIPS and pytest have state
        base = f"--basetemp={pytester.mkdir(f'runpytest-{next(numbers)}')}"
        command = [base, "-q", "-p", "cxbridge", "-p", "no:cacheprovider", "-W", IGNORED, *arguments]
        done = nursery().run(command, folder=pytester.path, program="pytest")
        out, errors = (stream.decode().splitlines() for stream in (done.stdout, done.stderr))
        return pytest.RunResult(done.returncode, out, errors, 0.0)

    return run


def test_golden_file_is_written_compared_and_updated(project, pytester):
    missing = project("succeeds(after=2.0)")
    missing.assert_outcomes(failed=1)
    missing.stdout.fnmatch_lines(["*there is no golden file *test_mini.transitions: pytest --update-golden*"])
    project("succeeds(after=2.0)", "--update-golden").assert_outcomes(passed=1)
    golden = pytester.path / "golden" / "test_agent" / "test_mini.transitions"
    assert "goal G class=MINI" in golden.read_text()
    project("succeeds(after=4.0)").assert_outcomes(passed=1)
    differs = project("fails('slipped')")
    differs.assert_outcomes(failed=1)
    differs.stdout.fnmatch_lines(["*this run differs from the golden run*", "*first difference: *"])
    project("fails('slipped')", "--update-golden").assert_outcomes(passed=1)
    project("fails('slipped')").assert_outcomes(passed=1)


@needs_plugin("web")
def test_difference_from_golden_run_makes_page(project, pytester):
    project("succeeds()", "--update-golden").assert_outcomes(passed=1)
    kept = project("fails('slipped')", "--cx-artifacts=kept")
    kept.stdout.fnmatch_lines(["*both runs side by side: kept*test_mini_test_mini.html"])
    page = pytester.path / "kept/test_agent/test_mini_test_mini.html"
    assert "this run and the golden one" in page.read_text()


def test_empty_golden_file_differs(project, pytester):
    folder = pytester.path / "golden" / "test_agent"
    folder.mkdir(parents=True)
    (folder / "test_mini.transitions").write_text("")
    found = project("succeeds()")
    found.assert_outcomes(failed=1)
    found.stdout.fnmatch_lines(["*holds no transitions*"])


def test_failed_test_shows_run(project):
    found = project("fails('slipped')", more="    assert run.goal('G').outcome == 'COMPLETED'\n")
    found.assert_outcomes(failed=1)
    project("fails('slipped')", "--update-golden")
    found = project("fails('slipped')", more="    assert run.goal('G').outcome == 'COMPLETED'\n")
    found.stdout.fnmatch_lines(
        [
            "*cxbridge run 1*",
            "goals:",
            "  G (MINI): RETRACTED FAILED*",
            "skills:",
            "*work what='hello'",
            "last rules: *",
            "log:",
        ]
    )


def test_recordings_of_failed_tests_are_kept(project, pytester):
    more = "\ndef test_bad(cx):\n    cx.run('mini').to_end()\n    assert False\n"
    project("succeeds()", "--update-golden", "--cx-artifacts", "kept", more=more).assert_outcomes(
        passed=1, failed=1
    )
    kept = [path.relative_to(pytester.path) for path in (pytester.path / "kept").rglob("*.mcap")]
    assert [str(path) for path in kept] == ["kept/test_agent/test_bad.mcap"]


def test_scripted_skill_without_call_fails_test(project):
    project("succeeds()", "--update-golden").assert_outcomes(passed=1)
    more = """
def test_typo(cx):
    run = cx.run("mini")
    run.skills("wrok").fails("never")
    run.to_end()

def test_typo_of_a_question(cx):
    run = cx.run("mini")
    run.to_end()
    assert run.skills("wrok").calls == []

def test_argument(cx):
    run = cx.run("mini")
    run.skills("work", what="nothing").succeeds()
    run.to_end()

def test_optional(cx):
    run = cx.run("mini")
    run.skills("work", what="nothing").succeeds().optional()
    run.to_end()
    assert run.skills("work", what="other").calls == []
"""
    found = project("succeeds()", more=more)
    found.assert_outcomes(passed=2, failed=3)
    found.stdout.fnmatch_lines(
        [
            "run.skills('wrok') matches no call: there is no skill 'wrok' (did you mean work[?])",
            "run.skills('wrok') matches no call: there is no skill 'wrok' (did you mean work[?])",
            "run.skills('work', what='nothing') matches no call, calls were work(what='hello'); say *",
        ]
    )
    found.stdout.no_fnmatch_line("*pytest_plugin.py*")


def test_failure_shows_no_frame_of_library(project):
    more = """
def test_goal(cx):
    cx.run("mini").goal("NOWHERE")

def test_condition(cx):
    run = cx.run("mini")
    run.until(lambda: run.goal("NOWHERE"))

def test_interface(cx):
    cx.run("mini").write("BatteryInterface::Robot", nothing=1)

def test_scenario(cx):
    cx.run("nowhere")
"""
    found = project("succeeds()", "-k", "not mini", more=more)
    found.assert_outcomes(failed=4, deselected=1)
    found.stdout.no_fnmatch_line("*cxbridge/*.py:*")
    found.stdout.fnmatch_lines(["*run.until(lambda: run.goal(*", "E *there is no goal NOWHERE*"])
    full = project("succeeds()", "-k", "test_goal", "--full-trace", more=more)
    full.stdout.fnmatch_lines(["*agent_run.py:*"])


MODULE = """
import pytest

@pytest.fixture(scope="module")
def run(cx_module):
    run = cx_module.run("mini")
    run.skills("{skill}").succeeds(after=2.0)
    run.to_end()
    return run

def test_outcome(run):
    assert run.goal("G").outcome == "{outcome}"

def test_golden(run):
    run.assert_golden("mini")

def test_name(run):
    with pytest.raises(AssertionError, match="needs a name"):
        run.assert_golden()
"""


def test_tests_of_module_share_run(project, pytester):
    def module(*arguments, skill="work", outcome="COMPLETED"):
        more = MODULE.format(skill=skill, outcome=outcome)
        return project("succeeds()", "-k", "not mini", *arguments, more=more)

    module("--update-golden").assert_outcomes(passed=3, deselected=1)
    assert (pytester.path / "golden" / "test_agent" / "mini.transitions").exists()
    module().assert_outcomes(passed=3, deselected=1)
    failed = module("--cx-artifacts", "kept", skill="wrok", outcome="FAILED")
    failed.assert_outcomes(passed=2, failed=1, deselected=1)
    failed.stdout.fnmatch_lines(["*cxbridge run 1*", "*recorded: kept/test_agent/module.mcap"])
    assert (pytester.path / "kept" / "test_agent" / "module.mcap").exists()
    unmet = module(skill="wrok")
    unmet.assert_outcomes(passed=3, errors=1, deselected=1)
    unmet.stdout.fnmatch_lines(["*did you mean work*"])


def test_times_are_compared_on_request(project):
    timed = "succeeds(after={})\n    run.to_end()\n    run.assert_golden('timed', time_tolerance=0.2)"
    project("succeeds()", "--update-golden").assert_outcomes(passed=1)
    absent = project(timed.format(2.0))
    absent.stdout.fnmatch_lines(["*there is no golden file *timed.transitions*"])
    project(timed.format(2.0), "--update-golden").assert_outcomes(passed=1)
    project(timed.format(2.1)).assert_outcomes(passed=1)
    late = project(timed.format(3.0))
    late.assert_outcomes(failed=1)
    late.stdout.fnmatch_lines(["*another time: * s earlier in B*"])


def test_golden_file_without_times_refuses_tolerance(project, pytester):
    project("succeeds()", "--update-golden").assert_outcomes(passed=1)
    timed = project("succeeds()\n    run.to_end()\n    run.assert_golden(time_tolerance=0.2)")
    timed.assert_outcomes(failed=1)
    timed.stdout.fnmatch_lines(["*holds no times*"])
