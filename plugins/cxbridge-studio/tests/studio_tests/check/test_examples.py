"""The page of codes has an example for each code, with the output of the check."""

from __future__ import annotations

import pytest

from cxbridge_studio.check.table import load_codes
from studio_tests.check.examples import Example, load_examples, run_check
from tests.support import WHOLE, needs_all_plugins, share

FINE, *MISTAKES = load_examples()
PLUGIN_CODES = ("CX121", "CX122", "CX415")
"""The codes whose findings need explore or ROS 2."""


def test_agent_of_page_has_no_findings(tmp_path):
    assert run_check(FINE.files, tmp_path, portable=True) == ""


@pytest.mark.parametrize("example", share(MISTAKES, 15), ids=lambda example: example.title)
def test_output_for_example_equals_page(example: Example, tmp_path):
    if example.title[:5] in PLUGIN_CODES and not WHOLE:
        pytest.skip("explore or ROS 2 is not installed")
    assert example.output.count(f" {example.title[:5]}: ") == 1
    portable = example.title.startswith("CX6")
    assert run_check(FINE.files | example.files, tmp_path, portable=portable) == example.output


@needs_all_plugins
def test_each_code_has_example():
    assert {example.title for example in MISTAKES} == {
        f"{code.name}: {code.title}" for code in load_codes().values()
    }
