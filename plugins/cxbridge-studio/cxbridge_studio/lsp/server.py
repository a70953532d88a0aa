"""The language server: reads the agent's files, follows their changes, and publishes diagnostics."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from lsprotocol import types as lsp
from pygls.capabilities import get_capability
from pygls.lsp.server import LanguageServer

from cxbridge import __version__
from cxbridge.errors import CxbridgeError
from cxbridge_studio.agent.names import SourceFile
from cxbridge_studio.lsp.examinations import Examinations
from cxbridge_studio.lsp.knowledge import AgentKnowledge
from cxbridge_studio.lsp.positions import PositionConverter, path_to_uri, uri_to_path
from cxbridge_studio.lsp.publishing import FileFindings
from cxbridge_studio.lsp.session import Session, find_agent_files, find_last_recording, find_scenario

if TYPE_CHECKING:
    from cxbridge_studio.lsp.agent_files import AgentFiles

# the agent that gives the names of the core and of functions if neither the options nor the folder name one
_FALLBACK_OPTIONS: Final = {"scenario": "test-scenario"}


def _locate_agent(options: Mapping[str, Any]) -> AgentFiles:
    """Return the locations of an agent's files."""
    # imported here: the imports are slow, and the first responses of the server must be quick
    from cxbridge_studio.lsp.agent_files import AgentFiles  # noqa: PLC0415
    from cxbridge_studio.lsp.examination_process import make_run_options  # noqa: PLC0415

    return AgentFiles.find(make_run_options(options))


def _names_agent(options: Mapping[str, Any]) -> bool:
    """Return whether the options name an agent; true for invalid options, so that the error is reported."""
    from cxbridge.run.source import source_of  # noqa: PLC0415
    from cxbridge_studio.lsp.examination_process import make_run_options  # noqa: PLC0415 - as above

    try:
        return source_of(make_run_options(options)).is_named
    except CxbridgeError:
        return True


