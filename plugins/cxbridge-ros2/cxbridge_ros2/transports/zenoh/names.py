"""What nodes with rmw_zenoh_cpp call things in Zenoh: keys, tokens of liveliness, QoS, attachments.

Its design document describes them. A token announces an entity: a node, a publisher, a subscription, a server
or a client of a service.
"""

from __future__ import annotations

import struct
from typing import Final, Literal

from msgspec import Struct
from xxhash import xxh3_128_intdigest

from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.names import TypeName
from cxbridge_ros2.qos import Durability, QosProfile, Reliability

Kind = Literal["MP", "MS", "SS", "SC"]
"""A publisher of messages, a subscription, a server of a service, or a client."""

NO_HASH: Final = "TypeHashNotSupported"
"""The hash of all types in distributions without hashes: Humble."""

GID: Final = 16
"""The bytes of the number of a publisher or a client."""

_SPACE: Final = "@ros2_lv"
_NODE: Final = "NN"
_KINDS: Final[dict[str, Kind]] = {"MP": "MP", "MS": "MS", "SS": "SS", "SC": "SC"}
_PARTS: Final = 13
_ATTACHMENT: Final = struct.Struct(f"<qqB{GID}s")
_DEPTH: Final = 42
"""The depth that is left out of the text of a QoS."""

_RELIABILITY: Final[dict[str, Reliability]] = {
    "": "reliable",
    "0": "reliable",
    "1": "reliable",
    "2": "best_effort",
}
_DURABILITY: Final[dict[str, Durability]] = {
    "": "volatile",
    "0": "volatile",
    "1": "transient_local",
    "2": "volatile",
}


class TypedName(Struct, frozen=True):
    """A topic or a service, of one type: endpoints of an equal one reach each other.

    :param name: e.g. ``/robot1/odom``.
    :param kind: the type's name, as in DDS.
    :param type_hash: the type's, e.g. ``RIHS01_df66…``.
    """

    name: str
    kind: str
    type_hash: str

    def key(self, domain: int) -> str:
        """Return what messages or requests are sent to."""
        return f"{domain}/{self.name.strip('/')}/{self.kind}/{self.type_hash}"


class NodeName(Struct, frozen=True):
    """A node.

    :param domain: the number of its domain.
    :param session: the number of its Zenoh session.
    :param number: the node's in its session.
    :param name: e.g. ``talker``.
    :param namespace: ``/`` when it has none.
    :param enclave: of its security; ``/`` when it has none.
    """

    domain: int
    session: str
    number: int
    name: str
    namespace: str = "/"
    enclave: str = "/"

    @property
    def token(self) -> str:
        """Announces the node."""
        return self._token(self.number, _NODE)

    def _token(self, number: int, kind: str) -> str:
        start = f"{_SPACE}/{self.domain}/{self.session}/{self.number}/{number}/{kind}"
        return f"{start}/{_mangled(self.enclave)}/{_mangled(self.namespace)}/{self.name}"


class GraphEndpoint(Struct, frozen=True):
    """A publisher, a subscription, a server or a client.

    :param node: whose it is.
    :param number: its own in its session.
    """

    node: NodeName
    number: int
    kind: Kind
    place: TypedName
    qos: QosProfile

    @property
    def token(self) -> str:
        """Announces the endpoint."""
        start = self.node._token(self.number, self.kind)  # noqa: SLF001  of this module
        name, kind = _mangled(self.place.name), _mangled(self.place.kind)
        return f"{start}/{name}/{kind}/{self.place.type_hash}/{qos_text(self.qos)}"

    @property
    def gid(self) -> bytes:
        """Its number in attachments: peers compute the number from the token, too."""
        return xxh3_128_intdigest(self.token.encode()).to_bytes(GID, "little")


class MessageAttachment(Struct, frozen=True):
    """The attachment of a message, a request or a response.

    :param number: counts the publisher's messages, or the client's requests.
    :param time_ns: when it was sent, since 1970.
    :param gid: the publisher's or the client's.
    """

    number: int
    time_ns: int
    gid: bytes

    def __bytes__(self) -> bytes:
        return _ATTACHMENT.pack(self.number, self.time_ns, GID, self.gid)


def attachment_of(data: bytes) -> MessageAttachment | None:
    """Return an attachment; None when the bytes are none (releases before 2025 have another format)."""
    if len(data) != _ATTACHMENT.size:
        return None
    number, time_ns, size, gid = _ATTACHMENT.unpack(data)
    return MessageAttachment(number, time_ns, gid) if size == GID else None


def place_of(name: str, kind: TypeName, definitions: Definitions, *, is_service: bool = False) -> TypedName:
    """Return the place of a topic or a service.

    :raises Ros2Error: when there is no such type.
    """
    # what fields a type has is asked first: the errors say which type there is not
    definitions.fields(kind.derived("Request") if is_service else kind)
    return TypedName(name, kind.dds, definitions.type_hash(kind) if definitions.has_hashes else NO_HASH)


def tokens_of(domain: int) -> str:
    """Return the expression for all tokens of a domain."""
    return f"{_SPACE}/{domain}/**"


def endpoint_of(token: str) -> GraphEndpoint | None:
    """Return the place of a token; None for a node, and for invalid tokens, which any peer may send."""
    parts = token.split("/")
    # newer releases add a part about memory that is not the processor's
    if len(parts) < _PARTS or parts[0] != _SPACE or not all(parts) or parts[5] not in _KINDS:
        return None
    domain, session, node, number, kind, enclave, namespace, name = parts[1:9]
    qos = qos_of(parts[12])
    if qos is None or not all(_is_number(each) for each in (domain, node, number)):
        return None
    place = TypedName(_plain(parts[9]), _plain(parts[10]), parts[11])
    whose = NodeName(int(domain), session, int(node), name, _plain(namespace), _plain(enclave))
    return GraphEndpoint(whose, int(number), _KINDS[kind], place, qos)


def qos_text(qos: QosProfile) -> str:
    """Return a QoS as tokens write it: the values that differ from rmw_zenoh_cpp's defaults."""
    reliability = "2" if qos.reliability == "best_effort" else ""
    durability = "1" if qos.durability == "transient_local" else ""
    depth = "" if qos.depth == _DEPTH else qos.depth
    return f"{reliability}:{durability}:,{depth}:,:,:,,"


def qos_of(text: str) -> QosProfile | None:
    """Return a QoS; None when the text is none. Times and the kind of history are not kept."""
    parts = [each.split(",") for each in text.split(":")]
    if [len(each) for each in parts] != [1, 1, 2, 2, 2, 3]:
        return None
    (reliability,), (durability,), (_, depth) = parts[:3]
    if reliability not in _RELIABILITY or durability not in _DURABILITY:
        return None
    if not all(not each or _is_number(each) for part in parts for each in part):
        return None
    return QosProfile(
        _RELIABILITY[reliability],
        _DURABILITY[durability],
        int(depth) if depth else _DEPTH,
    )


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= 20  # noqa: PLR2004  digits of 64 bits


def _mangled(name: str) -> str:
    return name.replace("/", "%")


def _plain(name: str) -> str:
    return name.replace("%", "/")
