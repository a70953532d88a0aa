"""A minimal client of the debug adapter protocol."""

from __future__ import annotations

import json
import queue
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from tests.forked import nursery

PATIENCE_S = 60.0


class Client:
    """A debug adapter in a child process, with its messages; a context manager."""

    def __init__(self, cwd: Path, *, wait_s: float = PATIENCE_S) -> None:
        self._process, self._stdin, self._stdout, self._stderr = nursery().begin(["dap"], folder=cwd)
        self._wait_s = wait_s
        self._seq = 0
        self._inbox: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.events: list[dict[str, Any]] = []
        self.log: list[dict[str, Any]] = []
        threading.Thread(target=self._read, daemon=True).start()
        self._errors = threading.Thread(target=self._read_errors, daemon=True)
        self._errors.start()
        self.stderr = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._process:
            self._process.kill()
            self._process.wait(PATIENCE_S)
        self._errors.join()
        for stream in (self._stdin, self._stdout, self._stderr):
            with suppress(BrokenPipeError):  # unread input
                stream.close()

    def _read_errors(self) -> None:
        self.stderr = self._stderr.read().decode()

    def _read(self) -> None:
        while header := self._stdout.readline():
            name, length = header.split()
            assert (name, self._stdout.readline()) == (b"Content-Length:", b"\r\n")
            self._inbox.put(json.loads(self._stdout.read(int(length))))
        self._inbox.put(None)

    def _next(self) -> dict[str, Any]:
        message = self._inbox.get(timeout=self._wait_s)
        assert message is not None, f"the adapter has ended: {self.stderr}"
        self.log.append(message)
        return message

    def send_bytes(self, data: bytes) -> None:
        """Send bytes without a header."""
        self._stdin.write(data)
        self._stdin.flush()

    def end(self) -> int:
        """Close the input of the adapter; return the exit status."""
        self._stdin.close()
        return self._process.wait(self._wait_s)

    def wait(self) -> int:
        """Wait for the end of the adapter; return the exit status."""
        return self._process.wait(self._wait_s)

    def send(self, command: str, **arguments: Any) -> int:
        """Send a request; return its number."""
        return self._send(command, arguments)

    def _send(self, command: str, arguments: Any) -> int:
        self._seq += 1
        message = {"seq": self._seq, "type": "request", "command": command, "arguments": arguments}
        self.log.append(message)
        body = json.dumps(message).encode()
        self.send_bytes(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        return self._seq

    def get_response(self, command: str, **arguments: Any) -> dict[str, Any]:
        """Send a request; return the response."""
        return self._get_response_to(self.send(command, **arguments))

    def get_responses(self, requests: Iterable[tuple[str, Any]]) -> list[dict[str, Any]]:
        """Send all requests, then return their responses."""
        return [self._get_response_to(number) for number in [self._send(*request) for request in requests]]

    def _get_response_to(self, number: int) -> dict[str, Any]:
        while (message := self._next())["type"] != "response":
            self.events.append(message)
        assert message["request_seq"] == number
        return message

    def request(self, command: str, **arguments: Any) -> Any:
        """Send a request that must succeed; return the body of its response."""
        response = self.get_response(command, **arguments)
        assert response["success"], response
        return response.get("body")

    def wait_for_event(
        self, name: str, condition: Callable[[dict[str, Any]], bool] = lambda _body: True
    ) -> dict[str, Any]:
        """Return the body of the next event with a name and a condition; drop earlier events."""
        while not condition(body := self.wait_for_events(name).get("body") or {}):
            pass
        return body

    def wait_for_events(self, *names: str) -> dict[str, Any]:
        """Return the next event with one of the names; drop earlier events."""
        while (event := self.events.pop(0) if self.events else self._next())["event"] not in names:
            pass
        return event

    # -- sequences of requests

    def launch(self, **arguments: Any) -> Any:
        """Begin a session, up to the event ``initialized``; return the capabilities."""
        capabilities = self.request(
            "initialize", adapterID="cxbridge", linesStartAt1=True, columnsStartAt1=True
        )
        self.request("launch", **arguments)
        self.wait_for_event("initialized")
        return capabilities

    def set_line_breakpoints(self, file: Path, *lines: int, **options: Any) -> Any:
        """Set breakpoints in a file."""
        breakpoints = [{"line": line, **options} for line in lines]
        return self.request("setBreakpoints", source={"path": str(file)}, breakpoints=breakpoints)[
            "breakpoints"
        ]

    def set_named_breakpoints(self, *names: str, **options: Any) -> Any:
        """Set breakpoints by name."""
        breakpoints = [{"name": name, **options} for name in names]
        return self.request("setFunctionBreakpoints", breakpoints=breakpoints)["breakpoints"]

    def start_run(self) -> None:
        """Start the run."""
        self.request("configurationDone")

    def wait_for_stop(self) -> dict[str, Any]:
        """Wait for the stop of the run."""
        return self.wait_for_event("stopped")

    def launch_to_line(self, file: Path, line: int) -> dict[str, Any]:
        """Launch the test scenario, and run to a line."""
        self.launch(scenario="test-scenario")
        self.set_line_breakpoints(file, line)
        self.start_run()
        return self.wait_for_stop()

    def resume(self, command: str = "continue") -> dict[str, Any]:
        """Continue or step, and wait for the next stop."""
        self.request(command, threadId=1)
        return self.wait_for_stop()

    def get_stack(self) -> Any:
        """Return the stack frames."""
        return self.request("stackTrace", threadId=1)["stackFrames"]

    def get_scope(self, name: str, frame: int = 1) -> Any:
        """Return the reference of the variables of a scope."""
        scopes = self.request("scopes", frameId=frame)["scopes"]
        return next(scope["variablesReference"] for scope in scopes if scope["name"] == name)

    def get_variables(self, reference: int) -> dict[str, dict[str, Any]]:
        """Return the variables of a reference by their names."""
        variables = self.request("variables", variablesReference=reference)["variables"]
        return {item["name"]: item for item in variables}

    def evaluate(self, expression: str, context: str = "repl") -> Any:
        """Return the value of an expression, or the error message."""
        response = self.get_response("evaluate", expression=expression, frameId=1, context=context)
        return response["body"]["result"] if response["success"] else response["message"]
