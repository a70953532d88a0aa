"""The language server with a client in an editor."""

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
    """Open all files with the text on the disk."""
    for name in (GOALS, DOMAIN, PDDL, SCENARIO, "skills/say.lua"):
        editor.open(name)


def test_codes_are_codes_of_check():
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
def test_mistake_in_unsaved_text_is_marked(editor, old, new, code, words):
    right = editor.texts[GOALS]
    assert old in right
    editor.open(GOALS, right.replace(old, new, 1))
    editor.wait_until(lambda: any(shown == code for shown, _ in editor.list_codes(GOALS)))
    diagnostics = editor.diagnostics(GOALS)
    assert {diagnostic.code for diagnostic in diagnostics} == {code}  # and no finding about a consequence
    assert any(words in diagnostic.message for diagnostic in diagnostics)
    assert all(diagnostic.severity is lsp.DiagnosticSeverity.Error for diagnostic in diagnostics)
    editor.open(GOALS, right)
    editor.wait_until(lambda: editor.list_codes(GOALS) == [])


def test_session_of_manual(editor):
    """The fix of a typo removes the diagnostic; docs/evidence/editors.md shows the messages."""
    right, transcript = editor.texts[GOALS], []
    for mistake, typed in (("(mood FORMULATED)", "(mood FORMULATED)"), ("", "(mode FORMULATED)")):
        editor.open(GOALS, right.replace("(mode FORMULATED)", typed, 1))
        editor.wait_until(lambda mistake=mistake: bool(editor.list_codes(GOALS)) is bool(mistake))
        transcript.append(f"-> textDocument/didChange: {typed}")
        for mark in editor.diagnostics(GOALS):
            begin, end = mark.range.start, mark.range.end
            place = f"{begin.line + 1}:{begin.character + 1} to {end.character + 1}"
            transcript.append(
                f"<- textDocument/publishDiagnostics: {place}, {mark.severity.name.lower()} {mark.code}"
            )
            transcript += [f"     {line}" for line in mark.message.splitlines()]
        if not mistake:
            transcript.append("<- textDocument/publishDiagnostics: none")
    page = (ROOT / "docs" / "evidence" / "editors.md").read_text()
    assert "\n".join(transcript) in page, "\n".join(transcript)


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
def test_correct_text_is_not_marked(editor, text):
    file = f"right-{crc32(text.encode())}.clp"  # diagnostics of an earlier text may arrive late
    editor.open(file, f"{text}\n(defrule last => (no-such-function))\n")
    editor.wait_until(lambda: bool(editor.list_codes(file)))
    assert editor.list_codes(file) == [("CX204", 2)]
    editor.open(file, "")


@pytest.mark.parametrize(
    "text",
    ["(do-for-fact ((?g goal)) ?g:mood (retract ?g))", "(do-for-fact ((?g goal)) TRUE (modify ?g (mood X)))"],
)
def test_unknown_slot_of_fact_in_variable_is_marked(editor, text):
    file = f"query-{crc32(text.encode())}.clp"  # diagnostics of an earlier text may arrive late
    editor.open(file, f"(defrule r => {text})\n")
    editor.wait_until(lambda: editor.list_codes(file) == [("CX210", 1)])
    (diagnostic,) = editor.diagnostics(file)
    assert diagnostic.severity is lsp.DiagnosticSeverity.Error
    editor.open(file, "")


def test_mistakes_in_domain_and_configuration_are_marked(editor):
    editor.open(PDDL, editor.texts[PDDL].replace("(said ?name HELLO)", "(sad ?name HELLO)", 1))
    editor.wait_until(lambda: [code for code, _ in editor.list_codes(PDDL)] == ["CX301"])
    editor.open(SCENARIO, editor.texts[SCENARIO] + "\n  a: [\n")
    editor.wait_until(lambda: "CX101" in [code for code, _ in editor.list_codes(SCENARIO)])
    editor.open(PDDL)
    editor.open(SCENARIO)
    editor.wait_until(lambda: editor.list_codes(PDDL) == [] == editor.list_codes(SCENARIO))


def test_save_starts_check_of_whole_agent(editor):
    """Only the check of the whole agent finds a mapping of an action that the domain lacks."""
    right = editor.texts[SCENARIO]
    editor.open(SCENARIO, right.replace("say-goodbye: say", "say-godbye: say"))
    editor.save(SCENARIO)
    editor.wait_until(lambda: "CX401" in [code for code, _ in editor.list_codes(SCENARIO)])
    editor.open(SCENARIO, right)
    editor.save(SCENARIO)
    editor.wait_until(lambda: editor.list_codes(SCENARIO) == [])


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
        (DOMAIN, "said) (param", ["(said ?n - name ?t - text)", "sensed, not an assumed effect"]),
        (DOMAIN, "parse-pddl-domain", ["feature `pddl-parser`", "1 argument"]),
        (SCENARIO, "say-hello: say", [":action say-hello"]),
        (SCENARIO, "name)y", ["(?name - name)"]),
        (SCENARIO, "say{text", ["skill **say**", "Say something."]),
        (SCENARIO, "wait=true", ["argument of the skill **say**", "final when the text has been said"]),
        ("skills/say.lua", "SpeechSynthInterface", ["interface **SpeechSynthInterface**", "`msgid`"]),
    ],
)
def test_hover_shows_definition(editor, name, text, words):
    shown = editor.hover(name, text)
    for word in words:
        assert word in shown


def test_hover_shows_rule_of_core(editor):
    path = "rule-of-core.clp"
    editor.open(path, "(defrule goal-without-id => )\n")
    shown = editor.hover(path, "goal-without-id")
    assert "defrule goal-without-id" in shown
    editor.open(path, ";; nothing\n")


