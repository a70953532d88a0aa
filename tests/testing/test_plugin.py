"""The pytest plug-in, in runs of pytest of its own."""

from __future__ import annotations

import pytest

from tests.run.mini import write_scenario

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
    # others' plug-ins take longer to import than the run takes
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    write_scenario(pytester.path / "mini", mapping="act: work{what=?(text)s}")

    def run(says, *arguments, more=""):
        pytester.makepyfile(test_agent=TEST.format(says=says) + more)
        # a process of its own: CLIPS' and pytest's state are nobody else's
        return pytester.runpytest_subprocess(
            "-q", "-p", "cxbridge", "-p", "no:cacheprovider", *arguments, timeout=120
        )

    return run


def test_a_golden_file_is_written_compared_with_and_written_anew(project, pytester):
    missing = project("succeeds(after=2.0)")
    missing.assert_outcomes(failed=1)
    missing.stdout.fnmatch_lines(["*there is no golden file *test_mini.transitions: pytest --update-golden*"])
    project("succeeds(after=2.0)", "--update-golden").assert_outcomes(passed=1)
    golden = pytester.path / "golden" / "test_agent" / "test_mini.transitions"
    assert "goal G class=MINI" in golden.read_text()
    project("succeeds(after=4.0)").assert_outcomes(passed=1)
    differs = project("fails('slipped')")
    differs.assert_outcomes(failed=1)
    differs.stdout.fnmatch_lines(["*this run is not the golden one*", "*first difference: *"])
    project("fails('slipped')", "--update-golden").assert_outcomes(passed=1)
    project("fails('slipped')").assert_outcomes(passed=1)


def test_an_empty_golden_file_is_not_the_same(project, pytester):
    folder = pytester.path / "golden" / "test_agent"
    folder.mkdir(parents=True)
    (folder / "test_mini.transitions").write_text("")
    found = project("succeeds()")
    found.assert_outcomes(failed=1)
    found.stdout.fnmatch_lines(["*holds no transitions*"])


def test_a_failed_test_tells_of_its_run(project):
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


def test_parameters_are_part_of_the_golden_files_name(project, pytester):
    more = """
import pytest

@pytest.mark.parametrize("after", [1.0, 2.0])
def test_both(cx, after):
    run = cx.run("mini")
    run.skills("work").succeeds(after=after)
    run.to_end()
    run.assert_golden()
    run.assert_golden("shared", order="total", level="skills")
"""
    project("succeeds()", "--update-golden", more=more).assert_outcomes(passed=3)
    names = sorted(path.name for path in (pytester.path / "golden" / "test_agent").iterdir())
    assert names == [
        "shared.transitions",
        "test_both_1.0.transitions",
        "test_both_2.0.transitions",
        "test_mini.transitions",
    ]
    project("succeeds()", more=more).assert_outcomes(passed=3)
