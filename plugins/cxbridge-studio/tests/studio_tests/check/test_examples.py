"""The page of codes is true: each code has its example, with the output of the check."""

from __future__ import annotations

import pytest

from cxbridge_studio.check.table import load_codes
from studio_tests.check.examples import Example, examples, output_of
from tests.support import WHOLE, needs_all_plugins, share

FINE, *MISTAKES = examples()
OF_PLUGINS = ("CX121", "CX122", "CX415")
"""The codes whose findings need explore or ROS 2."""


def test_the_agent_of_the_page_is_fine(tmp_path):
    assert output_of(FINE.files, tmp_path, portable=True) == ""


@pytest.mark.parametrize("example", share(MISTAKES, 15), ids=lambda example: example.title)
def test_an_example_says_what_the_page_says(example: Example, tmp_path):
    if example.title[:5] in OF_PLUGINS and not WHOLE:
        pytest.skip("explore or ROS 2 is not installed")
    assert example.output.count(f" {example.title[:5]}: ") == 1
    portable = example.title.startswith("CX6")
    assert output_of(FINE.files | example.files, tmp_path, portable=portable) == example.output


@needs_all_plugins
def test_each_code_has_its_example():
    assert {each.title for each in MISTAKES} == {
        f"{code.name}: {code.title}" for code in load_codes().values()
    }
