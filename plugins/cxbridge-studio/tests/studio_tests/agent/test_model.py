"""The model of an agent has the names in whole and broken files, with their places."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge_studio.agent.model import AgentModel
from cxbridge_studio.agent.names import Name, NameKind, Use
from tests.support import FAWKES_DIR, ROBOTINO_DIR, needs_fawkes, needs_robotino

CLIPS = """\
(deftemplate cup "A cup." (slot colour) (multislot owners))
(defglobal ?*MOST* = 3 ?*LEAST* = (- ?*MOST* 2))
(deffunction wash (?cup) (modify ?cup (colour white)) ?*MOST*)
(defrule take
  ?c <- (cup (colour ~red&?x&:(neq ?x blue)) (owners $? bob))
  (not (and (goal (class SERVE|DRINK) (mode FORMULATED)) (exists (shelf ?n))))
  (test (> ?*LEAST* 1))
  =>
  (bind ?n (assert (plan-action (action-name pour) (param-names what where))))
  (modify ?c (owners alice))
  (do-for-all-facts ((?g goal)) (eq ?g:class SERVE) (retract ?g))
  (wash ?c))
"""


def make_model(**files: str) -> AgentModel:
    model = AgentModel()
    for name, text in files.items():
        model.update("/agent/" + name.replace("__", "."), text)
    return model


def list_mentions(text: str) -> list[tuple[str, str, str, str]]:
    model = make_model(a__clp=text)
    (file,) = model.files
    for mention in file.mentions:
        assert text[mention.start : mention.end].strip("$?*") == mention.name.text
    return [(m.name.kind.value, m.name.text, m.name.owner, m.use.value) for m in file.mentions]


def test_mentions_of_templates_slots_and_globals():
    assert list_mentions(CLIPS)[:9] == [
        ("template", "cup", "", "defined"),
        ("slot", "colour", "cup", "defined"),
        ("slot", "owners", "cup", "defined"),
        ("global", "MOST", "", "defined"),
        ("global", "LEAST", "", "defined"),
        ("function", "-", "", "called"),
        ("global", "MOST", "", "read"),
        ("function", "wash", "", "defined"),
        ("function", "modify", "", "called"),
    ]


def test_mentions_in_rule_have_uses():
    mentions = list_mentions(CLIPS[CLIPS.index("(defrule") :])
    assert mentions[:8] == [
        ("rule", "take", "", "defined"),
        ("template", "cup", "", "matched"),
        ("slot", "colour", "cup", "matched"),
        ("function", "neq", "", "called"),
        ("slot", "owners", "cup", "matched"),
        ("template", "goal", "", "matched"),
        ("slot", "class", "goal", "matched"),
        ("goal class", "SERVE", "", "matched"),
    ]
    assert {
        ("template", "shelf", "", "matched"),
        ("template", "plan-action", "", "asserted"),
        ("action", "pour", "", "asserted"),
        ("parameter", "where", "", "asserted"),
        ("slot", "owners", "cup", "changed"),  # ?c is a cup
        ("template", "goal", "", "queried"),
        ("slot", "class", "goal", "queried"),  # ?g:class
        ("function", "wash", "", "called"),
    } <= set(mentions)
    assert ("function", "and", "", "called") not in mentions


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("(defrule a (b) => (c)\n(defrule d (e) => )\n", [("a", False), ("d", True)]),
        ('(defrule a => (printout t "x)))\n(defrule d (e) => (f "y"))\n', [("a", False), ("d", True)]),
        ("(defrule a (b)) => (c))\n(defrule d (e) => )\n", [("a", True), ("d", True)]),
        ("(defrule a =>)\n(deff", [("a", True)]),
        ('(defrule a => (build "\n(defrule b =>)"))(defrule d =>)', [("a", True), ("d", True)]),
        (")))\n(defrule d =>)", [("d", True)]),
    ],
    ids=["parenthesis", "quote", "extra parenthesis", "at the end", "in a string", "at the start"],
)
def test_broken_construct_does_not_hide_next_constructs(text, expected):
    (file,) = make_model(a__clp=text).files
    names = [(p.piece.name.text, p.piece.is_closed) for p in file.pieces if p.piece.name is not None]
    assert names == expected


def test_update_reads_only_changed_constructs():
    model = make_model(a__clp=CLIPS)
    (before,) = model.files
    after = model.update("/agent/a.clp", ";; moved\n" + CLIPS.replace("alice", "carol"))
    assert after is not None
    same = [a.piece is b.piece for a, b in zip(before.pieces, after.pieces, strict=True)]
    assert same == [True, True, True, False]
    assert after.text[after.mentions[0].start :].startswith("cup")


DOMAIN = """\
(define (domain d)
  (:types cup place - object)
  (:constants SHELF - place)
  (:predicates (at ?c - cup ?p - place))
  (:action pour :parameters (?what - cup) ; (what
    :precondition (and (at ?what SHELF))
    :effect (not (at ?what SHELF)))
  (:action drink :parameters (?c - cup) :precondition (at ?c SHELF) :effect (at ?c SHELF)))
"""


def test_names_of_domain():
    model = make_model(d__pddl=DOMAIN)
    (file,) = model.files
    for mention in file.mentions:
        assert DOMAIN[mention.start : mention.end] == mention.name.text
    names = {
        NameKind.ACTION: {"pour", "drink"},
        NameKind.PARAMETER: {"what", "c"},
        NameKind.OBJECT_TYPE: {"cup", "place"},
        NameKind.CONSTANT: {"SHELF"},
    }
    assert {kind: model.find_names(kind, Use.DEFINED) for kind in names} == names
    assert model.find_names(NameKind.PARAMETER, owner="pour") == {"what"}
    assert len(list(model.find_mentions(Name(NameKind.PREDICATE, "at")))) == 5
    assert [p.piece.name and p.piece.name.text for p in file.pieces][-2:] == ["pour", "drink"]


@pytest.mark.parametrize(
    "text",
    [DOMAIN.replace("(at ?what SHELF))", "(at ?what SHELF)"), DOMAIN.replace("- cup) ;", "- cup)) ;")],
    ids=["open", "closed twice"],
)
def test_broken_domain_has_actions(text):
    model = make_model(d__pddl=text)
    (file,) = model.files
    assert file.problem is not None
    assert model.find_names(NameKind.ACTION, Use.DEFINED) == {"pour", "drink"}
    for mention in file.mentions:
        assert text[mention.start : mention.end] == mention.name.text


YAML = """\
clips-executive:
  spec: tea
  specs:
    tea:
      blackboard-preload: [MotorInterface]
      init:
        stage-1:
          - name: blackboard
        stage-3:
          - name: tea
            files: [tea.clp, "BATCH|cups.clp"]
      action-mapping:
        pour: pour_it{what=?(what)s, into="?(cup)Y"}
        drink: >
          drink{from=?(cup)s}
"""


def test_names_of_configuration():
    model = make_model(s__yaml=YAML)
    (file,) = model.files
    for mention in file.mentions:
        assert YAML[mention.start : mention.end] == mention.name.text
    found = {(m.name.kind.value, m.name.text, m.name.owner) for m in file.mentions}
    assert found == {
        ("spec", "tea", ""),
        ("interface", "MotorInterface", ""),
        ("feature", "blackboard", ""),
        ("file", "tea.clp", ""),
        ("file", "cups.clp", ""),
        ("action", "pour", ""),
        ("action", "drink", ""),
        ("skill", "pour_it", ""),
        ("skill", "drink", ""),
        ("argument", "what", "pour_it"),
        ("argument", "into", "pour_it"),
        ("argument", "from", "drink"),
        ("parameter", "what", "pour"),
        ("parameter", "cup", "pour"),
        ("parameter", "cup", "drink"),
    }


@needs_fawkes
def test_fawkes_files_have_one_unclosed_construct():
    assert FAWKES_DIR is not None
    model = AgentModel()
    for path in sorted(FAWKES_DIR.glob("src/plugins/**/*.clp")):
        model.read(path)
    broken = [
        (Path(file.path).name, file.lines.line_at(placed.start))
        for file in model.files
        for placed in file.pieces
        if not placed.piece.is_closed
    ]
    assert broken == [("skills.clp", 187)]


@needs_robotino
def test_model_has_all_rules_of_rcll_agent():
    assert ROBOTINO_DIR is not None
    for path in sorted(ROBOTINO_DIR.glob("src/clips-specs/**/*.clp")):
        model = AgentModel()
        file = model.read(path)
        assert file is not None
        for mention in file.mentions:
            written = file.text[mention.start : mention.end].rpartition("::")[2]
            assert mention.name.text in (written, written.strip("$?*"))
        rows = [row for row in file.text.splitlines() if row.lstrip().startswith("(defrule ")]
        assert len(list(model.find_definitions_of_kind(NameKind.RULE))) == len(rows), path


def test_calls_in_ordered_fact_are_found():
    text = "(deftemplate cup (slot wash))\n(defrule r => (assert (total (wash 1)) (cup (wash 2))) (wash 3))\n"
    model = make_model(a__clp="(deffunction wash (?x) ?x)\n" + text)
    calls = [file.text[mention.start : mention.end + 2] for file, mention in model.find_calls("wash")]
    assert sorted(calls) == ["wash 1", "wash 3"]
