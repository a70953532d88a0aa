"""A minimal client of the debug adapter protocol: requests in order, events in the order of arrival."""

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
    """A debug adapter in a child process, and its messages. A context manager."""

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
        """Send anything."""
        self._stdin.write(data)
        self._stdin.flush()

    def end(self) -> int:
        """Send nothing any more; returns the exit status."""
        self._stdin.close()
        return self._process.wait(self._wait_s)

    def wait(self) -> int:
        """Wait for its end; returns the exit status."""
        return self._process.wait(self._wait_s)

    def send(self, command: str, **arguments: Any) -> int:
        """Send a request; returns its number."""
        return self._send(command, arguments)

    def _send(self, command: str, arguments: Any) -> int:
        self._seq += 1
        message = {"seq": self._seq, "type": "request", "command": command, "arguments": arguments}
        self.log.append(message)
        body = json.dumps(message).encode()
        self.send_bytes(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        return self._seq

    def answer(self, command: str, **arguments: Any) -> dict[str, Any]:
        """Send a request; returns the whole answer."""
        return self._answer_to(self.send(command, **arguments))

    def answers(self, requests: Iterable[tuple[str, Any]]) -> list[dict[str, Any]]:
        """Send requests with any arguments, all at once; returns the answers."""
        return [self._answer_to(number) for number in [self._send(*each) for each in requests]]

    def _answer_to(self, number: int) -> dict[str, Any]:
        while (message := self._next())["type"] != "response":
            self.events.append(message)
        assert message["request_seq"] == number
        return message

    def ask(self, command: str, **arguments: Any) -> Any:
        """Send a request; returns the body of its answer."""
        answer = self.answer(command, **arguments)
        assert answer["success"], answer
        return answer.get("body")

    def event(self, name: str, fits: Callable[[dict[str, Any]], bool] = lambda _body: True) -> dict[str, Any]:
        """Return the body of the next event of that name; further events are dropped."""
        while not fits(body := self.event_of(name).get("body") or {}):
            pass
        return body

    def event_of(self, *names: str) -> dict[str, Any]:
        """Return the next event of these names; further events are dropped."""
        while (found := self.events.pop(0) if self.events else self._next())["event"] not in names:
            pass
        return found

    # -- what most tests do

    def launch(self, **arguments: Any) -> Any:
        """Begin a session, up to the event ``initialized``; returns the capabilities."""
        known = self.ask("initialize", adapterID="cxbridge", linesStartAt1=True, columnsStartAt1=True)
        self.ask("launch", **arguments)
        self.event("initialized")
        return known

    def break_at(self, file: Path, *lines: int, **more: Any) -> Any:
        """Set breakpoints in a file."""
        wanted = [{"line": line, **more} for line in lines]
        return self.ask("setBreakpoints", source={"path": str(file)}, breakpoints=wanted)["breakpoints"]

    def break_on(self, *names: str, **more: Any) -> Any:
        """Set breakpoints by name."""
        wanted = [{"name": name, **more} for name in names]
        return self.ask("setFunctionBreakpoints", breakpoints=wanted)["breakpoints"]

    def begin(self) -> None:
        """Let it run."""
        self.ask("configurationDone")

    def stopped(self) -> dict[str, Any]:
        """Wait until it stops."""
        return self.event("stopped")

    def stop_at(self, file: Path, line: int) -> dict[str, Any]:
        """Launch the test scenario, and run it to a line."""
        self.launch(scenario="test-scenario")
        self.break_at(file, line)
        self.begin()
        return self.stopped()

    def go(self, command: str = "continue") -> dict[str, Any]:
        """Continue, and wait for the stop."""
        self.ask(command, threadId=1)
        return self.stopped()

    def stack(self) -> Any:
        """Return the stack."""
        return self.ask("stackTrace", threadId=1)["stackFrames"]

    def scope(self, name: str, frame: int = 1) -> Any:
        """Return the number of a scope's variables."""
        scopes = self.ask("scopes", frameId=frame)["scopes"]
        return next(scope["variablesReference"] for scope in scopes if scope["name"] == name)

    def below(self, reference: int) -> dict[str, dict[str, Any]]:
        """Return variables by their names."""
        found = self.ask("variables", variablesReference=reference)["variables"]
        return {item["name"]: item for item in found}

    def evaluate(self, expression: str, context: str = "repl") -> Any:
        """Evaluate an expression, or return its mistake."""
        answer = self.answer("evaluate", expression=expression, frameId=1, context=context)
        return answer["body"]["result"] if answer["success"] else answer["message"]
