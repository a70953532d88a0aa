"""The language server, asked by a real client."""

from __future__ import annotations

from pathlib import Path
from zlib import crc32

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

from cxbridge_studio.check.table import load_codes
from cxbridge_studio.lsp.diagnostics import TEXT_CODES, find_mistakes
from tests.support import ROOT

GOALS, DOMAIN, PDDL, SCENARIO = "meet-goals.clp", "meet-domain.clp", "domain.pddl", "scenario.yaml"


@pytest.fixture(autouse=True)
def opened(editor):
    """All files are open, with the text of the disk."""
    for name in (GOALS, DOMAIN, PDDL, SCENARIO, "skills/say.lua"):
        editor.open(name)


def test_the_codes_are_those_of_check():
    assert load_codes().keys() >= TEXT_CODES


# ---- diagnostics


@pytest.mark.parametrize(
    ("old", "new", "code", "words"),
    [
        ("(mode FORMULATED))\n", "(mode FORMULATED)\n", "CX201", "defrule meet-select never closes"),
        ("?goal <- (goal (id", "?goal <- (gaol (id", "CX202", "did you mean goal?"),
        ("(mode FORMULATED)", "(mood FORMULATED)", "CX203", "did you mean mode?"),
        ("(modify ?goal", "(modfy ?goal", "CX204", "did you mean modify?"),
        ("?id ?*MEET-WANTED*", "?id ?*MEET-WANTD*", "CX205", "did you mean MEET-WANTED?"),
    ],
)
def test_a_mistake_is_marked_while_somebody_types(editor, old, new, code, words):
    right = editor.texts[GOALS]
    assert old in right
    editor.open(GOALS, right.replace(old, new, 1))
    editor.wait(lambda: any(shown == code for shown, _ in editor.shown(GOALS)))
    found = editor.diagnostics(GOALS)
    assert {each.code for each in found} == {code}  # and nothing follows from it
    assert any(words in each.message for each in found)
    assert all(each.severity is lsp.DiagnosticSeverity.Error for each in found)
    editor.open(GOALS, right)
    editor.wait(lambda: editor.shown(GOALS) == [])


def test_the_session_of_the_manual(editor):
    """A typo is marked where it is, and the mark goes with its fix; docs/editors.md shows it."""
    right, said = editor.texts[GOALS], []
    for wrong, typed in (("(mood FORMULATED)", "(mood FORMULATED)"), ("", "(mode FORMULATED)")):
        editor.open(GOALS, right.replace("(mode FORMULATED)", typed, 1))
        editor.wait(lambda wrong=wrong: bool(editor.shown(GOALS)) is bool(wrong))
        said.append(f"-> textDocument/didChange: {typed}")
        for each in editor.diagnostics(GOALS):
            begin, end = each.range.start, each.range.end
            place = f"{begin.line + 1}:{begin.character + 1} to {end.character + 1}"
            said.append(
                f"<- textDocument/publishDiagnostics: {place}, {each.severity.name.lower()} {each.code}"
            )
            said += [f"     {line}" for line in each.message.splitlines()]
        if not wrong:
            said.append("<- textDocument/publishDiagnostics: none")
    page = (ROOT / "docs" / "evidence" / "editors.md").read_text()
    assert "\n".join(said) in page, "\n".join(said)


@pytest.mark.parametrize(
    "text",
    [
        "(assert (total (+ 1 2)))",
        "(deftemplate t (slot s)) (deffunction f (?a) ?a) (defrule r => (assert (u (f 1)) (t (s (f 1)))))",
        "(defrule r (u $? 1) => (do-for-fact ((?f no-such)) TRUE (retract ?f)))",
        "(defrule r (object (is-a USER)) => (foreach ?i (create$ (nth$ 1 (create$ 1))) (printout t ?i)))",
        "(defrule r (u ?x) => (if (eq ?x 1) then (switch ?x (case 1 then (halt)) (default (halt)))))",
        '(defmodule A "of some" (import MAIN ?ALL) (export deftemplate t) (export ?NONE))',
        (
            "(defclass C (is-a USER) (role concrete) (single-slot s (type FLOAT) (range 0.0 ?VARIABLE)"
            " (create-accessor read-write)) (multislot m (default (create$ 1))))"
        ),
        "(definstances i active (c1 of C (s 1.0)) ([c2] of C (s (+ 1.0 2.0)) (m a b)))",
        '(defmessage-handler C say primary "words" (?to $?more) (printout t ?self:s ?to))',
        (
            "(defrule r (object (is-a C) (s ?s)) => (make-instance c3 of C (s ?s))"
            " (any-instancep ((?c C)) (> ?c:s 1)) (modify-instance [c3] (m 1 2)))"
        ),
    ],
)
def test_what_is_right_is_not_marked(editor, text):
    file = f"right-{crc32(text.encode())}.clp"  # diagnostics of another text may come late
    editor.open(file, f"{text}\n(defrule last => (no-such-function))\n")
    editor.wait(lambda: bool(editor.shown(file)))
    assert editor.shown(file) == [("CX204", 2)]
    editor.open(file, "")


