"""``cx.connect`` opens blackboards with a default clock and registry."""

from __future__ import annotations

import cxbridge as cx


def test_connect_opens_local_blackboard():
    with cx.connect("local:") as board:
        battery = board.open_for_writing(cx.BatteryInterface, "Robot", owner="driver")
        reader = board.open_for_reading(cx.BatteryInterface, "Robot")
        battery.voltage = 24_000
        battery.write()
        reader.read()
        assert reader.voltage == 24_000


def test_interface_dirs_have_precedence(tmp_path):
    (tmp_path / "MineInterface.xml").write_text(
        '<interface name="MineInterface" author="me" year="2026">'
        "<data><comment>mine</comment><field type='uint32' name='count'>how many</field></data></interface>"
    )
    with cx.connect("local:", interface_dirs=[tmp_path]) as board:
        assert board.open_for_reading("MineInterface", "a").as_dict() == {"count": 0}
