"""Programs in a process on a local blackboard, compared with the model of all transports."""

from __future__ import annotations

from tests.blackboard.machine import SETTINGS, Machine
from tests.blackboard.sites import LocalSite, Site


class LocalMachine(Machine):
    def make_site(self, window: int) -> Site:
        return LocalSite(window)


TestMachine = LocalMachine.TestCase
TestMachine.settings = SETTINGS
