"""The sample of docs/skill-board.md works as it stands there."""

from __future__ import annotations

import re
from typing import Any

from cxbridge.skiller.board import ExecutorContext
from cxbridge.skiller.board.host import ExecutorHost
from tests.skiller.board.rig import Rig, call, states
from tests.support import ROOT

SAMPLE = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


def test_the_sample_works():
    (source,) = SAMPLE.findall((ROOT / "docs" / "skill-board.md").read_text())
    names: dict[str, Any] = {}
    exec(source, names)
    rig = Rig()
    skills = rig.skills()
    context = ExecutorContext("robot1", rig.board, rig.clock, rig.bus.logger("wave"))
    rig.hosts.append(ExecutorHost(names["Wave"](context), "robot1-wave"))
    wave, bow = skills.request(call("wave", "robot1")), skills.request(call("bow", "robot1", times=11))
    rig.until(lambda: wave.is_over and bow.is_over)
    assert states(wave, bow) == ["SUCCEEDED", "FAILED"]
    assert bow.error == "my arm would fall off"
    assert [line for line in rig.lines if line.startswith("I")] == [f"I wave {n}" for n in (1, 2, 3)]
    rig.close()
