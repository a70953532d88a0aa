"""The language server: initial reading of files, changes, and published diagnostics."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer

from cxbridge import __version__
from cxbridge.errors import CxbridgeError
from cxbridge_studio.agent.names import SourceFile
from cxbridge_studio.lsp.examination import Examinations
from cxbridge_studio.lsp.knowledge import AgentKnowledge
from cxbridge_studio.lsp.positions import Positions, path_of, uri_of
from cxbridge_studio.lsp.publishing import FindingsOfFiles
from cxbridge_studio.lsp.session import Session, files_below, find_scenario, last_recording

if TYPE_CHECKING:
    from cxbridge_studio.lsp.agent_files import AgentFiles

# The agent that provides core and functions when no scenario is found.
_FALLBACK: Final = {"scenario": "test-scenario"}


def _find_agent(options: Mapping[str, Any]) -> AgentFiles:
    """Return the locations of an agent's files."""
    # Imported here, since it imports much and the first responses must be quick.
    from cxbridge_studio.lsp.agent_files import AgentFiles  # noqa: PLC0415
    from cxbridge_studio.lsp.examine import run_options  # noqa: PLC0415

    return AgentFiles.find(run_options(options))


def _names_agent(options: Mapping[str, Any]) -> bool:
    """Return whether the options name an agent. Invalid options do, so that their error is reported."""
    from cxbridge.run.source import source_of  # noqa: PLC0415
    from cxbridge_studio.lsp.examine import run_options  # noqa: PLC0415 - as above

    try:
        return source_of(run_options(options)).is_named
    except CxbridgeError:
        return True


