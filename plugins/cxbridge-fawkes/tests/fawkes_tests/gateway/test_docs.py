"""The sample of docs/daemon.md."""

from __future__ import annotations

import re

from tests.support import ROOT


def test_sample_prints_documented_output(capsys):
    page = (ROOT / "docs" / "daemon.md").read_text()
    (sample,) = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    (documented,) = re.findall(r"print\(.*\) +# (.*)", sample)
    exec(compile(sample, "docs/daemon.md", "exec"), {})
    assert capsys.readouterr().out.strip() == documented
