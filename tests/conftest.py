"""Settings for all tests."""

from __future__ import annotations

import signal
from contextlib import suppress

from hypothesis import HealthCheck, settings

# other work on the machine must not fail a property
settings.register_profile("cxbridge", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("cxbridge")

# a shell's background jobs ignore SIGINT and hand that on: what the tests start shall hear it
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.default_int_handler)
