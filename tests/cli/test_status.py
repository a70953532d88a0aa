"""Exit statuses and messages of exceptions. Status 1 is never an accident."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from cxbridge.cli import main as program
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import ConfigError, TraceError
from cxbridge.run.components.manager import ComponentFailedError
from tests.programs import Started

FULL_DISK = Path("/dev/full")
REFUSED = "the operating system reported an error"
EMFILE, ENOSPC = "Too many open files", "No space left on device"
RESET = "Connection reset by peer"


def failing_app(error):
    def app(*_args, **_named):
        raise error

    return app


def wrapped(outer, inner):
    outer.__cause__ = inner
    return outer


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (ConfigError("x is wrong"), 2, "x is wrong"),
        (OSError(errno.ENOENT, "No such file or directory", "/a"), 2, "/a: No such file or directory"),
        (
            OSError(errno.EMFILE, "Too many open files"),
            4,
            f"{REFUSED}: {EMFILE} (in",
        ),
        (OSError("of no number"), 4, f"{REFUSED}: of no number (in"),
        (OSError(errno.EMFILE, "Too many open files", "/a"), 4, "/a: Too many open files"),
        (OSError(errno.ENOSPC, "No space left on device", "/a"), 4, "/a: No space left on device"),
        (wrapped(TraceError("it fails"), OSError(errno.ENOSPC, "No space left")), 4, "it fails"),
        (wrapped(TraceError("it fails"), OSError(errno.EACCES, "Permission denied")), 2, "it fails"),
        (
            ConnectionResetError(errno.ECONNRESET, "Connection reset by peer"),
            4,
            "Connection reset by peer (in",
        ),
        (TimeoutError("timed out"), 4, "timed out (in"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (ComponentFailedError("zmq: ZMQError: Too many open files"), 4, "zmq: ZMQError"),
    ],
)
def test_errors_have_statuses(monkeypatch, capsys, error, status, said):
    monkeypatch.setattr(program, "app", failing_app(error))
    assert program.invoke([]) == status
    errors = capsys.readouterr().err
    assert said in errors
    assert "stdout" not in errors


def test_internal_fault_is_status_4_with_traceback(monkeypatch, capsys):
    monkeypatch.setattr(program, "app", failing_app(ZeroDivisionError("oh")))
    with pytest.raises(SystemExit) as ended:
        program.main([])
    assert ended.value.code == 4
    errors = capsys.readouterr().err
    assert "Traceback" in errors
    assert "cxbridge: an internal error of cxbridge: ZeroDivisionError: oh" in errors


@pytest.mark.skipif(not FULL_DISK.exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("command", ["doctor", "interface list", "--help"])
def test_full_disk_below_stdout_is_reported(command):
    with FULL_DISK.open("w") as full:
        process = Started(*command.split(), stdout=full)
    _, errors = process.communicate()
    assert "cannot write to stdout: No space left on device" in errors
    assert (process.returncode, "Traceback" in errors) == (2, False)


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (OSError(errno.EMFILE, "Too many open files"), ComponentFailedError),
        (RuntimeError("oh"), ComponentFailedError),
        (ConfigError("wrong"), ConfigError),
    ],
)
def test_failed_start_names_component_and_reason(monkeypatch, error, kind):
    settings = (("fawkes/enable", False), ("zmq/endpoints", ["ipc:///nowhere/bb"]), ("skiller", "none"))
    daemon = Daemon(DaemonOptions(settings=settings))

    def fail():
        raise error

    node = next(node for node in daemon.lifecycle.nodes if node.name == "zmq")
    monkeypatch.setattr(node, "on_configure", fail)
    with pytest.raises(kind) as caught:
        daemon.run()
    if kind is ComponentFailedError:
        assert caught.value.message.startswith(f"zmq: {type(error).__name__}:")
        assert caught.value.exit_status == 4
