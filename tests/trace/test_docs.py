"""The sample of docs/recording.md runs."""

from __future__ import annotations

import re

from tests.support import ROOT


def test_sample_prints_promised_output(capsys):
    page = (ROOT / "docs" / "recording.md").read_text()
    (sample,) = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    (promised,) = re.findall(r"# prints (.*)", sample)
    exec(compile(sample, "docs/recording.md", "exec"), {})
    assert capsys.readouterr().out.strip() == promised
