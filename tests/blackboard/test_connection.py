"""``cx.connect``: a blackboard without clock and registry by hand."""

from __future__ import annotations

import cxbridge as cx


def test_a_blackboard_of_this_program():
    with cx.connect("local:") as board:
        battery = board.open_for_writing(cx.BatteryInterface, "Robot", owner="driver")
        seen = board.open_for_reading(cx.BatteryInterface, "Robot")
        battery.voltage = 24_000
        battery.write()
        seen.read()
        assert seen.voltage == 24_000


def test_own_definitions_come_first(tmp_path):
    (tmp_path / "MineInterface.xml").write_text(
        '<interface name="MineInterface" author="me" year="2026">'
        "<data><comment>mine</comment><field type='uint32' name='count'>how many</field></data></interface>"
    )
    with cx.connect("local:", interface_dirs=[tmp_path]) as board:
        assert board.open_for_reading("MineInterface", "a").as_dict() == {"count": 0}
