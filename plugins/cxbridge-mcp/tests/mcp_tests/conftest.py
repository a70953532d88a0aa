"""A server on stdio, and a client for tests without coroutines."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from anyio.from_thread import BlockingPortal, start_blocking_portal
from mcp import Client, StdioServerParameters, stdio_client
from mcp.types import TextContent, Tool

import cxbridge as cx
from tests.run.mini import AGENT, write_scenario


class Assistant:
    """A client of `cxbridge mcp` with synchronous calls."""

    def __init__(self, portal: BlockingPortal, client: Client) -> None:
        self._portal = portal
        self._client = client

    def tools(self) -> dict[str, Tool]:
        return {tool.name: tool for tool in self._portal.call(self._client.list_tools).tools}

    def call_tool(self, tool: str, **arguments: Any) -> Any:
        """Return the result of a tool."""
        result = self._portal.call(self._client.call_tool, tool, arguments)
        assert not result.is_error, result.content
        structured = result.structured_content
        if structured is None:
            (content,) = result.content
            assert isinstance(content, TextContent)
            return content.text
        return structured["result"] if structured.keys() == {"result"} else structured

    def get_tool_error(self, tool: str, **arguments: Any) -> str:
        """Return the error of a tool."""
        result = self._portal.call(self._client.call_tool, tool, arguments)
        assert result.is_error, result.content
        (content,) = result.content
        assert isinstance(content, TextContent)
        return content.text


@contextmanager
def start_assistant(*arguments: object) -> Iterator[Assistant]:
    """Start a server and its client."""
    command = ["-m", "cxbridge", "mcp", *map(str, arguments)]
    server = stdio_client(StdioServerParameters(command=sys.executable, args=command))
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(Client(server)) as client:
        yield Assistant(portal, client)


@pytest.fixture(scope="session")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two recordings, a text file, a correct agent and a broken agent."""
    folder = tmp_path_factory.mktemp("home")
    cx.run("test-scenario", trace=folder / "a.mcap", trace_level="facts", timeout=60.0)
    agent = write_scenario(folder / "mini", agent=f"{AGENT}(defrule silent (goal (class OTHER)) =>)")
    cx.run(agent, trace=folder / "mini.mcap", trace_level="facts", timeout=60.0)
    (folder / "notes.txt").write_text("no recording")
    (folder / "link.mcap").symlink_to("a.mcap")  # links are not listed
    (folder / "broken").mkdir()
    (folder / "broken" / "scenario.yaml").write_text(
        "clips-executive:\n  spec: b\n  specs:\n    b:\n      init:\n        stage-3:\n"
        "          - name: agent\n            files: [nowhere.clp]\n"
    )
    return folder


@pytest.fixture(scope="session")
def assistant(home: Path) -> Iterator[Assistant]:
    """An assistant without rights and without a daemon."""
    with start_assistant(home, "--connect", f"ipc://{home}/none") as assistant:
        yield assistant
