"""The page about moving from today's executive names each plug-in, and each function of it."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import PurePath

import pytest

from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import make_options
from cxbridge_ros2cx.cx import plugin
from cxbridge_ros2cx.cx.node import CxNode
from ros2cx_tests.cx.test_examples import FILES
from ros2cx_tests.cx.test_public_agents import BRANCHES, COURSE
from tests.support import ROOT

PAGE = (ROOT / "docs" / "evidence" / "ros2-cx.md").read_text()
PREFIX = "ros-msgs-"


def functions(class_name, folder):
    """Return the functions that a plug-in defines."""
    file = folder / "params.yaml"
    file.write_text(
        "/**:\n  ros__parameters:\n    environments: [one]\n    one: {plugins: [it]}\n"
        f"    it: {{plugin: '{class_name}'}}\n"
    )
    found: set[str] = set()

    def attach(assembly):
        assert isinstance(assembly.executive, CxNode)
        before = assembly.executive.env.udfs.names
        assembly.executive.load_core()
        found.update(assembly.executive.env.udfs.names - before)

    assert run_scenario(make_options(file, timeout=0.5), attach=attach).status == 0
    return found


@pytest.mark.parametrize("class_name", plugin._OWN)
def test_the_page_has_the_plugin_and_its_functions(class_name, tmp_path):
    assert f"`{class_name}`" in PAGE
    words = re.findall(r"`([\w-]+)`", PAGE)
    named = {*words, *(f"{PREFIX}{word}" for word in words)}
    missing = {name for name in functions(class_name, tmp_path) if not name.startswith("pb-")} - named
    assert missing == set()


def rows(heading):
    """Return the cells of the first column of a section's tables."""
    section = PAGE.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    cells = [
        line.split(" | ")[0].removeprefix("| ") for line in section.splitlines() if line.startswith("| ")
    ]
    return [cell for cell in cells if cell.strip("| ") and "---" not in cell]


BAD, NODE, RUNS = "test_bad_input", "test_node", "test_recordings"
CHECKED = {
    "a message of an unknown type, a topic that was never opened, an INTEGER for a bool: the node dies": (
        f"{BAD}.test_a_wrong_call_ends_the_rule_only",
        f"{BAD}.test_a_value_that_a_field_does_not_take_changes_nothing",
    ),
    "an unknown field that is read: the node may die": (f"{RUNS}.test_log_is_that_of_the_recording",),
    "an INTEGER in a field for floats: its bits": (f"{RUNS}.test_numbers_convert",),
    "a request without a server blocks rule and environment for a second": (
        f"{BAD}.test_a_request_waits_for_nothing",
    ),
    "`plugins: []` ends the process": (f"{BAD}.test_parameters_that_end_the_original_run",),
    "two environments without log file: no activation": (f"{BAD}.test_parameters_that_end_the_original_run",),
    "a second activation crashes": (f"{NODE}.test_a_second_activation_begins_anew",),
    "an unknown plug-in: no activation": (
        f"{BAD}.test_a_plugin_that_cannot_be_made_is_left_out",
        f"{BAD}.test_strict_does_not_start",
    ),
    "environments in the order of a hash": (f"{RUNS}.test_hash_order_is_that_of_the_recordings",),
    "a plug-in that throws an exception: no activation, or the node dies": (
        f"{BAD}.test_a_plugin_that_raises_in_a_hook_is_one_error_with_its_place",
    ),
    "rules that fire without an end after `(executive-finalize)`": (
        f"{BAD}.test_an_end_without_an_end_is_ended",
    ),
    "files that execute each other": (f"{BAD}.test_files_that_execute_each_other_end",),
    "`autostart_node: false`": (f"{NODE}.test_a_node_that_does_not_start_by_itself_waits_for_a_peer",),
}
"""The tests of each row of the differences."""


def test_each_difference_has_its_tests():
    assert ["the original", *CHECKED] == rows("What differs, and why")
    for tests in CHECKED.values():
        for test in tests:
            module, _, name = test.partition(".")
            assert callable(getattr(import_module(f"ros2cx_tests.cx.{module}"), name))


def test_the_page_has_each_parameter_file():
    assert ["file", *(f"`{PurePath(name).name}`" for name in FILES)] == rows(
        "The parameter files of the checkout"
    )


def test_the_page_has_each_agent():
    said = PAGE.partition("\n## Agents of other people\n")[2].partition("\n## ")[0]
    branches = {agent.partition("_")[2].replace("_", "/", 1) for agent, _, _ in COURSE}
    branches |= {branch.replace("_", "/", 1) for branch in BRANCHES}
    assert {branch for branch in branches if f"`{branch}`" not in said} == set()