class AgentServer(LanguageServer):
    """A language server for one agent.

    :param options: the options of a run as JSON values (``scenario``, ``fawkes_dir``, ``clips_dirs`` ...),
        and ``recording``. The client's ``initializationOptions`` override these options.
    """

    def __init__(self, options: Mapping[str, Any] | None = None) -> None:
        super().__init__("cxbridge", __version__)
        self.session = Session()
        self.findings = FileFindings(self.session)
        self.examinations = Examinations(self._begin_examination, self._apply_knowledge)
        self._client_options = {
            name: value for name, value in (options or {}).items() if value not in (None, [], ())
        }
        self._options: dict[str, Any] = {}
        self._has_agent = False
        self._unsaved_paths: set[str] = set()
        self._published_paths: set[str] = set()  # paths of files with published diagnostics
        self._index_task: asyncio.Task[None] | None = None

    @property
    def positions(self) -> PositionConverter:
        """The converter for the client's character encoding."""
        return PositionConverter(self.workspace.position_codec)

    def find_file(self, uri: str) -> SourceFile | None:
        """Return the file of the client's URI; None if the model lacks it, e.g. a file of an unknown kind."""
        return self.session.model.find_file(uri_to_path(uri))

    # ---- start and end

    def read_parameters(self, parameters: lsp.InitializeParams) -> None:
        """Read the options and the folder from the client's initialisation parameters."""
        initialization_options = parameters.initialization_options
        if isinstance(initialization_options, Mapping):
            self._client_options.update(initialization_options)
        folders = parameters.workspace_folders or []
        uri = folders[0].uri if folders else parameters.root_uri
        self.session.root = Path(uri_to_path(uri)) if uri else None

    def start(self) -> None:
        """Begin to read and examine the agent's files in the background."""
        self._index_task = asyncio.get_running_loop().create_task(self._index_without_gc())

    async def end(self, _params: None) -> None:
        if self._index_task is not None:
            self._index_task.cancel()
        await self.examinations.close()

    async def _index_without_gc(self) -> None:
        """Read all files without garbage collection, since a collection delays responses by 0.1 s.

        Afterwards the objects are frozen, so that later collections skip these objects.
        """
        gc.disable()
        try:
            await self._index()
        finally:
            gc.freeze()
            gc.enable()

    async def _index(self) -> None:
        """Choose the agent, request an examination, and read the files of the folder and of the agent."""
        root = self.session.root
        options = dict(self._client_options)
        recording = options.pop("recording", None) or (find_last_recording(root) if root else None)
        if not _names_agent(options) and root and (scenario := find_scenario(root)):
            options["scenario"] = str(scenario)
        self._has_agent = _names_agent(options)
        if not self._has_agent:
            options |= _FALLBACK_OPTIONS
        self._options = {**options, "recording": str(recording or "")}
        self.examinations.request()
        await self._read_files(find_agent_files(root) if root is not None else ())
        try:
            agent = await asyncio.to_thread(_locate_agent, options)
        except CxbridgeError as error:
            text = str(error)
            self.window_show_message(lsp.ShowMessageParams(lsp.MessageType.Error, f"cxbridge: {text}"))
            self.window_log_message(lsp.LogMessageParams(lsp.MessageType.Error, text))
        else:
            await self._read_files((*agent.library, *agent.find_clips_files()))
            self.session.library = {str(path.resolve()) for path in agent.library}
            await self._read_files(agent.find_named_files())
        self.session.is_indexed = True
        self.publish()

    async def _read_files(self, paths: Iterable[Path]) -> None:
        """Read the files that the model lacks, and let the event loop serve requests after each file."""
        for path in paths:
            resolved_path = path.resolve()
            if self.session.model.find_file(str(resolved_path)) is None:
                file = self.session.model.read(resolved_path)
                if file is not None:
                    _ = file.mentions_by_name  # builds the index now, so that the first request does not wait
                await asyncio.sleep(0)

    @property
    def _open_uris(self) -> dict[str, str]:
        """The client's URIs of the open documents, by path."""
        # not the keys of pygls' documents: they are unquoted, and therefore differ from the URIs
        return {
            uri_to_path(document.uri): document.uri for document in self.workspace.text_documents.values()
        }

    # ---- changes

    def update_document(
        self, params: lsp.DidOpenTextDocumentParams | lsp.DidChangeTextDocumentParams, *, is_saved: bool
    ) -> None:
        """Update a document with the client's text, and publish its diagnostics.

        :param is_saved: whether the file on the disk has the same text.
        """
        path = uri_to_path(params.text_document.uri)
        document = self.workspace.get_text_document(params.text_document.uri)
        file = self.session.model.find_file(path)
        if file is None or file.text != document.source:
            file = self.session.model.update(path, document.source)
            if not is_saved:
                self._unsaved_paths.add(path)
            self.findings.record_change(path)
        if file is not None:
            self._publish(file)

    def handle_save(self, params: lsp.DidSaveTextDocumentParams) -> None:
        """Examine the agent after the client has saved a file."""
        self._unsaved_paths.discard(uri_to_path(params.text_document.uri))
        if self.session.root is not None or self._has_agent:
            self.examinations.request()

    def handle_close(self, params: lsp.DidCloseTextDocumentParams) -> None:
        """Read a closed document from the disk again if its text was not saved."""
        path = uri_to_path(params.text_document.uri)
        if path in self._unsaved_paths:
            self._unsaved_paths.discard(path)
            self.session.model.read(Path(path))

    def handle_disk_changes(self, params: lsp.DidChangeWatchedFilesParams) -> None:
        """Read the files that other programs have changed, and forget the deleted files.

        Open documents are skipped, since their text belongs to the client.
        """
        for change in params.changes:
            path = uri_to_path(change.uri)
            if path in self._open_uris:
                continue
            if change.type is lsp.FileChangeType.Deleted:
                self.session.model.remove(path)
            else:
                self.session.model.read(Path(path))
            self.findings.record_change(path)
        self.publish()

    # ---- findings

    def _begin_examination(self) -> Mapping[str, Any]:
        """Record the beginning of an examination, and return its options."""
        self.findings.begin_check()
        return self._options

    def _apply_knowledge(self, knowledge: AgentKnowledge) -> None:
        """Store the result of an examination and publish its findings.

        An examination that yields neither functions nor findings does not replace an earlier result.
        """
        if knowledge.error:
            self.window_log_message(lsp.LogMessageParams(lsp.MessageType.Warning, knowledge.error))
        if not self._has_agent:  # the user has no use for findings about the fallback agent
            knowledge = AgentKnowledge(
                knowledge.functions, firings=knowledge.firings, recording=knowledge.recording
            )
        if knowledge.is_complete or knowledge.findings:
            self.session.knowledge = knowledge
            self.findings.finish_check(self._unsaved_paths)
        self.publish()
        # the code lenses show the firings in the last recording, which the examination has counted
        if get_capability(self.client_capabilities, "workspace.code_lens.refresh_support", default=False):
            self.workspace_code_lens_refresh(None)

    def publish(self) -> None:
        """Publish the diagnostics of all open files, and of files that have or had diagnostics."""
        for path in self._open_uris.keys() | self.findings.by_path.keys() | self._published_paths:
            file = self.session.model.find_file(path) or self.session.model.read(Path(path))
            if file is not None:
                self._publish(file)

    def _publish(self, file: SourceFile) -> None:
        diagnostics = self.findings.make_diagnostics(file, self.positions)
        if not diagnostics and file.path not in self._published_paths:
            return
        # an empty list of diagnostics, published once, removes the diagnostics in the editor
        (self._published_paths.add if diagnostics else self._published_paths.discard)(file.path)
        uri = self._open_uris.get(file.path) or path_to_uri(file.path)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, diagnostics))