class AgentServer(LanguageServer):
    """A language server for one agent.

    :param options: options of a run as JSON values (``scenario``, ``fawkes_dir``, ``clips_dirs`` ...) and
        ``recording``. The client's ``initializationOptions`` override them.
    """

    def __init__(self, options: Mapping[str, Any] | None = None) -> None:
        super().__init__("cxbridge", __version__)
        self.session = Session()
        self.findings = FindingsOfFiles(self.session)
        self.examinations = Examinations(self._examined_options, self._take)
        self._given = {name: value for name, value in (options or {}).items() if value not in (None, [], ())}
        self._options: dict[str, Any] = {}
        self._has_agent = False
        self._unsaved: set[str] = set()
        self._shown_errors: set[str] = set()
        self._shown: set[str] = set()
        self._index_task: asyncio.Task[None] | None = None

    @property
    def positions(self) -> Positions:
        """The converter for the client's character encoding."""
        return Positions(self.workspace.position_codec)

    def file(self, uri: str) -> SourceFile | None:
        """Return a file that the client names, or None for other kinds of files."""
        return self.session.model.file(path_of(uri))

    # ---- start and end

    def begin(self, parameters: lsp.InitializeParams) -> None:
        """Take the client's initialisation parameters."""
        initialization_options = parameters.initialization_options
        if isinstance(initialization_options, Mapping):
            self._given.update(initialization_options)
        folders = parameters.workspace_folders or []
        uri = folders[0].uri if folders else parameters.root_uri
        self.session.root = Path(path_of(uri)) if uri else None

    def start(self) -> None:
        """Read and examine the agent's files in the background."""
        self._index_task = asyncio.get_running_loop().create_task(self._read_all())

    async def end(self) -> None:
        if self._index_task is not None:
            self._index_task.cancel()
        await self.examinations.close()

    async def _read_all(self) -> None:
        """Read all files with the garbage collector off: each collection would delay responses by 0.1 s.

        Afterwards the objects are frozen, so that later collections skip them.
        """
        gc.disable()
        try:
            await self._index()
        finally:
            gc.freeze()
            gc.enable()

    async def _index(self) -> None:
        root = self.session.root
        options = dict(self._given)
        recording = options.pop("recording", None) or (last_recording(root) if root else None)
        if not _names_agent(options) and root and (scenario := find_scenario(root)):
            options["scenario"] = str(scenario)
        self._has_agent = _names_agent(options)
        self._options = options if self._has_agent else {**options, **_FALLBACK}
        if recording:
            self._options["recording"] = str(recording)
        self.examinations.request()
        await self._read(files_below(root) if root is not None else ())
        plain = {name: value for name, value in self._options.items() if name != "recording"}
        try:
            agent = await asyncio.to_thread(_find_agent, plain)
        except CxbridgeError as error:
            self._complain(str(error))
        else:
            await self._read((*agent.library, *agent.clips()))
            self.session.library = {str(path.resolve()) for path in agent.library}
            await self._read(agent.named_files())
        self.session.is_indexed = True
        self.publish()

    async def _read(self, paths: Iterable[Path]) -> None:
        """Read new files, and let the event loop serve requests in between."""
        for path in paths:
            resolved = path.resolve()
            if self.session.model.file(str(resolved)) is None:
                file = self.session.read(resolved)
                if file is not None:
                    _ = file.by_name  # built here, so that the first request does not wait for it
                await asyncio.sleep(0)

    def _complain(self, text: str) -> None:
        """Show an error of the settings once."""
        if text not in self._shown_errors:
            self._shown_errors.add(text)
            self.window_show_message(lsp.ShowMessageParams(lsp.MessageType.Error, f"cxbridge: {text}"))
            self.window_log_message(lsp.LogMessageParams(lsp.MessageType.Error, text))

    def _log_warning(self, text: str) -> None:
        self.window_log_message(lsp.LogMessageParams(lsp.MessageType.Warning, text))

    @property
    def _opened(self) -> dict[str, str]:
        """The open documents: the client's URI by path."""
        # the keys of pygls are unquoted, so they are not URIs
        return {path_of(document.uri): document.uri for document in self.workspace.text_documents.values()}

    # ---- changes

    def change(self, uri: str, *, saved: bool) -> None:
        """Take the client's text of a document."""
        path = path_of(uri)
        document = self.workspace.get_text_document(uri)
        file = self.session.model.file(path)
        if file is None or file.text != document.source:
            file = self.session.update(path, document.source)
            if not saved:
                self._unsaved.add(path)
            self.findings.change(path)
        if file is not None:
            self._publish(file)

    def save(self, uri: str) -> None:
        """Examine the agent after a file was saved."""
        self._unsaved.discard(path_of(uri))
        if self.session.root is not None or self._has_agent:
            self.examinations.request()

    def close(self, uri: str) -> None:
        """Read the file from the disk again."""
        path = path_of(uri)
        if path in self._unsaved:
            self._unsaved.discard(path)
            self.session.read(Path(path))

    def changed_on_disk(self, changes: Iterable[lsp.FileEvent]) -> None:
        """Read files that other programs have changed; open documents belong to the client."""
        for change in changes:
            path = path_of(change.uri)
            if path in self._opened:
                continue
            if change.type is lsp.FileChangeType.Deleted:
                self.session.forget(path)
            else:
                self.session.read(Path(path))
            self.findings.change(path)
        self.publish()

    # ---- findings

    def _examined_options(self) -> Mapping[str, Any]:
        self.findings.begin()
        return self._options

    def _take(self, knowledge: AgentKnowledge) -> None:
        if knowledge.error:
            self._log_warning(knowledge.error)
        if not self._has_agent:  # of the fallback agent, only the functions are useful
            knowledge = AgentKnowledge(
                knowledge.functions, firings=knowledge.firings, recording=knowledge.recording
            )
        if knowledge.is_complete or knowledge.findings:
            self.session.know(knowledge)
            self.findings.finish(self._unsaved)
        self.publish()
        capabilities = self.client_capabilities.workspace
        if capabilities and capabilities.code_lens and capabilities.code_lens.refresh_support:
            self.workspace_code_lens_refresh(None)

    def publish(self) -> None:
        """Publish the findings of all open files and of files with findings."""
        for path in self._opened.keys() | self.findings.paths | self._shown:
            file = self.session.model.file(path) or self.session.read(Path(path))
            if file is not None:
                self._publish(file)

    def _publish(self, file: SourceFile) -> None:
        diagnostics = self.findings.diagnostics(file, self.positions)
        if not diagnostics and file.path not in self._shown:
            return
        (self._shown.add if diagnostics else self._shown.discard)(file.path)
        uri = self._opened.get(file.path) or uri_of(file.path)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, diagnostics))
