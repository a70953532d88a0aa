"""The start of the executive in the built-in core: stages, requests, signals, errors.

The rows are those of the compatibility page on the behaviour of the CX core, section 1.2.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from tests.executive.core.core_bench import Bench

INIT = "/clips-executive/specs/s/init"


class Start:
    """An executive before its start.

    :param folder: folder of the user's files.
    :param core_files: replaces the core's files of stage 2.
    """

    def __init__(self, folder: Path, core_files: str = "") -> None:
        self.folder = folder
        self.requested: list[str] = []
        self.loaded_prefixes: list[str] = []
        self.bench = Bench()
        env = self.bench.env
        env.define("config-load", self.loaded_prefixes.append, 1)
        env.define("ff-feature-request", self._request, 1)
        self.bench.load("cx/init.clp")
        (folder / "blackboard-init.clp").write_text("(assert (blackboard-init-done))")
        env.call("path-add", f"{folder}/")
        env.eval(f"(bind ?*CX-STAGE2-FILES* (create$ {core_files}))")
        self.offer("blackboard")

    def offer(self, feature: str) -> None:
        """Register a feature."""
        self.bench.env.assert_string(f"(ff-feature {feature})")

    def _request(self, feature: str) -> Value:
        self.requested.append(feature)
        self.bench.env.assert_string(f"(ff-feature-loaded {feature})")
        return TRUE

    def entry(self, stage: int, index: int, **values: Value) -> None:
        """Configure an entry of a stage (dashes as underscores)."""
        for name, value in values.items():
            self.bench.config(f"{INIT}/stage-{stage}/{index}/{name.replace('_', '-')}", value)

    def file(self, name: str, text: str) -> str:
        """Write a file of the user; return its name."""
        (self.folder / name).write_text(text)
        return name

    def run(self, *, spec: bool = True) -> None:
        """Start."""
        if spec:
            self.bench.config("/clips-executive/spec", "s")
        self.bench.env.assert_string("(executive-init)")
        self.bench.env.run()

    def signal(self, text: str) -> None:
        """Assert a signal and run."""
        self.bench.env.assert_string(f"(executive-init-signal {text})")
        self.bench.env.run()

    def request(self, name: str) -> dict[str, Value]:
        """Return the slots of a request."""
        return self.bench.one("executive-init-request", name=name)

    @property
    def stage(self) -> str:
        """The stage of the start; DONE at the end, NONE before the beginning."""
        if self.bench.all("executive-initialized"):
            return "DONE"
        facts = self.bench.all("executive-init-stage")
        return str(facts[0]["implied"][0]) if facts else "NONE"


@pytest.fixture
def start(tmp_path: Path) -> Start:
    """A start with nothing configured but the spec."""
    return Start(tmp_path)


def test_empty_spec_requests_blackboard_and_loads_core(tmp_path: Path) -> None:
    start = Start(tmp_path, '"core-a.clp" "BATCH|core-b.clp"')
    start.file("core-a.clp", "(deffunction core-a () 1)")
    start.file("core-b.clp", "(assert (core-b))")
    start.run()
    assert start.stage == "DONE"
    assert start.requested == ["blackboard"]
    assert start.bench.all("blackboard-init-done")
    assert start.bench.env.call("core-a") == 1
    assert start.bench.all("core-b")
    assert [text for text in start.bench.texts("I") if text.startswith("Init")] == [
        "Init STAGE-1: requesting feature blackboard",
        'Init STAGE-1: loading files for blackboard ("BATCH|blackboard-init.clp")',
        "Init STAGE-1: finished, advancing to STAGE-2",
        'Init STAGE-2: loading files for cx-files ("core-a.clp" "BATCH|core-b.clp")',
        "Init STAGE-2: finished, advancing to STAGE-3",
        "Initialization completed",
    ]
    assert "Init STAGE-1: feature request for blackboard has been fulfilled" in start.bench.texts("D")


def test_requests_run_in_order_of_numbers(start: Start) -> None:
    """Index 2 comes before 10; the order counts positions from 11."""
    for index in (10, 2, 3):
        name = f"entry-{index}"
        start.file(f"{name}.clp", f"(assert (did {index}))")
        start.entry(3, index, name=name, file=f"BATCH|{name}.clp")
    start.bench.env.build('(defrule did (did ?n) => (printout t "did " ?n crlf))')
    start.run()
    assert [start.request(f"entry-{i}")["order"] for i in (2, 3, 10)] == [11, 12, 13]
    files = [info["file"] for info in start.bench.all("path-info")]
    assert files == ["blackboard-init.clp", "entry-2.clp", "entry-3.clp", "entry-10.clp"]


def test_unavailable_feature_fails_start(start: Start) -> None:
    start.entry(1, 0, name="robot_memory")
    start.entry(1, 1, name="later", feature_request=FALSE)
    start.run()
    assert start.stage == "FAILED"
    request = start.request("robot_memory")
    assert request["state"] == "ERROR"
    assert request["error-msgs"] == ("Feature robot_memory is not available",)
    assert start.request("later")["state"] == "PENDING"
    banner = [text for text in start.bench.texts("E") if "*" not in text]
    assert banner == [
        "Init STAGE-1: feature robot_memory is not available",
        'STAGE-1 request 11 failed: ("Feature robot_memory is not available")',
    ]


def test_entry_without_name_is_reported_at_its_stage(start: Start) -> None:
    start.entry(2, 0, name="fine")
    start.entry(3, 7, file="x.clp")
    start.run()
    assert start.stage == "FAILED"
    assert start.request("fine")["state"] == "COMPLETED"
    assert start.request("MISSING")["error-msgs"] == ("STAGE-3 entry 7 is missing name entry",)


def test_missing_or_broken_file_does_not_stop_start(start: Start) -> None:
    start.file("broken.clp", "(defrule half (a) => (assert (b))")
    start.file("fine.clp", "(deffunction fine () 1)")
    start.entry(3, 0, name="x", files=("missing.clp", "broken.clp", "fine.clp"))
    start.run()
    assert start.stage == "DONE"
    assert start.request("x")["state"] == "COMPLETED"
    assert start.bench.env.call("fine") == 1
    loaded = {info["file"]: info["loaded"] for info in start.bench.all("path-info")}
    assert loaded == {
        "blackboard-init.clp": TRUE,
        "missing.clp": FALSE,
        "broken.clp": FALSE,
        "fine.clp": TRUE,
    }


# --- signals ----------------------------------------------------------------------------------------------


def test_request_waits_for_signal(start: Start) -> None:
    start.entry(1, 0, name="db", feature_request=FALSE, wait_for="db-ready")
    start.run()
    assert start.stage == "STAGE-1"
    assert start.request("db")["state"] == "WAIT-FOR"
    assert "Init STAGE-1: waiting for signal db-ready by db" in start.bench.texts("I")
    start.signal("(id something-else)")
    assert start.stage == "STAGE-1"
    start.signal("(id db-ready)")
    assert start.stage == "DONE"
    assert "Init STAGE-1: signal db-ready by db received" in start.bench.texts("I")
    assert [signal["id"] for signal in start.bench.all("executive-init-signal")] == ["something-else"]


def test_failed_signal_fails_start(start: Start) -> None:
    start.entry(1, 0, name="db", feature_request=FALSE, wait_for="db-ready")
    start.run()
    start.signal('(id db-ready) (ok FALSE) (error-msg "no disk")')
    assert start.stage == "FAILED"
    assert start.request("db")["error-msgs"] == ("no disk",)
    assert not start.bench.all("executive-init-signal")


# --- debugging, supplied files ----------------------------------------------------------------------------


def test_debugging_watches_and_unwatches(start: Start) -> None:
    start.bench.config("/clips-executive/debug/enable", TRUE)
    start.bench.config("/clips-executive/debug/level", 3)
    start.bench.config("/clips-executive/debug/unwatch-facts", ("time", "no-such-template"))
    start.bench.config("/clips-executive/debug/unwatch-rules", ("time-retract", "no-such-rule"))
    start.run()
    watcher = start.bench.env.watcher
    assert ("goal" in watcher.facts, "time" in watcher.facts) == (True, False)
    assert ("any-rule" in watcher.rules, "time-retract" in watcher.rules) == (True, False)
    assert start.bench.env.eval("?*DEBUG*") == 3
    assert start.bench.texts("W") == [
        "Cannot unwatch no-such-template (deftemplate not defined)",
        "Cannot unwatch no-such-rule (defrule not defined)",
    ]


def test_constructs_of_agents_files_are_unwatched(start: Start, tmp_path: Path) -> None:
    start.bench.config("/clips-executive/debug/enable", TRUE)
    start.bench.config("/clips-executive/debug/unwatch-facts", ("order",))
    start.bench.config("/clips-executive/debug/unwatch-rules", ("take-order",))
    start.run()
    watcher = start.bench.env.watcher
    agent = tmp_path / "agent.clp"
    agent.write_text(
        "(deftemplate order (slot id)) (defrule take-order (order) =>) (defrule other (order) =>)"
    )
    assert start.bench.env.load(agent)
    assert ("order" in watcher.facts, "goal" in watcher.facts) == (False, True)
    assert ("take-order" in watcher.rules, "other" in watcher.rules) == (False, True)


def test_configuration_becomes_world_model_facts() -> None:
    bench = Bench()
    bench.env.build(
        "(deftemplate wm-fact (slot id) (slot type) (slot value) (slot is-list) (multislot values))"
    )
    bench.load("cx/wm-config.clp")
    bench.config("/clips-executive/spec", "s")
    bench.config("/clips-executive/specs/s/parameters/mutex/max-age", 15)
    bench.config("/clips-executive/specs/s/parameters/names", ("a", "b"))
    bench.config("/clips-executive/specs/other/parameters/x", 1)
    bench.config("/fawkes/agent/name", "Agent")
    bench.env.assert_string("(executive-init)")
    bench.env.run()
    found = {fact["id"]: (fact["value"], fact["type"], fact["values"]) for fact in bench.all("wm-fact")}
    assert found == {
        "/config/mutex/max-age": (15, "UINT", ()),
        "/config/names": (Symbol("nil"), "STRING", ("a", "b")),
        "/config/agent/name": ("Agent", "STRING", ()),
    }
