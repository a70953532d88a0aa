"""The page for those who come from today's executive names each plug-in, and each function of it."""

from __future__ import annotations

import re

import pytest

from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import make_options
from cxbridge_ros2cx.cx import plugin
from cxbridge_ros2cx.cx.node import CxNode
from tests.support import ROOT

PAGE = (ROOT / "docs" / "from-ros2-cx.md").read_text()
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