@pytest.mark.parametrize(
    "text",
    ["(do-for-fact ((?g goal)) ?g:mood (retract ?g))", "(do-for-fact ((?g goal)) TRUE (modify ?g (mood X)))"],
)
def test_a_wrong_slot_of_a_fact_in_a_variable(editor, text):
    file = f"query-{crc32(text.encode())}.clp"  # diagnostics of another text may come late
    editor.open(file, f"(defrule r => {text})\n")
    editor.wait(lambda: editor.shown(file) == [("CX210", 1)])
    (found,) = editor.diagnostics(file)
    assert found.severity is lsp.DiagnosticSeverity.Error
    editor.open(file, "")


def test_a_mistake_in_a_domain_and_in_a_configuration(editor):
    editor.open(PDDL, editor.texts[PDDL].replace("(said ?name HELLO)", "(sad ?name HELLO)", 1))
    editor.wait(lambda: [code for code, _ in editor.shown(PDDL)] == ["CX301"])
    editor.open(SCENARIO, editor.texts[SCENARIO] + "\n  a: [\n")
    editor.wait(lambda: "CX101" in [code for code, _ in editor.shown(SCENARIO)])
    editor.open(PDDL)
    editor.open(SCENARIO)
    editor.wait(lambda: editor.shown(PDDL) == [] == editor.shown(SCENARIO))


def test_the_whole_check_follows_when_a_file_is_saved(editor):
    """A mistake that the text of one file does not show: an action that the domain lacks."""
    right = editor.texts[SCENARIO]
    editor.open(SCENARIO, right.replace("say-goodbye: say", "say-godbye: say"))
    editor.save(SCENARIO)
    editor.wait(lambda: "CX401" in [code for code, _ in editor.shown(SCENARIO)])
    editor.open(SCENARIO, right)
    editor.save(SCENARIO)
    editor.wait(lambda: editor.shown(SCENARIO) == [])


# ---- hover


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        (
            GOALS,
            "goal (id TESTGOAL) (mode",
            ["(deftemplate goal", "A goal to achieve (ACHIEVE), or a condition"],
        ),
        (GOALS, "mode SELECTED", ["allowed-values FORMULATED", "of the deftemplate **goal**"]),
        (GOALS, "modify ?goal (mode", ["modify", "a function of"]),
        (GOALS, "planner-plan ?id", ["planner-plan"]),
        (GOALS, "MEET-WANTED* =", ["said PEGGY GOODBYE"]),
        (DOMAIN, "say-hello|say", [":action say-hello", "*action*, domain.pddl"]),
        (DOMAIN, "said) (param", ["(said ?n - name ?t - text)", "seen, not assumed"]),
        (DOMAIN, "parse-pddl-domain", ["feature `pddl-parser`", "1 argument"]),
        (SCENARIO, "say-hello: say", [":action say-hello"]),
        (SCENARIO, "name)y", ["(?name - name)"]),
        (SCENARIO, "say{text", ["skill **say**", "Say something."]),
        (SCENARIO, "wait=true", ["argument of the skill **say**", "final when it has been said"]),
        ("skills/say.lua", "SpeechSynthInterface", ["interface **SpeechSynthInterface**", "`msgid`"]),
    ],
)
def test_hover(editor, name, text, words):
    shown = editor.hover(name, text)
    for word in words:
        assert word in shown


def test_hover_of_a_rule_of_the_core(editor):
    path = "rule-of-core.clp"
    editor.open(path, "(defrule goal-without-id => )\n")
    shown = editor.hover(path, "goal-without-id")
    assert "defrule goal-without-id" in shown
    editor.open(path, ";; nothing\n")


