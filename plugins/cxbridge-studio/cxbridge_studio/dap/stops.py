"""The client's view of a stop: frames, scopes and variables, by numbers that are valid for the stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import protocol
from cxbridge_studio.dap.expressions import answer
from cxbridge_studio.dap.frames import CallFrame, frames_of
from cxbridge_studio.dap.nodes import VariableNode, fact_node, groups_of
from cxbridge_studio.dap.target import FileLine, Stopped


class StopView:
    """A stop.

    :param source_of: returns how a place's file is named to the client.
    """

    def __init__(self, stopped: Stopped, source_of: Callable[[FileLine], protocol.Source]) -> None:
        self.stopped = stopped
        self._source_of = source_of
        self._frames: list[CallFrame] | None = None
        self._lists: list[Callable[[], Sequence[VariableNode]]] = []
        self._made: dict[int, list[VariableNode]] = {}

    def forget(self) -> None:
        """Look at everything again: something has been changed."""
        self._frames = None
        self._made.clear()

    @property
    def _stack(self) -> list[CallFrame]:
        if self._frames is None:
            self._frames = frames_of(self.stopped.moment)
        return self._frames

    def frames(self, start: int, levels: int) -> dict[str, object]:
        """Return a part of the stack."""
        stack = self._stack
        shown = [
            self._frame(number, frame)
            for number, frame in enumerate(stack, start=1)
            if number > start and (not levels or number <= start + levels)
        ]
        return {"stackFrames": shown, "totalFrames": len(stack)}

    def _frame(self, number: int, frame: CallFrame) -> protocol.StackFrame:
        if frame.place is None:
            return protocol.StackFrame(number, frame.name, 0, 0, None, "subtle")
        return protocol.StackFrame(number, frame.name, frame.place.line, 1, self._source_of(frame.place))

    def check_frame(self, frame: int) -> None:
        """See that there is a frame of this number.

        :raises CxbridgeError: when there is not.
        """
        if not 0 < frame <= len(self._stack):
            raise CxbridgeError(f"there is no frame {frame} now")

    def scopes(self, frame: int) -> list[protocol.Scope]:
        """Return the scopes of a frame.

        :raises CxbridgeError: when there is no such frame.
        """
        self.check_frame(frame)
        groups = groups_of(self.stopped.moment, self._stack[frame - 1])
        return [
            protocol.Scope(group.name, self._number(group.children), group.expensive, group.hint)
            for group in groups
        ]

    def _number(self, children: Callable[[], Sequence[VariableNode]]) -> int:
        self._lists.append(children)
        return len(self._lists)

    def _nodes(self, reference: int) -> list[VariableNode]:
        if not 0 < reference <= len(self._lists):
            raise CxbridgeError(f"there are no variables {reference} now")
        if reference not in self._made:
            self._made[reference] = list(self._lists[reference - 1]())
        return self._made[reference]

    def variables(self, reference: int, start: int, count: int) -> list[protocol.Variable]:
        """Return the variables below a number.

        :raises CxbridgeError: when there is no such number.
        """
        nodes = self._nodes(reference)[start:]
        return [self._variable(node) for node in (nodes[:count] if count else nodes)]

    def _variable(self, node: VariableNode) -> protocol.Variable:
        below = 0 if node.children is None else self._number(node.children)
        # a value with parts is read-only, its parts can be changed
        hint = {} if node.change is not None else {"attributes": ["readOnly"]}
        return protocol.Variable(
            node.name,
            node.value,
            below,
            type=node.kind,
            evaluate_name=node.expression,
            presentation_hint=hint,
        )

    def change(self, reference: int, name: str, text: str) -> str:
        """Give a variable another value; returns it.

        :raises CxbridgeError: when it cannot have it.
        """
        node = next((node for node in self._nodes(reference) if node.name == name), None)
        if node is None or node.change is None:
            raise CxbridgeError(f"{name} cannot be changed: slots of facts can")
        value = node.change(text)
        self.forget()
        return value

    def evaluate(self, expression: str) -> tuple[protocol.EvaluateBody, tuple[str, ...]]:
        """Return what an expression or a pattern is, and the lines that it printed.

        :raises CxbridgeError: when it is neither, or fails.
        """
        moment = self.stopped.moment
        found = answer(moment, expression)
        self.forget()
        below = 0
        if found.facts:
            below = self._number(lambda: [fact_node(moment, fact) for fact in found.facts])
        return protocol.EvaluateBody(found.text, below), found.output


class Sources:
    """How files are named to a client: by path, or by a number for what only a recording has."""

    def __init__(self) -> None:
        self._texts: list[tuple[Path, str]] = []

    def of(self, place: FileLine) -> protocol.Source:
        """Return how a place's file is named."""
        if place.text is None:
            return protocol.Source(place.file.name, str(place.file))
        known = (place.file, place.text)
        if known not in self._texts:
            self._texts.append(known)
        return protocol.Source(place.file.name, source_reference=self._texts.index(known) + 1)

    def named(self, source: protocol.Source) -> tuple[Path, str]:
        """Return path and text of a file that a client names.

        :raises CxbridgeError: when it cannot be read.
        """
        if source.source_reference:
            if source.source_reference > len(self._texts):
                raise CxbridgeError(f"there is no source {source.source_reference}")
            return self._texts[source.source_reference - 1]
        if not source.path:
            raise CxbridgeError("the source has neither a path nor a reference")
        path = Path(source.path).resolve()
        try:
            return path, path.read_bytes().decode("utf-8", "surrogateescape")
        except OSError as error:
            raise CxbridgeError(f"cannot read it: {error.strerror}", file=path) from error
