"""Opens interfaces at a Fawkes: finds the hash that it takes, and says why it refuses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge.blackboard.errors import (
    BlackBoardError,
    UnknownTypeError,
    VersionMismatchError,
    WriterActiveError,
)
from cxbridge.blackboard.fawkesnet.bb_messages import Close, Open, OpenError, OpenFailure, OpenSuccess
from cxbridge.blackboard.fawkesnet.errors import RemoteRefusalError
from cxbridge.blackboard.fawkesnet.hashes import RemoteHashes
from cxbridge.blackboard.fawkesnet.requests import Answer, Requests
from cxbridge.interfaces.instance import Interface


class Opener:
    """Asks one remote to open interfaces.

    :param requests: the way to the remote.
    :param remote: its host and port, for people.
    """

    def __init__(self, requests: Requests, remote: str) -> None:
        self._requests: Final = requests
        self._remote: Final = remote
        self._hashes: Final = RemoteHashes()

    def open(
        self,
        interface_class: type[Interface],
        interface_id: str,
        opened: Callable[[Answer], None],
        *,
        writer: bool,
    ) -> OpenSuccess:
        """Offer hashes until the remote takes one.

        :param opened: called with each answer in the receiving thread.
        :raises BlackBoardError: when it refuses.
        """
        schema = interface_class.SCHEMA
        candidates, listed, tried = self._hashes.candidates(schema), None, list[bytes]()
        while True:
            offer = candidates[0]
            answer = self._requests.ask(Open(schema.name, interface_id, offer, writer), opened)
            if isinstance(answer, OpenSuccess):
                self._check_size(interface_class, answer)
                self._hashes.adopt(schema, offer)
                return answer
            assert isinstance(answer, OpenFailure)
            if answer.error != OpenError.HASH_MISMATCH:
                raise self._refusal(answer.error, schema.name, interface_id)
            tried.append(offer)
            if listed is None:
                listed = [info.hash for info in self._requests.list(schema.name, "*").interfaces]
                candidates = self._hashes.candidates(schema, listed)
            candidates = [one for one in candidates if one not in tried]
            if not candidates:
                uid = f"{schema.name}::{interface_id}"
                raise VersionMismatchError(uid, next(iter(listed), b""), tried[0])

    def _check_size(self, interface_class: type[Interface], answer: OpenSuccess) -> None:
        size = interface_class.SCHEMA.datasize
        if len(answer.block) != size:
            self._requests.send(Close(answer.serial).to_bytes())
            raise RemoteRefusalError(
                f"{interface_class.SCHEMA.name} has {len(answer.block)} bytes at the other end, here {size}",
                hint="both sides must use the same definition of the interface",
            )

    def _refusal(self, error: int, interface_type: str, interface_id: str) -> BlackBoardError:
        remote = f"the Fawkes at {self._remote}"
        if error == OpenError.UNKNOWN_TYPE:
            return UnknownTypeError(interface_type, hint=f"{remote} does not know it")
        if error == OpenError.WRITER_EXISTS:
            return WriterActiveError(interface_type, interface_id, "")
        return RemoteRefusalError(
            f"{remote} cannot open {interface_type}::{interface_id}", hint="its log may say why"
        )
