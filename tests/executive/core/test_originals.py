"""Fawkes' tests of the domain and its synchronisation, on both cores."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.events import Event, EventBus, RuleFired
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import TRUE
from tests.executive.core.core_domain import DOMAIN_FILES
from tests.executive.originals import (
    OLD_WORDS,
    TESTS,
    Original,
    Player,
    make_core,
    read_originals,
    scenes,
)
from tests.support import FAWKES_DIR, needs_fawkes

ORIGINALS = read_originals(FAWKES_DIR) if FAWKES_DIR is not None else []

DOMAIN = {"fawkes": ("plan.clp", "goal.clp", "domain.clp"), "built-in": DOMAIN_FILES}
SYNC = {
    "fawkes": ("worldmodel.clp", "wm-domain-sync.clp"),
    "built-in": (
        "worldmodel.clp",
        "wm-domain-sync.clp",
        "wm-domain-sync-facts.clp",
        "wm-domain-sync-objects.clp",
    ),
}

UNMET = {
    "ErrorIfPreconditionHasNoOperator": ["precondition-without-parent"],
    "ErrorIfOperatorOfPreconditionDoesNotExist": ["precondition-without-parent"],
    "EqualityErrors": [
        "equality-must-have-exactly-two-parameters",
        "equality-must-have-exactly-two-parameters",
        "precondition-with-equality-and-predicate",
    ],
    "PreconditionWithUnknownParameter": ["unknown-parameter"],
}
"""Errors that the cores no longer report, or report only while grounding."""

UNMET_BY_FAWKES = {
    "DisjunctivePreconditions": ["TRUE", "TRUE"],
    "ApplyCondEffectIfCondHolds": ["FINAL", "hello"],
    "ExogenousActionWithValuePredicatePrecondition": ["TRUE"],
}
"""Defects of Fawkes' core (docs/core-domain.md); the built-in core behaves as the tests expect."""


@needs_fawkes
@pytest.mark.parametrize("core", DOMAIN)
@pytest.mark.parametrize("original", ORIGINALS, ids=lambda original: original.name)
def test_original_tests_of_domain(core: str, original: Original, tmp_path: Path) -> None:
    assert FAWKES_DIR is not None
    words = tmp_path / "old-words.clp"
    words.write_text(OLD_WORDS)
    env = make_core(core, FAWKES_DIR, *DOMAIN[core])
    assert env.load(words), env.loader.diagnostics
    if original.domain is not None:
        assert env.load(FAWKES_DIR / TESTS / original.domain), env.loader.diagnostics
    unmet = UNMET | (UNMET_BY_FAWKES if core == "fawkes" else {})
    surprises = Player(env).play(original)
    assert [_missed(surprise) for surprise in surprises] == unmet.get(original.name, []), surprises
    env.destroy()


def _missed(surprise: str) -> str:
    """Return the last value that a query searched without a result."""
    query = surprise.removesuffix(" is FALSE")
    return query.rstrip(")").rpartition(" ")[2] if query != surprise else surprise


@needs_fawkes
def test_all_original_tests_of_domain_are_found() -> None:
    assert len(ORIGINALS) == 31
    assert {original.domain for original in ORIGINALS} == {None, "blocksworld.clp", "conditional_say.clp"}
    assert {*UNMET, *UNMET_BY_FAWKES} <= {original.name for original in ORIGINALS}


# --- wm-domain-sync*.clp ----------------------------------------------------------------------------------

TEXT = "/domain/objects-by-type/text"
HELLO, GOODBYE = "/domain/fact/said?c=hello", "/domain/fact/said?c=goodbye"
DIFFERENT = "/wm/test/different?c=goodbye"
THREE = "goodbye hello sometext"

SCENES = {
    "wm-domain-sync-test": [
        ({TEXT: THREE}, "", THREE),
        ({TEXT: THREE}, "", THREE),
        ({TEXT: THREE, HELLO: "TRUE"}, "said hello", THREE),
        ({TEXT: THREE, HELLO: "FALSE"}, "", THREE),
        ({TEXT: THREE}, "", THREE),
        ({TEXT: THREE, GOODBYE: "TRUE"}, "said goodbye", THREE),
        ({TEXT: THREE, GOODBYE: "TRUE"}, "said goodbye", THREE),
        ({TEXT: THREE}, "", THREE),
    ],
    "wm-domain-sync-path-remap-test": [
        *[({TEXT: THREE}, "", THREE)] * 4,
        *[({TEXT: THREE, DIFFERENT: "TRUE"}, "", THREE)] * 3,
        ({TEXT: THREE}, "", THREE),
    ],
    "wm-domain-sync-object-test": [
        ({TEXT: ""}, "", ""),
        ({TEXT: "hello"}, "", "hello"),
        ({TEXT: ""}, "", ""),
        ({TEXT: THREE}, "", THREE),
        ({TEXT: "hello sometext"}, "", "hello sometext"),
        ({TEXT: ""}, "", ""),
    ],
    "wm-domain-sync-object-remap-test": [
        ({TEXT: ""}, "", ""),
        ({TEXT: "hello"}, "", "hello"),
        *[({TEXT: ""}, "", "")] * 4,
    ],
}
"""wm-facts, domain-facts and domain-objects at each `(facts)`, names sorted, as CLIPS 6.30 prints them."""

FIRINGS = {
    "wm-domain-sync-test": 28,
    "wm-domain-sync-object-test": 17,
    "wm-domain-sync-path-remap-test": 28,
    "wm-domain-sync-object-remap-test": 10,
}
"""Rules that fire in CLIPS 6.30."""

REMAPPED = {"wm-domain-sync-object-remap-test": "/wm/text"}
"""The built-in core reads the configuration before the first list of objects, Fawkes' core after it."""


@needs_fawkes
@pytest.mark.parametrize("core", SYNC)
@pytest.mark.parametrize("name", SCENES)
def test_original_tests_of_synchronisation(core: str, name: str, tmp_path: Path) -> None:
    assert FAWKES_DIR is not None
    bus = EventBus(VirtualClock())
    fired: list[Event] = []
    bus.subscribe(fired.append, RuleFired)
    env = make_core(core, FAWKES_DIR, *DOMAIN[core], *SYNC[core], bus=bus)
    env.eval("(watch rules)")
    env.watcher.set_hooks()
    seen = []
    for number, commands in enumerate(scenes(FAWKES_DIR, f"{name}.clp")):
        file = tmp_path / f"{number}.clp"
        file.write_text(commands)
        assert env.batch(file)
        seen.append(_scene(env))
    assert env.loader.diagnostics == []
    if core == "fawkes":
        assert len(fired) == FIRINGS[name]
    listed = REMAPPED.get(name, TEXT) if core == "built-in" else TEXT
    assert seen == [
        ({listed if fact == TEXT else fact: value for fact, value in known.items()}, atoms, objects)
        for known, atoms, objects in SCENES[name]
    ]
    env.destroy()


def _scene(env: ClipsEnvironment) -> tuple[dict[str, str], str, str]:
    """Return the scene for :data:`SCENES`."""
    known = {
        str(slots["id"]): " ".join(sorted(map(str, slots["values"])))
        if slots["is-list"] == TRUE
        else str(slots["value"])
        for _, _, slots in env.facts("wm-fact")
        if slots["id"] != "/domain/objects-by-type/object"  # every domain has that type
    }
    atoms = (" ".join(map(str, (s["name"], *s["param-values"]))) for _, _, s in env.facts("domain-fact"))
    objects = (str(slots["name"]) for _, _, slots in env.facts("domain-object"))
    return known, " ".join(sorted(atoms)), " ".join(sorted(objects))