def test_nothing_is_said_of_a_comment(editor):
    assert editor.hover(GOALS, "said good bye") == ""


# ---- completion


@pytest.mark.parametrize(
    ("written", "wanted", "unwanted"),
    [
        ("(defrule a (go", {"goal", "and", "not"}, {"modify", "mode"}),
        ("(defrule a (goal (mo", {"mode", "id", "class", "sub-type"}, {"goal", "modify"}),
        ("(defrule a (goal (mode ", {"FORMULATED", "SELECTED", "RETRACTED"}, {"goal"}),
        ("(defrule a (goal (class ", {"SAY-GOODBYE"}, {"FORMULATED"}),
        ("(defrule a ?g <- (goal) => (", {"modify", "retract", "goal-param-positive"}, {"mode"}),
        ("(defrule a ?g <- (goal) => (modify ?g (", {"mode", "outcome"}, {"modify"}),
        ("(defrule a ?g <- (goal) => (modify ?g (outcome ", {"COMPLETED", "FAILED"}, {"mode"}),
        ("(defrule a => (assert (plan-action (", {"action-name", "param-values"}, {"goal"}),
        ("(defrule a => (assert (plan-action (action-name ", {"say-hello", "say-goodbye"}, {"goal"}),
        (
            "(defrule a => (assert (plan-action (action-name say-hello) (param-names ",
            {"name"},
            {"say-hello"},
        ),
        ("(defrule a => (printout t ?*ME", {"?*MEET-WANTED*", "?*MEET-MAX-TRIES*"}, {"goal"}),
        ("(defrule a ?g <- (goal) (test (eq ?g:", {"?g:mode", "?g:id"}, {"mode"}),
        ("(", {"defrule", "deftemplate", "defglobal"}, {"goal"}),
    ],
)
def test_completion_in_clips(editor, written, wanted, unwanted):
    before = editor.texts[GOALS]
    editor.open(GOALS, before + "\n" + written)
    found = set(editor.complete(GOALS, before[-20:] + "\n" + written))
    assert found >= wanted
    assert not found & unwanted


@pytest.mark.parametrize(
    ("name", "old", "new", "behind", "wanted"),
    [
        (
            SCENARIO,
            "        say-hello: say{",
            "        say-: say{",
            "        say-",
            {"say-hello", "say-goodbye"},
        ),
        (SCENARIO, "say-hello: say{text", "say-hello: s", "say-hello: s", {"say", "moveto"}),
        (SCENARIO, 'say{text="Hello', "say{te", "say-hello: say{te", {"text", "wait"}),
        (SCENARIO, "?(name)y", "?(", "Hello ?(", {"name"}),
        (SCENARIO, "file: meet-domain.clp", "file: ", "file: ", {"meet-domain.clp", "skills-actions.clp"}),
        (PDDL, "(?name - name)", "(?name - ", "(?name - ", {"name", "text"}),
        (PDDL, ":effect (said", ":effect (", ":effect (", {"said", "and", "not"}),
    ],
)
def test_completion_elsewhere(editor, name, old, new, behind, wanted):
    right = editor.texts[name]
    assert old in right
    editor.open(name, right.replace(old, new, 1))
    assert set(editor.complete(name, behind)) >= wanted


# ---- places


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        (GOALS, "goal (id TESTGOAL) (mode", [("goal.clp", 12)]),
        (GOALS, "meet-tries ?", []),
        (DOMAIN, "say-hello|say", [("domain.pddl", 17)]),
        (DOMAIN, '"domain.pddl"', [("domain.pddl", 1)]),
        (SCENARIO, "say-goodbye:", [("domain.pddl", 12)]),
        (SCENARIO, "name)y", [("domain.pddl", 18)]),
        (SCENARIO, "say{text", [("say.lua", 3)]),
        (SCENARIO, "meet-goals.clp", [("meet-goals.clp", 1)]),
        ("skills/say.lua", "SpeechSynthInterface", [("SpeechSynthInterface.xml", 3)]),
    ],
)
def test_definition(editor, name, text, expected):
    place = lsp.DefinitionParams(**editor.at(name, text))
    found = editor.places(editor.run(editor.client.text_document_definition_async(place)))
    if text.startswith("say{"):
        found = [each for each in found if each in expected]  # the shipped one has the name, too
    assert found == expected


