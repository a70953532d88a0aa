"""Files that a daemon writes lie beside the configuration file that names them."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.config import Configuration
from cxbridge.daemon.configuration import read_configuration
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.daemon.settings import DaemonSettings
from cxbridge.events import LogLine
from cxbridge.resources import shipped_dir
from tests.support import needs_plugin

SHIPPED = shipped_dir("scenarios")
WRITTEN = {
    "record/trace": "run.mcap",
    "record/log": "logs/run.log",
    "record/bblog": "bb/",
}
"""Every setting that names a file or folder which a daemon writes."""


def configuration_text(written: dict[str, str]) -> str:
    lines = ["cxbridge:", "  zmq: {endpoints: []}", "  fawkes: {enable: false}", "  record:"]
    lines += [f"    {key.split('/')[1]}: {name}" for key, name in written.items()]
    return "\n".join([*lines, ""])


def files(config: Configuration) -> dict[str, Path | None]:
    settings = DaemonSettings.from_config(config)
    return {
        "record/trace": settings.trace,
        "record/log": settings.log,
        "record/bblog": settings.bblog,
    }


@pytest.fixture
def before() -> set[Path]:
    return set(SHIPPED.rglob("*"))


@needs_plugin("fawkes")
def test_recordings_of_overlay_lie_beside_overlay(tmp_path, before):
    laid_over = tmp_path / "mine" / "over.yaml"
    laid_over.parent.mkdir()
    laid_over.write_text(configuration_text(WRITTEN))
    options = DaemonOptions(config=Path("test-scenario"), overlay=laid_over)
    config, _ = read_configuration(options)
    assert files(config) == {key: laid_over.parent / name for key, name in WRITTEN.items()}
    daemon = Daemon(
        options,
        lambda line: daemon.stop() if isinstance(line, LogLine) and line.text == "Ready" else None,
    )
    assert daemon.run() == 0
    assert (laid_over.parent / "run.mcap").is_file()
    assert (laid_over.parent / "logs" / "run.log").is_file()
    assert set(SHIPPED.rglob("*")) == before
