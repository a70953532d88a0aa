"""Clients of Fawkes' protocol against the model of all blackboards."""

from __future__ import annotations

from fawkes_tests.network.site import FawkesSite
from tests.blackboard.machine import SETTINGS, Machine
from tests.blackboard.sites import Site


class FawkesMachine(Machine):
    def make_site(self, window: int) -> Site:
        return FawkesSite(window)


TestMachine = FawkesMachine.TestCase
TestMachine.settings = SETTINGS