def test_references_go_across_clips_pddl_and_yaml(editor):
    place = lsp.ReferenceParams(
        **editor.at(PDDL, "say-hello"), context=lsp.ReferenceContext(include_declaration=True)
    )
    found = editor.places(editor.run(editor.client.text_document_references_async(place)))
    assert found == [("domain.pddl", 17), ("meet-domain.clp", 31), ("scenario.yaml", 18)]


def test_rename_changes_every_file(editor):
    place = lsp.RenameParams(**editor.at(PDDL, "say-hello"), new_name="greet")
    edit = editor.run(editor.client.text_document_rename_async(place))
    changed = {
        uri.rsplit("/", 1)[1]: [each.new_text for each in edits] for uri, edits in edit.changes.items()
    }
    assert changed == {"domain.pddl": ["greet"], DOMAIN: ["greet"], SCENARIO: ["greet"]}
    place = lsp.RenameParams(**editor.at(GOALS, "?*MEET-WANTED*", inside=4), new_name="WANTED")
    edit = editor.run(editor.client.text_document_rename_async(place))
    assert {each.new_text for edits in edit.changes.values() for each in edits} == {"?*WANTED*"}


@pytest.mark.parametrize(
    ("text", "new", "why"),
    [
        ("goal (id TESTGOAL) (mode", "aim", "is defined outside"),
        ("meet-begin", "meet-select", "there is a rule 'meet-select' already"),
        ("meet-begin", "two words", "cannot be the name"),
    ],
)
def test_what_cannot_be_renamed(editor, text, new, why):
    place = lsp.RenameParams(**editor.at(GOALS, text), new_name=new)
    with pytest.raises(JsonRpcException, match=why):
        editor.run(editor.client.text_document_rename_async(place))


# ---- files


def test_symbols(editor):
    document = lsp.TextDocumentIdentifier(editor.uri(GOALS))
    found = editor.run(editor.client.text_document_document_symbol_async(lsp.DocumentSymbolParams(document)))
    names = [(each.name, each.kind, each.range.start.line + 1) for each in found]
    assert ("MEET-WANTED", lsp.SymbolKind.Variable, 3) in names
    assert ("meet-begin", lsp.SymbolKind.Event, 6) in names
    everywhere = editor.run(editor.client.workspace_symbol_async(lsp.WorkspaceSymbolParams("meetbgn")))
    assert "meet-begin" in [each.name for each in everywhere]


def test_formatting(editor):
    right = editor.texts[GOALS]
    editor.open(GOALS, right.replace("  (goal (id ?id) (class SAY", "\t(goal (id ?id) (class SAY"))
    parameters = lsp.DocumentFormattingParams(
        lsp.TextDocumentIdentifier(editor.uri(GOALS)), lsp.FormattingOptions(tab_size=2, insert_spaces=True)
    )
    (edit,) = editor.run(editor.client.text_document_formatting_async(parameters))
    assert edit.new_text == right
    assert edit.range.end.line == right.count("\n")


def test_a_place_behind_characters_of_two_units(editor):
    """Positions count in UTF-16 units."""
    name = "wide.clp"
    editor.open(name, '(defrule wide (goal) => (printout t "\U0001f916 \U0001f916" (create$ 1)))\n')
    assert "create$" in editor.hover(name, "create$")
    editor.open(name, "")


def test_the_agents_of_a_checkout_have_no_false_error(fawkes_agent):
    """Of all that the text shows, there is Fawkes' parenthesis, and a slot that its queries lack."""
    session, spec = fawkes_agent
    found = {
        (each.code.name, Path(file.path).name, file.lines.at(each.start))
        for file in session.model.files
        if file.path in session.knowledge.loaded_files
        for each in find_mistakes(session, file)
    }
    known = {("CX210", "domain.clp", line) for line in (892, 941)}
    assert found == known | {("CX201", "skills.clp", 189)}, spec


def test_files_beside_the_scenario(editor):
    (editor.root / "world.yaml").write_text("skills:\n  - name: sey\n")
    editor.save(SCENARIO)
    editor.wait(lambda: ("CX121", 2) in editor.shown("world.yaml"))
    (editor.root / "world.yaml").unlink()
    editor.save(SCENARIO)
    editor.wait(lambda: editor.shown("world.yaml") == [])
