"""Names of rmw_zenoh_cpp in Zenoh: keys, liveliness tokens, QoS, attachments.

They are specified in its design document. A token announces an entity: a node, a publisher, a subscription, a
server or a client of a service.
"""

from __future__ import annotations

import struct
from typing import Final, Literal

from msgspec import Struct
from xxhash import xxh3_128_intdigest

from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.names import TypeName
from cxbridge_ros2.qos import Durability, QosProfile, Reliability

# A publisher of messages, a subscription, a server of a service, or a client.
Kind = Literal["MP", "MS", "SS", "SC"]

# Placeholder for the hash in distributions without hashes, such as Humble.
NO_HASH: Final = "TypeHashNotSupported"

GID: Final = 16  # length of the number of a publisher or a client, in bytes

_SPACE: Final = "@ros2_lv"
_NODE: Final = "NN"
_KINDS: Final[dict[str, Kind]] = {"MP": "MP", "MS": "MS", "SS": "SS", "SC": "SC"}
_PARTS: Final = 13  # number of parts in a liveliness token of rmw_zenoh
_ATTACHMENT: Final = struct.Struct(f"<qqB{GID}s")
_DEPTH: Final = 42  # default depth, which is omitted from the text of a QoS

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
    """A topic or a service of one type. Endpoints with equal values reach each other.

    :param name: such as ``/robot1/odom``.
    :param kind: the name of the type in DDS.
    :param type_hash: such as ``RIHS01_df66…``.
    """

    name: str
    kind: str
    type_hash: str

    def key(self, domain: int) -> str:
        """Return the key for messages or requests."""
        return f"{domain}/{self.name.strip('/')}/{self.kind}/{self.type_hash}"


class NodeName(Struct, frozen=True):
    """A node.

    :param session: the id of its Zenoh session.
    :param number: its number in the session.
    :param namespace: ``/`` for none.
    :param enclave: its security enclave; ``/`` for none.
    """

    domain: int
    session: str
    number: int
    name: str
    namespace: str = "/"
    enclave: str = "/"

    @property
    def token(self) -> str:
        return self._token(self.number, _NODE)

    def _token(self, number: int, kind: str) -> str:
        start = f"{_SPACE}/{self.domain}/{self.session}/{self.number}/{number}/{kind}"
        return f"{start}/{_mangled(self.enclave)}/{_mangled(self.namespace)}/{self.name}"


class GraphEndpoint(Struct, frozen=True):
    """A publisher, a subscription, a server or a client.

    :param number: its number in the session.
    """

    node: NodeName
    number: int
    kind: Kind
    place: TypedName
    qos: QosProfile

    @property
    def token(self) -> str:
        start = self.node._token(self.number, self.kind)  # noqa: SLF001 - of this module
        name, kind = _mangled(self.place.name), _mangled(self.place.kind)
        return f"{start}/{name}/{kind}/{self.place.type_hash}/{qos_text(self.qos)}"

    @property
    def gid(self) -> bytes:
        """Its number in attachments, which peers also compute from the token."""
        return xxh3_128_intdigest(self.token.encode()).to_bytes(GID, "little")


class MessageAttachment(Struct, frozen=True):
    """The attachment of a message, a request or a response.

    :param number: counts the publisher's messages, or the client's requests.
    :param time_ns: nanoseconds since the epoch.
    :param gid: the publisher's or the client's number.
    """

    number: int
    time_ns: int
    gid: bytes

    def __bytes__(self) -> bytes:
        return _ATTACHMENT.pack(self.number, self.time_ns, GID, self.gid)


def attachment_of(data: bytes) -> MessageAttachment | None:
    """Return an attachment, or None for other bytes (releases before 2025 have another format)."""
    if len(data) != _ATTACHMENT.size:
        return None
    number, time_ns, size, gid = _ATTACHMENT.unpack(data)
    return MessageAttachment(number, time_ns, gid) if size == GID else None


def place_of(name: str, kind: TypeName, definitions: Definitions, *, is_service: bool = False) -> TypedName:
    # Read the fields first: their errors name the unknown type.
    definitions.fields(kind.derived("Request") if is_service else kind)
    return TypedName(name, kind.dds, definitions.type_hash(kind) if definitions.has_hashes else NO_HASH)


def tokens_of(domain: int) -> str:
    """Return the expression that matches all tokens of a domain."""
    return f"{_SPACE}/{domain}/**"


def endpoint_of(token: str) -> GraphEndpoint | None:
    """Return the endpoint of a token; None for a node and for invalid tokens, which any peer may send."""
    parts = token.split("/")
    # newer releases append a part about the memory backend
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
    """Return the QoS text of tokens: the values that differ from rmw_zenoh_cpp's defaults."""
    reliability = "2" if qos.reliability == "best_effort" else ""
    durability = "1" if qos.durability == "transient_local" else ""
    depth = "" if qos.depth == _DEPTH else qos.depth
    return f"{reliability}:{durability}:,{depth}:,:,:,,"


def qos_of(text: str) -> QosProfile | None:
    """Return a QoS, or None for an invalid text. Times and the kind of history are ignored."""
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
    return text.isascii() and text.isdecimal() and len(text) <= 20  # noqa: PLR2004 - digits of 64 bits


def _mangled(name: str) -> str:
    return name.replace("/", "%")


def _plain(name: str) -> str:
    return name.replace("%", "/")
