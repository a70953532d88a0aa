"""Daemons with services for their world model, and the clients of the services."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cxbridge.clock import RealClock
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.definitions import TYPE_DEFINITIONS
from cxbridge_ros2.transports.dds import DdsNode
from tests.daemon.test_daemon import running
from tests.support import ROOT

HERE = Path(__file__).parent
AGENT = HERE / "agent"
FAST = "\nfawkes: {mainapp: {desired_loop_time: 4000}}\n"
"""The daemon handles requests 250 times a second instead of 30 times."""

MEETING = ROOT / "scenarios" / "test-scenario-pddl"


def write_configuration(folder: Path, agent: Path, experts: str, more: str = "") -> Path:
    """Write the configuration of an agent with experts.

    :param experts: the settings of the experts, in braces.
    :param more: settings of ``cxbridge:``.
    """
    text = next(agent.glob("*.yaml")).read_text().replace("clips-dirs: []", f"clips-dirs: ['{agent}']")
    text += FAST
    text += f"\ncxbridge: {{fawkes: {{enable: false}}, zmq: {{endpoints: []}}{more}}}\n"
    file = folder / "daemon.yaml"
    file.write_text(f"{text}ros2: {{experts: {experts}}}\n")
    return file


@contextmanager
def run_agent(
    folder: Path, domain: int, agent: Path = AGENT, experts: str = "", more: str = ""
) -> Iterator[Daemon]:
    """Run the daemon of an agent with experts."""
    defaults = {"serve": "serve: all, ", "distribution": "distribution: iron, "}
    rest = "".join(text for key, text in defaults.items() if f"{key}:" not in experts)
    settings = f"{{{rest}domain: {domain}{experts}}}"
    with running(DaemonOptions(config=write_configuration(folder, agent, settings, more))) as (daemon, _, _):
        yield daemon


@contextmanager
def join_client(domain: int, namespace: str = "") -> Iterator[ExpertClient]:
    """Join a domain as a client of the experts."""
    with DdsNode("asks", Definitions(environment={}, texts=TYPE_DEFINITIONS), domain) as node:
        yield ExpertClient(node, RealClock(), namespace, server_timeout_s=10.0)