def test_hover_over_comment_is_empty(editor):
    assert editor.hover(GOALS, "said goodbye") == ""


# ---- completion


@pytest.mark.parametrize(
    ("written", "expected", "unexpected"),
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
def test_completion_in_clips_text(editor, written, expected, unexpected):
    before = editor.texts[GOALS]
    editor.open(GOALS, before + "\n" + written)
    labels = set(editor.complete(GOALS, before[-20:] + "\n" + written))
    assert labels >= expected
    assert not labels & unexpected


@pytest.mark.parametrize(
    ("name", "old", "new", "behind", "expected"),
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
def test_completion_in_configuration_and_pddl(editor, name, old, new, behind, expected):
    right = editor.texts[name]
    assert old in right
    editor.open(name, right.replace(old, new, 1))
    assert set(editor.complete(name, behind)) >= expected


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
def test_definition_is_found(editor, name, text, expected):
    place = lsp.DefinitionParams(**editor.locate(name, text))
    places = editor.list_places(editor.run(editor.client.text_document_definition_async(place)))
    if text.startswith("say{"):
        places = [
            location for location in places if location in expected
        ]  # a shipped skill has the same name
    assert places == expected


def test_references_are_found_in_clips_pddl_and_yaml(editor):
    place = lsp.ReferenceParams(
        **editor.locate(PDDL, "say-hello"), context=lsp.ReferenceContext(include_declaration=True)
    )
    places = editor.list_places(editor.run(editor.client.text_document_references_async(place)))
    assert places == [("domain.pddl", 17), ("meet-domain.clp", 31), ("scenario.yaml", 18)]


def test_rename_changes_all_files(editor):
    place = lsp.RenameParams(**editor.locate(PDDL, "say-hello"), new_name="greet")
    edit = editor.run(editor.client.text_document_rename_async(place))
    changed = {
        uri.rsplit("/", 1)[1]: [text_edit.new_text for text_edit in edits]
        for uri, edits in edit.changes.items()
    }
    assert changed == {"domain.pddl": ["greet"], DOMAIN: ["greet"], SCENARIO: ["greet"]}
    place = lsp.RenameParams(**editor.locate(GOALS, "?*MEET-WANTED*", inside=4), new_name="WANTED")
    edit = editor.run(editor.client.text_document_rename_async(place))
    assert {text_edit.new_text for edits in edit.changes.values() for text_edit in edits} == {"?*WANTED*"}


@pytest.mark.parametrize(
    ("text", "new", "reason"),
    [
        ("goal (id TESTGOAL) (mode", "aim", "is defined outside"),
        ("meet-begin", "meet-select", "there is a rule 'meet-select' already"),
        ("meet-begin", "two words", "cannot be the name"),
    ],
)
def test_impossible_rename_is_an_error(editor, text, new, reason):
    place = lsp.RenameParams(**editor.locate(GOALS, text), new_name=new)
    with pytest.raises(JsonRpcException, match=reason):
        editor.run(editor.client.text_document_rename_async(place))


# ---- files


def test_symbols_of_document_and_workspace(editor):
    document = lsp.TextDocumentIdentifier(editor.uri(GOALS))
    symbols = editor.run(
        editor.client.text_document_document_symbol_async(lsp.DocumentSymbolParams(document))
    )
    names = [(symbol.name, symbol.kind, symbol.range.start.line + 1) for symbol in symbols]
    assert ("MEET-WANTED", lsp.SymbolKind.Variable, 3) in names
    assert ("meet-begin", lsp.SymbolKind.Event, 6) in names
    workspace_symbols = editor.run(editor.client.workspace_symbol_async(lsp.WorkspaceSymbolParams("meetbgn")))
    assert "meet-begin" in [symbol.name for symbol in workspace_symbols]


def test_formatting_restores_layout(editor):
    right = editor.texts[GOALS]
    editor.open(GOALS, right.replace("  (goal (id ?id) (class SAY", "\t(goal (id ?id) (class SAY"))
    parameters = lsp.DocumentFormattingParams(
        lsp.TextDocumentIdentifier(editor.uri(GOALS)), lsp.FormattingOptions(tab_size=2, insert_spaces=True)
    )
    (edit,) = editor.run(editor.client.text_document_formatting_async(parameters))
    assert edit.new_text == right
    assert edit.range.end.line == right.count("\n")


def test_positions_count_utf_16_units(editor):
    name = "wide.clp"
    editor.open(name, '(defrule wide (goal) => (printout t "\U0001f916 \U0001f916" (create$ 1)))\n')
    assert "create$" in editor.hover(name, "create$")
    editor.open(name, "")


def test_agents_of_fawkes_have_only_known_findings(fawkes_agent):
    """The known findings are a missing parenthesis, and two queries of a slot that the template lacks."""
    session, spec = fawkes_agent
    mistakes = {
        (mistake.code.name, Path(file.path).name, file.lines.line_at(mistake.start))
        for file in session.model.files
        if file.path in session.knowledge.loaded_files
        for mistake in find_mistakes(session, file)
    }
    known = {("CX210", "domain.clp", line) for line in (892, 941)}
    assert mistakes == known | {("CX201", "skills.clp", 189)}, spec


def test_world_file_of_scenario_is_checked(editor):
    (editor.root / "world.yaml").write_text("skills:\n  - name: sey\n")
    editor.save(SCENARIO)
    editor.wait_until(lambda: ("CX121", 2) in editor.list_codes("world.yaml"))
    (editor.root / "world.yaml").unlink()
    editor.save(SCENARIO)
    editor.wait_until(lambda: editor.list_codes("world.yaml") == [])
