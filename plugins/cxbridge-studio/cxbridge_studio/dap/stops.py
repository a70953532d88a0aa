"""The client's view of a stop: frames, scopes and variables, by numbers that are valid until it resumes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import protocol
from cxbridge_studio.dap.expressions import evaluate
from cxbridge_studio.dap.frames import CallFrame, frames_of
from cxbridge_studio.dap.nodes import VariableNode, fact_node, groups_of
from cxbridge_studio.dap.target import FileLine, Stopped


class StopView:
    """A stop as the client sees it.

    :param stopped: the stop of the target.
    :param source_of: returns the client's name for the file of a position.
    """

    def __init__(self, stopped: Stopped, source_of: Callable[[FileLine], protocol.Source]) -> None:
        self.stopped = stopped
        self._source_of = source_of
        self._frames: list[CallFrame] | None = None
        # References are indices into this list, from 1: they stay valid after a change.
        self._lists: list[Callable[[], Sequence[VariableNode]]] = []
        self._nodes_by_reference: dict[int, list[VariableNode]] = {}

    def forget(self) -> None:
        """Discard the cached frames and variables after a change."""
        self._frames = None
        self._nodes_by_reference.clear()

    @property
    def _stack(self) -> list[CallFrame]:
        if self._frames is None:
            self._frames = frames_of(self.stopped.moment)
        return self._frames

    def frames(self, start: int, levels: int) -> dict[str, object]:
        """Return a part of the stack."""
        frames = [self._frame(number, frame) for number, frame in enumerate(self._stack, start=1)]
        end = start + levels if levels else None
        return {"stackFrames": frames[start:end], "totalFrames": len(frames)}

    def _frame(self, number: int, frame: CallFrame) -> protocol.StackFrame:
        if frame.place is None:
            # The protocol's line of a frame without a source is 0.
            return protocol.StackFrame(number, frame.name, 0, 0, None, "subtle")
        return protocol.StackFrame(number, frame.name, frame.place.line, 1, self._source_of(frame.place))

    def check_frame(self, frame: int) -> None:
        """Check a frame number.

        :raises CxbridgeError: if there is no such frame.
        """
        if not 0 < frame <= len(self._stack):
            raise CxbridgeError(f"there is no frame {frame} now")

    def scopes(self, frame: int) -> list[protocol.Scope]:
        """Return the scopes of a frame.

        :raises CxbridgeError: if there is no such frame.
        """
        self.check_frame(frame)
        groups = groups_of(self.stopped.moment, self._stack[frame - 1])
        return [
            protocol.Scope(group.name, self._new_reference(group.children), group.expensive, group.hint)
            for group in groups
        ]

    def _new_reference(self, children: Callable[[], Sequence[VariableNode]]) -> int:
        """Return a new reference to a list of nodes."""
        self._lists.append(children)
        return len(self._lists)

    def _nodes(self, reference: int) -> list[VariableNode]:
        if not 0 < reference <= len(self._lists):
            raise CxbridgeError(f"there are no variables {reference} now")
        if reference not in self._nodes_by_reference:
            self._nodes_by_reference[reference] = list(self._lists[reference - 1]())
        return self._nodes_by_reference[reference]

    def variables(self, reference: int, start: int, count: int) -> list[protocol.Variable]:
        """Return the child variables of a reference.

        :raises CxbridgeError: if there is no such reference.
        """
        nodes = self._nodes(reference)[start:]
        return [self._variable(node) for node in (nodes[:count] if count else nodes)]

    def _variable(self, node: VariableNode) -> protocol.Variable:
        reference = 0 if node.children is None else self._new_reference(node.children)
        # A compound value is read-only; its parts can be changed.
        hint = {} if node.change is not None else {"attributes": ["readOnly"]}
        return protocol.Variable(
            node.name,
            node.value,
            reference,
            type=node.kind,
            evaluate_name=node.expression,
            presentation_hint=hint,
        )

    def change(self, reference: int, name: str, text: str) -> str:
        """Set a variable and return the new value.

        :raises CxbridgeError: if the variable is read-only or the value invalid.
        """
        node = next((node for node in self._nodes(reference) if node.name == name), None)
        if node is None or node.change is None:
            raise CxbridgeError(f"{name} cannot be changed: slots of facts can")
        value = node.change(text)
        self.forget()
        return value

    def evaluate(self, expression: str) -> tuple[protocol.EvaluateBody, tuple[str, ...]]:
        """Evaluate an expression or a pattern; return the result and the printed lines."""
        moment = self.stopped.moment
        result = evaluate(moment, expression)
        self.forget()
        reference = 0
        if result.facts:
            reference = self._new_reference(lambda: [fact_node(moment, fact) for fact in result.facts])
        return protocol.EvaluateBody(result.text, reference), result.output


class Sources:
    """The names of files for the client: a path, or a number for text that only a recording has."""

    def __init__(self) -> None:
        self._texts: list[tuple[Path, str]] = []

    def of(self, place: FileLine) -> protocol.Source:
        """Return the client's name for the file of a position."""
        if place.text is None:
            return protocol.Source(place.file.name, str(place.file))
        source = (place.file, place.text)
        if source not in self._texts:
            self._texts.append(source)
        return protocol.Source(place.file.name, source_reference=self._texts.index(source) + 1)

    def named(self, source: protocol.Source) -> tuple[Path, str]:
        """Return the path and the text of a file that the client names.

        :raises CxbridgeError: if the reference is unknown, or the file cannot be read.
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
