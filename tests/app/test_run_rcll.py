"""The RCLL agent's specs, unchanged, with all the features that they ask for."""

from __future__ import annotations

import socket
from itertools import chain

import pytest

from cxbridge.app import RunOptions
from cxbridge.app.assembly import Assembly
from cxbridge.events import Level
from tests.executive.conftest import Log
from tests.executive.protobuf.conftest import free_port
from tests.support import FAWKES_DIR, ROBOTINO_DIR, needs_robotino

pytest.importorskip("grpc_tools", reason="the extra 'protobuf' (grpcio-tools) is not installed")

FEATURES = ["motor-switch", "navgraph", "pddl-parser", "protobuf", "robot_memory", "tf"]
MISTAKES = {
    "rcll": [
        "Redefining deffunction: str-replace",
        "unwatch: Unable to find deftemplate",
        "Execution halted during the actions of defrule 'exploration-interfaces-init'",
    ],
    "rcll-central": [
        "Redefining deffunction: str-replace",
        "Redefining deffunction: goal-meta-assign-robot-to-goal",
        "exploration.clp:79: defrule exp-sync-zone-content is not defined: Variable ?team-clor",
    ],
}
"""What is wrong in the agent's own files; Fawkes tells the same."""

DOMAIN = "Domain error 'value-predicate-without-paired-effect'"


def options(folder, spec):
    """The options of a run whose peers talk to loopback, on ports of this test only."""
    assert FAWKES_DIR is not None
    assert ROBOTINO_DIR is not None
    ports = [
        f"          {colour}-{way}-port: {free_port(socket.SOCK_DGRAM)}"
        for colour in ("peer", "cyan", "magenta")
        for way in ("send", "recv")
    ]
    overlay = folder / "overlay.yaml"
    overlay.write_text(
        "\n".join(
            [
                f"clips-protobuf:\n  proto-dirs: ['{ROBOTINO_DIR}/src/agents/llsf2013/msgs']",
                f"clips-executive:\n  specs:\n    {spec}:\n      parameters:\n        rcll:",
                "          peer-address: 127.0.0.1",
                *ports,
            ]
        )
        + "\n"
    )
    return RunOptions(
        scenario=ROBOTINO_DIR / "cfg",
        fawkes_dir=FAWKES_DIR,
        spec=spec,
        config=overlay,
        clips_dirs=(ROBOTINO_DIR / "src/clips-specs",),
        interface_dirs=(
            ROBOTINO_DIR / "src/libs/interfaces",
            *sorted(ROBOTINO_DIR.glob("src/plugins/*/interfaces")),
        ),
        skiller="none",
    )


@needs_robotino
@pytest.mark.parametrize("spec", MISTAKES)
def test_the_agent_initialises_and_runs_a_thousand_loops(tmp_path, spec):
    with Assembly(options(tmp_path, spec)) as run:
        log = Log(run.bus)
        run.start()
        for _ in range(1000):
            run.loop.run_once()
        env = run.executive.env
        loaded = set(chain(*(slots["implied"] for _, _, slots in env.facts("ff-feature-loaded"))))
        assert run.executive.initialized
        assert env.faults == []
        assert loaded >= set(FEATURES)
        assert [text for text in log.texts(Level.ERROR) if DOMAIN not in text and not known(text, spec)] == []
        assert next(env.facts("navgraph-node"), None) is not None
        peers = [
            slots for _, _, slots in env.facts("wm-fact") if slots["id"] == "/refbox/comm/peer-id/public"
        ]
        assert [slots["value"] > 0 for slots in peers] == [True]


def known(text, spec):
    return any(mistake in text for mistake in MISTAKES[spec])
