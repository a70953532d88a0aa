"""The times of the language server on the RCLL agent: its start, and each kind of answer, through a client.

On a busy machine, the time of the processor says more.

FAWKES_DIR=/path/to/fawkes ROBOTINO_DIR=/path/to/fawkes-robotino python -m benchmarks.language_server
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from lsprotocol import types as lsp

from studio_tests.lsp.conftest import Editor

ROUNDS = 20
FILE = "src/clips-specs/rcll/goal-production.clp"


def milliseconds(work: Callable[[], object]) -> float:
    """Return how long some work takes."""
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) * 1000


def processor_ms(editor: Editor) -> float:
    """Return the time of the processor that the server has used; 0 where the system does not say."""
    file = Path(f"/proc/{editor.pid}/stat")
    if not file.exists():
        return 0.0
    user, system = file.read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) * 1000 / os.sysconf("SC_CLK_TCK")


def editor_of(robotino: Path, fawkes: Path, folder: Path) -> Editor:
    """Return an editor that has the agent open."""
    overlay = folder / "overlay.yaml"
    overlay.write_text(f"clips-protobuf:\n  proto-dirs: ['{robotino}/src/agents/llsf2013/msgs']\n")
    interfaces = [robotino / "src/libs/interfaces", *sorted(robotino.glob("src/plugins/*/interfaces"))]
    options = {
        "scenario": str(robotino / "cfg"),
        "fawkes_dir": str(fawkes),
        "spec": "rcll",
        "config": str(overlay),
        "clips_dirs": [str(robotino / "src/clips-specs")],
        "interface_dirs": [str(path) for path in interfaces],
    }
    return Editor(robotino, options=options)


def main() -> int:
    """Measure and print."""
    if not {"FAWKES_DIR", "ROBOTINO_DIR"} <= os.environ.keys():
        print("FAWKES_DIR and ROBOTINO_DIR must name checkouts")
        return 2
    robotino, fawkes = (Path(os.environ[name]).resolve() for name in ("ROBOTINO_DIR", "FAWKES_DIR"))
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        editor = editor_of(robotino, fawkes, Path(folder))
        used = processor_ms(editor) / 1000
        print(f"start, until the client may ask: {time.perf_counter() - begin:.2f} s, processor {used:.2f} s")
        try:
            measure(editor, begin)
        finally:
            editor.close()
    return 0


def measure(editor: Editor, begin: float) -> None:
    """Print the times of answers."""
    text = editor.open(FILE)
    print(f"first answer: {milliseconds(lambda: editor.hover(FILE, 'defrule')):.0f} ms")
    probe = "src/clips-specs/rcll/probe.clp"
    editor.open(probe, "(defrule probe => (no-such-function))\n")
    editor.wait(lambda: ("CX204", 1) in editor.shown(probe))
    print(f"all files read, CLIPS' functions known: {time.perf_counter() - begin:.1f} s after the start")
    goal = editor.at(FILE, "(goal (id", inside=2)
    document = lsp.TextDocumentIdentifier(editor.uri(FILE))
    ask = editor.client
    changes = iter(range(10**6))

    def type_something() -> None:
        """Change the last rule, and wait for what the server makes of it."""
        number = next(changes)
        head, rule, rest = text.rpartition("(defrule ")
        editor.open(FILE, head + rule + rest.replace("=>", f"(gaol (id {number}))\n  =>", 1))
        shown = editor.client.diagnostics.pop(editor.uri(FILE), None)
        editor.run(ask.text_document_folding_range_async(lsp.FoldingRangeParams(document)))
        assert number == 0 or shown is not None

    formatting = lsp.DocumentFormattingParams(document, lsp.FormattingOptions(tab_size=2, insert_spaces=True))
    context = lsp.ReferenceContext(include_declaration=True)
    questions: dict[str, Callable[[], object]] = {
        "hover": lambda: editor.hover(FILE, "(goal (id", inside=2),
        "definition": lambda: editor.run(ask.text_document_definition_async(lsp.DefinitionParams(**goal))),
        "references of goal": lambda: editor.run(
            ask.text_document_references_async(lsp.ReferenceParams(**goal, context=context))
        ),
        "completion of a slot": lambda: editor.complete(FILE, "(goal ("),
        "completion of a function": lambda: editor.complete(FILE, "=>\n  ("),
        "symbols of the file": lambda: editor.run(
            ask.text_document_document_symbol_async(lsp.DocumentSymbolParams(document))
        ),
        "symbols of all files": lambda: editor.run(
            ask.workspace_symbol_async(lsp.WorkspaceSymbolParams("goal"))
        ),
        "a change, its diagnostics and folding": type_something,
        "formatting": lambda: editor.run(ask.text_document_formatting_async(formatting)),
    }
    print(f"{'answer (ms)':40} median  slowest of {ROUNDS}, processor of the server on average")
    for name, question in questions.items():
        before = processor_ms(editor)
        times = [milliseconds(question) for _ in range(ROUNDS)]
        used = (processor_ms(editor) - before) / ROUNDS
        print(f"{name:40} {statistics.median(times):6.1f}  {max(times):6.1f}  {used:6.1f}")


if __name__ == "__main__":
    sys.exit(main())
