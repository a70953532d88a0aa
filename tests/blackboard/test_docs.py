"""The examples of docs/blackboard.md."""

from __future__ import annotations

import re

from tests.support import ROOT


def test_examples_print_documented_output(capsys):
    text = (ROOT / "docs" / "blackboard.md").read_text().partition("## Interface types")[0]
    examples = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    assert len(examples) == 2
    names: dict[str, object] = {}
    for example in examples:
        exec(compile(example, "docs/blackboard.md", "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("say{text='hello'} ")
    assert printed[1].startswith("StopExecMessage ")
    assert "'msgid': 1" in printed[2]
    assert len(printed) == 3
