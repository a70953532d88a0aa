"""The notifications for systemd; without a reader the service goes on."""

from __future__ import annotations

import socket

from cxbridge.daemon.systemd import SystemdNotifier


def test_full_socket_of_systemd_does_not_block(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        notifier = SystemdNotifier(str(tmp_path / "notify"))
        for _ in range(10_000):  # more than any queue holds
            notifier.report_alive()
