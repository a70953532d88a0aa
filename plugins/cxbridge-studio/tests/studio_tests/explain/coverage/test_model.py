"""The coverage of runs: counts, reports, and the format of lcov."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from cxbridge.events import RuleFired
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.explain.coverage.model import (
    AgentSources,
    RecordedUse,
    add_recorded_agent,
    compute_coverage,
)
from cxbridge_studio.explain.coverage.report import format_lcov_lines, format_report, to_json
from cxbridge_studio.explain.rules.constructs import TextFile
from tests.history.runs import ENV, ListRun, action, fired, goal, skill
from tests.support import SHARED, needs_shared

AGENT = """; rules
(defrule one (goal (class WALK|RUN)) =>)

(defrule two ; not much
  "of use"
  ; a comment

  (goal (class ~SWIM) (mode SELECTED)) =>
  (assert (goal (class REST) (id r1))))
"""
OTHER = "(defrule three =>)\n(defrule one (x) =>)\n"


def cover_runs(*runs, files=(("/a/agent.clp", AGENT), ("/a/other.clp", OTHER)), globs=()):
    agent, use = AgentSources(), RecordedUse()
    for name, text in files:
        agent.add_file(TextFile(name, text))
    agent.add_domain(
        "(define (domain d) ; (:action no)\n (:action Go :parameters ()) (:durative-action wait))"
    )
    for run in runs:
        use.add(run, ENV)
    return compute_coverage(agent, use, globs)


RUN = ListRun([fired(0, "one"), fired(1, "one"), fired(1, "not-loaded")])


def test_coverage_has_rules_by_file_and_line():
    coverage = cover_runs(RUN)
    assert (coverage.watched_count, coverage.fired_count) == (3, 1)
    assert [(file.file, file.watched_count, file.fired_count) for file in coverage.files] == [
        ("/a/agent.clp", 1, 0),
        ("/a/other.clp", 2, 1),
    ]
    rules = {
        rule.name: (rule.file, rule.lines, count) for file in coverage.files for rule, count in file.rules
    }
    assert rules == {
        "two": ("/a/agent.clp", (4, 5, 8, 9), 0),
        "three": ("/a/other.clp", (1,), 0),
        "one": ("/a/other.clp", (2,), 2),
    }


def test_coverage_has_goal_classes_modes_and_outcomes():
    events = [goal(0, "walk1", mode) for mode in ("FORMULATED", "SELECTED", "FINISHED")]
    events += [goal(1, "walk2", "FORMULATED"), goal(1, "walk2", "FORMULATED", parent="walk1")]
    events += [goal(2, "walk2", "FINISHED", "FAILED"), goal(3, "jump1", "FORMULATED")]
    coverage = cover_runs(ListRun(events))
    assert coverage.goal_classes.used == (("JUMP", 1), ("WALK", 2))
    assert coverage.goal_classes.unused == ("REST", "RUN")
    missing = dict(coverage.missing_modes)
    assert missing["WALK"] == ("EXPANDED", "COMMITTED", "DISPATCHED", "EVALUATED", "RETRACTED")
    assert dict(coverage.outcomes) == {"WALK": (("FAILED", 1), ("UNKNOWN", 1))}


def test_coverage_has_actions_and_skills():
    events = [
        action(0, "walk1", 1, "go", "WAITING"),
        skill(0, "goto{place='x'}", "S_RUNNING"),
        skill(0, "goto{place='x'}", "S_RUNNING"),
        action(0, "walk1", 1, "go", "RUNNING"),
        skill(1, "goto{place='x'}", "S_FINAL"),
        skill(1, "goto{place='x'}", "S_RUNNING"),
    ]
    coverage = cover_runs(ListRun(events))
    assert (coverage.actions.used, coverage.actions.unused) == ((("go", 1),), ("wait",))
    assert coverage.skills.used == (("goto", 2),)


def test_globs_select_files():
    assert [file.file for file in cover_runs(RUN, globs=("oth*",)).files] == ["/a/other.clp"]
    assert [file.file for file in cover_runs(RUN, globs=("/a/ag*",)).files] == ["/a/agent.clp"]


def test_last_version_of_changed_file_counts():
    coverage = cover_runs(RUN, files=(("/a/o.clp", OTHER), ("/a/o.clp", "(defrule four =>)")))
    assert [rule.name for file in coverage.files for rule, _ in file.rules] == ["four"]


def test_rules_without_recorded_firings_do_not_count():
    agent, use = AgentSources(), RecordedUse()
    agent.add_file(TextFile("/a/other.clp", "(defrule time-retract =>)(defrule one =>)"))
    use.add(RUN, ENV)
    coverage = compute_coverage(agent, use)
    assert (coverage.watched_count, coverage.fired_count) == (1, 1)
    assert "firings not recorded: time-retract" in format_report(coverage, has_firings=True)


def test_recorded_files_are_added_without_core():
    class Recorded(ListRun):
        def source_records(self):
            for record in super().source_records():
                yield {**record, "modify": "6.4" if "core" in record["name"] else "6.3"}

    run = Recorded([fired(0, "two")], {"core.clp": "(defrule of-core =>)", "agent.clp": AGENT})
    for core, names in ((False, {"one", "two"}), (True, {"one", "two", "of-core"})):
        agent = AgentSources()
        assert add_recorded_agent(agent, run, ENV, include_core=core)
        assert set(agent.rules) == names
    assert not add_recorded_agent(AgentSources(), ListRun([]), ENV, include_core=True)


def test_lcov_format(tmp_path):
    text = list(format_lcov_lines(cover_runs(RUN)))
    assert text[:12] == [
        "TN:",
        "SF:/a/agent.clp",
        "FN:4,two",
        "FNDA:0,two",
        "FNF:1",
        "FNH:0",
        "DA:4,0",
        "DA:5,0",
        "DA:8,0",
        "DA:9,0",
        "LF:4",
        "LH:0",
    ]
    assert text[12:] == [
        "end_of_record",
        "TN:",
        "SF:/a/other.clp",
        "FN:1,three",
        "FN:2,one",
        "FNDA:0,three",
        "FNDA:2,one",
        "FNF:2",
        "FNH:1",
        "DA:1,0",
        "DA:2,2",
        "LF:2",
        "LH:1",
        "end_of_record",
    ]


@pytest.mark.skipif(shutil.which("genhtml") is None, reason="genhtml (lcov) is not installed")
def test_genhtml_accepts_lcov_file(tmp_path):
    source = tmp_path / "agent.clp"
    source.write_text(AGENT)
    (tmp_path / "c.info").write_text(
        "".join(f"{line}\n" for line in format_lcov_lines(cover_runs(RUN, files=((str(source), AGENT),))))
    )
    process = subprocess.run(
        ["genhtml", "c.info", "-o", "html"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    assert "functions..: 50.0% (1 of 2 functions)" in process.stdout


LOG = SHARED / "traces" / "test-scenario" / "skiller-1" / "fawkes.log"


@needs_shared
def test_coverage_of_fawkes_log():
    use = RecordedUse()
    use.add(open_run(LOG), ENV)
    events = [event for event in open_run(LOG) if isinstance(event, RuleFired)]
    assert use.firings.total() == len(events) == 728
    coverage = compute_coverage(AgentSources(), use)
    assert dict(coverage.actions.used)["say-hello"] == 1
    assert dict(coverage.skills.used) == {"say": 4}
    assert to_json(coverage)["goal_classes"]["outcomes"]["ALWAYS-REJECT"] == {"REJECTED": 2}
