"""The sample of docs/recording.md works as shown."""

from __future__ import annotations

import re

from tests.support import ROOT


def test_the_sample_works(capsys):
    page = (ROOT / "docs" / "recording.md").read_text()
    (sample,) = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    (promised,) = re.findall(r"# prints (.*)", sample)
    exec(compile(sample, "docs/recording.md", "exec"), {})
    assert capsys.readouterr().out.strip() == promised
