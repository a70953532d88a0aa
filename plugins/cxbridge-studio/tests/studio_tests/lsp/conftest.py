"""A client of the language server with a copy of a shipped scenario."""

from __future__ import annotations

import asyncio
import shutil
import time
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, TypeVar

import pytest

pytest.importorskip("pygls", reason="the extra 'lsp' (pygls) is not installed")
pytest.importorskip("pytest_lsp", reason="pytest-lsp is not installed")

import pytest_lsp
from lsprotocol import types as lsp
from pygls.io_ import run_async

from cxbridge_studio.lsp.agent_files import AgentFiles
from cxbridge_studio.lsp.examination_process import examine, make_run_options
from cxbridge_studio.lsp.session import Session
from tests.forked import nursery
from tests.support import FAWKES_DIR, ROOT

T = TypeVar("T")
PATIENCE_S = 120


class Editor:
    """Drives a client in an event loop; messages of the server arrive only during calls of the client."""

    def __init__(self, root: Path, *arguments: str, options: dict[str, Any] | None = None) -> None:
        self.root = root
        self.loop = asyncio.new_event_loop()
        self.client = pytest_lsp.client.make_test_lsp_client()
        self.versions: dict[str, int] = {}
        self.texts: dict[str, str] = {}
        self._server = nursery().begin(["lsp", *arguments], folder=root)
        self.run(self._connect())
        parameters = lsp.InitializeParams(
            capabilities=pytest_lsp.client_capabilities("visual-studio-code"),
            root_uri=root.as_uri(),
            workspace_folders=[lsp.WorkspaceFolder(root.as_uri(), "agent")],
            initialization_options=options,
        )
        self.result = self.run(self.client.initialize_session(parameters))

    @property
    def pid(self) -> int:
        """The process id of the server."""
        return self._server.process.number

    async def _connect(self) -> None:
        """Connect like ``start_io`` of the client, but with a process of the nursery."""
        reader = asyncio.StreamReader()
        stdin, stdout = self._server.stdin, self._server.stdout
        await self.loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), stdout)
        transport, protocol = await self.loop.connect_write_pipe(asyncio.streams.FlowControlMixin, stdin)
        self.client.protocol.set_writer(asyncio.StreamWriter(transport, protocol, None, self.loop))
        connection = run_async(
            stop_event=self.client._stop_event,
            reader=reader,
            protocol=self.client.protocol,
            error_handler=self.client.report_server_error,
        )
        self.client._async_tasks.append(asyncio.create_task(connection))

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        return self.loop.run_until_complete(asyncio.wait_for(work, PATIENCE_S))

    def close(self) -> None:
        self.run(self.client.shutdown_session())
        self.run(self.client.stop())
        with self._server.process as process:
            process.wait(PATIENCE_S)
        for stream in (self._server.stdin, self._server.stdout, self._server.stderr):
            stream.close()
        self.loop.close()

    def uri(self, name: str) -> str:
        return (self.root / name).as_uri()

    def open(self, name: str, text: str | None = None) -> str:
        """Open a file, or change the text of an open file."""
        text = (self.root / name).read_text("utf-8") if text is None else text
        uri = self.uri(name)
        self.texts[name] = text
        self.versions[uri] = self.versions.get(uri, 0) + 1
        if self.versions[uri] == 1:
            item = lsp.TextDocumentItem(uri, "clips", 1, text)
            self.client.text_document_did_open(lsp.DidOpenTextDocumentParams(item))
        else:
            document = lsp.VersionedTextDocumentIdentifier(uri=uri, version=self.versions[uri])
            whole = lsp.TextDocumentContentChangeWholeDocument(text)
            self.client.text_document_did_change(lsp.DidChangeTextDocumentParams(document, [whole]))
        return text

    def save(self, name: str) -> None:
        (self.root / name).write_text(self.texts[name], "utf-8")
        document = lsp.TextDocumentIdentifier(self.uri(name))
        self.client.text_document_did_save(lsp.DidSaveTextDocumentParams(document))

    def locate(self, name: str, text: str, *, inside: int = 1) -> dict[str, Any]:
        """Return document and position of a text, some characters behind its start."""
        lines_before = self.texts[name][: self.texts[name].index(text) + inside].split("\n")
        character = len(lines_before[-1].encode("utf-16-le")) // 2
        return {
            "text_document": lsp.TextDocumentIdentifier(self.uri(name)),
            "position": lsp.Position(len(lines_before) - 1, character),
        }

    def hover(self, name: str, text: str, *, inside: int = 1) -> str:
        found = self.run(
            self.client.text_document_hover_async(lsp.HoverParams(**self.locate(name, text, inside=inside)))
        )
        return found.contents.value if found else ""  # type: ignore[union-attr]  # the server sends Markdown

    def complete(self, name: str, text: str) -> list[str]:
        """Return the labels of the completions behind a text."""
        place = lsp.CompletionParams(**self.locate(name, text, inside=len(text)))
        found = self.run(self.client.text_document_completion_async(place))
        return [item.label for item in found.items]  # type: ignore[union-attr]  # the server sends a list

    def list_codes(self, name: str) -> list[tuple[str, int]]:
        """Return code and line, from 1, of each diagnostic of a file."""
        return sorted(
            (str(diagnostic.code), diagnostic.range.start.line + 1) for diagnostic in self.diagnostics(name)
        )

    def diagnostics(self, name: str) -> Sequence[lsp.Diagnostic]:
        """Return the diagnostics of a file."""
        return self.client.diagnostics.get(self.uri(name), ())

    def wait_until(self, condition: Callable[[], bool]) -> None:
        """Receive messages of the server until the condition holds."""
        deadline = time.monotonic() + PATIENCE_S

        async def poll() -> None:
            while not condition():
                assert time.monotonic() < deadline, (self.client.diagnostics, self.client.log_messages)
                await asyncio.sleep(0.02)

        self.loop.run_until_complete(poll())

    def list_places(self, locations: Any) -> list[tuple[str, int]]:
        """Return file name and line, from 1, of each location."""
        return sorted(
            {(Path(location.uri).name, location.range.start.line + 1) for location in locations or ()}
        )


@pytest.fixture(scope="module")
def editor(tmp_path_factory) -> Iterator[Editor]:
    """An editor with a copy of a shipped scenario that the server has read."""
    root = tmp_path_factory.mktemp("agent #1, 5%20 mö").resolve()  # URIs quote these characters
    shutil.copytree(ROOT / "scenarios" / "test-scenario-pddl", root, dirs_exist_ok=True)
    shutil.copytree(ROOT / "luaskills" / "basic", root / "skills")
    with closing(Editor(root)) as editor:
        # the server knows the functions after the first examination
        editor.open("probe.clp", "(defrule probe => (no-such-function))\n")
        editor.wait_until(lambda: editor.list_codes("probe.clp") == [("CX204", 1)])
        yield editor


@pytest.fixture(params=["test", "test-pddl"])
def fawkes_agent(request) -> tuple[Session, str]:
    """A session with an agent of a Fawkes checkout, and the name of the spec."""
    if FAWKES_DIR is None:
        pytest.skip("FAWKES_DIR names no Fawkes checkout")
    options = make_run_options({"fawkes_dir": str(FAWKES_DIR), "spec": request.param})
    agent, session = AgentFiles.find(options), Session(is_indexed=True)
    for path in (*agent.library, *agent.find_clips_files(), *agent.find_named_files()):
        session.model.read(path.resolve())
    session.library = {str(path.resolve()) for path in agent.library}
    session.knowledge = examine(options)
    assert len(session.knowledge.loaded_files) > 20
    return session, request.param
