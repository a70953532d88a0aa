"""The sample of docs/daemon.md works as shown."""

from __future__ import annotations

import re

from tests.support import ROOT


def test_the_sample_works(capsys):
    page = (ROOT / "docs" / "daemon.md").read_text()
    (sample,) = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    (promised,) = re.findall(r"print\(.*\) +# (.*)", sample)
    exec(compile(sample, "docs/daemon.md", "exec"), {})
    assert capsys.readouterr().out.strip() == promised
