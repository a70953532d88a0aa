"""The unchanged specs of the RCLL agent with all their features."""

from __future__ import annotations

import re
import socket
from itertools import chain
from pathlib import Path

import pytest

from cxbridge.events import Level
from cxbridge.run import RunOptions
from cxbridge.run.agent import Run
from tests.executive.conftest import Log
from tests.support import FAWKES_DIR, ROBOTINO_DIR, free_port, needs_robotino

FEATURES = ["motor-switch", "navgraph", "pddl-parser", "protobuf", "robot_memory", "tf"]

SKILLS = (
    "skills.clp:187",
    "defrule skill-status-update-nochange",
    "a parenthesis that opens here is never closed: the rest of the file is not loaded",
)
"""A defect of Fawkes' own skills.clp."""

TYPO = (
    "exploration.clp:79",
    "defrule exp-sync-zone-content",
    "Variable ?team-clor found in the expression (eq ?team-clor MAGENTA)",
)
"""A defect of the agent."""

BROKEN = {
    "rcll": [SKILLS],
    "rcll-central": [
        SKILLS,
        TYPO,
    ],
}
"""The undefined constructs in the order of loading, which are also undefined in CLIPS 6.30."""


def unpaired_effect_errors(*effects: str) -> list[str]:
    """Return the domain's errors about operators that set a value without removing the old value."""
    return [
        f"Domain error 'value-predicate-without-paired-effect': Effect GEN of operator {operator} on "
        f"{predicate} ({parameter}) is not matched with a complementary effect"
        for operator, predicate, parameter in (effect.split() for effect in effects)
    ]


ERRORS = {
    "rcll": [
        "Redefining deffunction: str-replace",
        "[PRCCODE4] Execution halted during the actions of defrule 'exploration-interfaces-init'.",
        "unwatch: Unable to find deftemplate 'AX12GripperInterface'.",
        *unpaired_effect_errors("reset-mps mps-state m"),
    ],
    "rcll-central": [
        "Redefining deffunction: str-replace",
        "Redefining deffunction: goal-meta-assign-robot-to-goal",
        f"exploration.clp:79: {TYPO[1]} is not defined: {TYPO[2]} [ANALYSIS4]",
        *unpaired_effect_errors(
            "reset-mps mps-state m",
            "explore-zone zone-content z",
            "wp-get mps-state m",
            "goal-instruct-bs-dispense-base mps-state target-mps",
            "goal-instruct-cs-buffer-cap mps-state target-mps",
            "goal-instruct-cs-mount-cap mps-state target-mps",
            "goal-instruct-ds-deliver mps-state target-mps",
            "goal-instruct-ds-discard mps-state target-mps",
            "goal-instruct-rs-mount-ring mps-state target-mps",
        ),
    ],
}
"""The error lines of a run, which docs/evidence/fidelity.md explains."""


def options(folder, spec):
    """Return the options of a run whose peers use free ports on the loopback."""
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
@pytest.mark.parametrize("spec", BROKEN)
def test_agent_initialises_and_runs_thousand_loops(tmp_path, spec):
    with Run(options(tmp_path, spec)) as run:
        log = Log(run.bus)
        run.start()
        for _ in range(1000):
            run.loop.run_once()
        env = run.executive.env
        loaded = set(chain(*(slots["implied"] for _, _, slots in env.facts("ff-feature-loaded"))))
        assert run.executive.is_initialized
        assert env.faults == []
        assert loaded >= set(FEATURES)
        assert [
            (f"{Path(mistake.file).name}:{mistake.line}", mistake.construct, mistake.message)
            for mistake in env.loader.diagnostics
        ] == BROKEN[spec]
        assert sorted(without_generated_names(text) for text in log.texts(Level.ERROR)) == sorted(
            ERRORS[spec]
        )
        assert next(env.facts("navgraph-node"), None) is not None
        peers = [
            slots for _, _, slots in env.facts("wm-fact") if slots["id"] == "/refbox/comm/peer-id/public"
        ]
        assert [slots["value"] > 0 for slots in peers] == [True]


@needs_robotino
@pytest.mark.parametrize(("spec", "ends"), [("rcll", False), ("rcll-central", True)])
def test_agent_closes_or_reopens_peer_at_end(tmp_path, spec, ends):
    with Run(options(tmp_path, spec)) as run:
        log = Log(run.bus)
        run.start()
        run.loop.run_once()
        initial_count = len(log.lines)
    texts = [line.text for line in log.lines[initial_count:]]
    cycles = [text for text in texts if "they fire in a cycle" in text]
    assert texts[0] == "Closing local peer (public)"
    assert ("Enabling local peer (public)" in texts, bool(cycles)) == (not ends, not ends)


def without_generated_names(text: str) -> str:
    """Return a line without the checkout's folder and without generated names."""
    return re.sub(r"\bgen\d+\b", "GEN", re.sub(r"^/\S*/", "", text))
