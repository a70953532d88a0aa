"""The client's view of a stop: frames, scopes and variables, each with a number.

The numbers are valid until the run resumes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import protocol
from cxbridge_studio.dap.agent import StoppedEnvironment
from cxbridge_studio.dap.expressions import evaluate
from cxbridge_studio.dap.frames import CallFrame, make_frames
from cxbridge_studio.dap.nodes import (
    FACTS_SCOPE,
    SLOTS_SCOPE,
    VARIABLES_SCOPE,
    NodeMaker,
    VariableNode,
    make_fact_node,
    make_scopes,
)


class StopView:
    """A stop as the client sees it.

    :ivar thread_id: the number of the stopped agent, from 1.
    """

    def __init__(self, thread_id: int, stopped_env: StoppedEnvironment) -> None:
        self.thread_id = thread_id
        self._stopped_env = stopped_env
        # The functions that make the nodes behind a reference, which is an index of this list, from 1.
        # The list only grows, so references stay valid after a change.
        self._child_makers: list[NodeMaker] = []

    def list_frames(self) -> list[protocol.StackFrame]:
        """Return the stack."""
        frames = make_frames(self._stopped_env)
        return [_make_frame(number, frame) for number, frame in enumerate(frames, start=1)]

    def find_frame(self, number: int) -> CallFrame:
        """Return the frame with a number.

        :raises CxbridgeError: if there is no such frame.
        """
        frames = make_frames(self._stopped_env)
        if not 0 < number <= len(frames):
            raise CxbridgeError(f"there is no frame {number} now", hint=f"the last frame is {len(frames)}")
        return frames[number - 1]

    def list_scopes(self, number: int) -> list[protocol.Scope]:
        """Return the scopes of the frame with a number.

        :raises CxbridgeError: if there is no such frame.
        """
        scopes = make_scopes(self._stopped_env, self.find_frame(number))
        return [
            protocol.Scope(
                title,
                self._add_reference(children),
                expensive=title == FACTS_SCOPE,
                presentation_hint="locals" if title in (VARIABLES_SCOPE, SLOTS_SCOPE) else "",
            )
            for title, children in scopes.items()
        ]

    def _add_reference(self, children: NodeMaker) -> int:
        """Return a new reference to a list of nodes."""
        self._child_makers.append(children)
        return len(self._child_makers)

    def _open_nodes(self, reference: int) -> Sequence[VariableNode]:
        if not 0 < reference <= len(self._child_makers):
            raise CxbridgeError(f"the reference {reference} has no variables at this stop")
        return self._child_makers[reference - 1]()

    def list_variables(self, reference: int) -> list[protocol.Variable]:
        """Return the child variables of a reference.

        :raises CxbridgeError: if there is no such reference.
        """
        return [self._make_variable(node) for node in self._open_nodes(reference)]

    def _make_variable(self, node: VariableNode) -> protocol.Variable:
        reference = 0 if node.children is None else self._add_reference(node.children)
        # the client can change the slots of facts, but neither a whole fact nor a variable of a rule
        hint = {} if node.set_value is not None else {"attributes": ["readOnly"]}
        return protocol.Variable(
            node.name,
            node.value,
            reference,
            type=node.kind,
            evaluate_name=node.expression,
            presentation_hint=hint,
        )

    def set_value(self, reference: int, name: str, text: str) -> str:
        """Set a variable and return the new value.

        :raises CxbridgeError: if there is no such variable, it is read-only, or the value is invalid.
        """
        node = next((node for node in self._open_nodes(reference) if node.name == name), None)
        if node is None or node.set_value is None:
            raise CxbridgeError(f"{name} cannot be changed: only slots of facts can")
        return node.set_value(text)

    def evaluate(self, expression: str) -> tuple[protocol.EvaluateBody, tuple[str, ...]]:
        """Evaluate an expression or a pattern; return the result and the printed lines.

        :raises CxbridgeError: if the expression is invalid or fails.
        """
        result = evaluate(self._stopped_env, expression)
        if not result.facts:
            return protocol.EvaluateBody(result.text, 0), result.output
        reference = self._add_reference(
            lambda: [make_fact_node(self._stopped_env, fact) for fact in result.facts]
        )
        return protocol.EvaluateBody(result.text, reference), result.output


def _make_frame(number: int, frame: CallFrame) -> protocol.StackFrame:
    if frame.position is None:
        # in the protocol, a frame without a source has the line 0
        return protocol.StackFrame(number, frame.name, 0, 0, None, "subtle")
    source = protocol.Source(frame.position.file.name, str(frame.position.file))
    return protocol.StackFrame(number, frame.name, frame.position.line, 1, source)


def read_source(source: protocol.Source) -> tuple[Path, str]:
    """Return the path and the text of a file that the client names.

    :raises CxbridgeError: if the file cannot be read.
    """
    path = Path(source.path).resolve()
    try:
        return path, path.read_bytes().decode("utf-8", "surrogateescape")
    except OSError as error:
        raise CxbridgeError(f"the file cannot be read: {error.strerror}", file=path) from error
