"""Names of rmw_zenoh_cpp in Zenoh: keys, liveliness tokens, QoS, attachments.

The design document of rmw_zenoh_cpp specifies them. A token announces an entity: a node, a publisher, a
subscription, a server or a client of a service.
"""

from __future__ import annotations

import struct
from typing import Final, Literal

from msgspec import Struct
from xxhash import xxh3_128_intdigest

from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.names import TypeName
from cxbridge_ros2.qos import QosProfile

# A publisher of messages, a subscription, a server of a service, or a client.
Kind = Literal["MP", "MS", "SS", "SC"]

# Placeholder for the hash in distributions without hashes, such as Humble.
NO_HASH: Final = "TypeHashNotSupported"

GID_BYTES: Final = 16  # length of the number of a publisher or a client

_SPACE: Final = "@ros2_lv"
_NODE: Final = "NN"
_KINDS: Final[dict[str, Kind]] = {"MP": "MP", "MS": "MS", "SS": "SS", "SC": "SC"}
_TOKEN_PARTS: Final = (
    13  # parts of an endpoint's token; newer releases append a part about the memory backend
)
_ATTACHMENT: Final = struct.Struct(f"<qqB{GID_BYTES}s")
_DEFAULT_DEPTH: Final = 42  # default of rmw_zenoh_cpp, which omits this depth from the text of a QoS


class TypedName(Struct, frozen=True):
    """A topic or a service of one type. Endpoints with equal values reach each other.

    :param name: the name, such as ``/robot1/odom``.
    :param dds_type: the name of the type in DDS.
    :param type_hash: the hash of the type, such as ``RIHS01_df66…``.
    """

    name: str
    dds_type: str
    type_hash: str

    def key(self, domain: int) -> str:
        """Return the key for messages or requests."""
        return f"{domain}/{self.name.strip('/')}/{self.dds_type}/{self.type_hash}"


class NodeName(Struct, frozen=True):
    """A node.

    :param session: the id of the node's Zenoh session.
    :param number: the number of the node in the session.
    :param namespace: ``/`` for none.
    :param enclave: the node's security enclave; ``/`` for none.
    """

    domain: int
    session: str
    number: int
    name: str
    namespace: str = "/"
    enclave: str = "/"

    @property
    def token(self) -> str:
        return self.token_of(self.number, _NODE)

    def token_of(self, number: int, kind: str) -> str:
        """Return the token of an entity of the node, without the parts that only endpoints have."""
        start = f"{_SPACE}/{self.domain}/{self.session}/{self.number}/{number}/{kind}"
        return f"{start}/{_mangle(self.enclave)}/{_mangle(self.namespace)}/{self.name}"


class GraphEndpoint(Struct, frozen=True):
    """A publisher, a subscription, a server or a client of our node.

    :param number: the number of the endpoint in the session.
    """

    node: NodeName
    number: int
    kind: Kind
    topic: TypedName
    qos: QosProfile

    @property
    def token(self) -> str:
        start = self.node.token_of(self.number, self.kind)
        name, dds_type = _mangle(self.topic.name), _mangle(self.topic.dds_type)
        return f"{start}/{name}/{dds_type}/{self.topic.type_hash}/{qos_text(self.qos)}"

    @property
    def gid(self) -> bytes:
        """The number of the endpoint in attachments, which peers also compute from the token."""
        return xxh3_128_intdigest(self.token.encode()).to_bytes(GID_BYTES, "little")


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
        return _ATTACHMENT.pack(self.number, self.time_ns, GID_BYTES, self.gid)


def attachment_of(data: bytes) -> MessageAttachment | None:
    """Return an attachment, or None for other bytes (releases before 2025 have another format)."""
    if len(data) != _ATTACHMENT.size:
        return None
    number, time_ns, size, gid = _ATTACHMENT.unpack(data)
    return MessageAttachment(number, time_ns, gid) if size == GID_BYTES else None


def typed_name(name: str, kind: TypeName, definitions: Definitions, *, is_service: bool = False) -> TypedName:
    # read the fields first: their errors name the unknown type
    definitions.fields(kind.derive("Request") if is_service else kind)
    return TypedName(
        name, kind.dds_name, definitions.type_hash(kind) if definitions.has_type_hashes else NO_HASH
    )


def tokens_of(domain: int) -> str:
    """Return the expression that matches all tokens of a domain."""
    return f"{_SPACE}/{domain}/**"


def endpoint_in(token: str) -> tuple[Kind, TypedName] | None:
    """Return kind and topic of a token; None for a node and for invalid tokens, which any peer may send."""
    parts = token.split("/")
    if len(parts) < _TOKEN_PARTS or parts[0] != _SPACE or not all(parts) or parts[5] not in _KINDS:
        return None
    # SPACE/DOMAIN/SESSION/NODE/NUMBER/KIND/ENCLAVE/NAMESPACE/NODE_NAME/NAME/TYPE/HASH/QOS
    return _KINDS[parts[5]], TypedName(_unmangle(parts[9]), _unmangle(parts[10]), parts[11])


def qos_text(qos: QosProfile) -> str:
    """Return the QoS text of tokens: the values that differ from rmw_zenoh_cpp's defaults."""
    reliability = "2" if qos.reliability == "best_effort" else ""
    durability = "1" if qos.durability == "transient_local" else ""
    depth = "" if qos.depth == _DEFAULT_DEPTH else qos.depth
    return f"{reliability}:{durability}:,{depth}:,:,:,,"


def _mangle(name: str) -> str:
    """Return a name as one part of a token, whose parts are separated by slashes."""
    return name.replace("/", "%")


def _unmangle(name: str) -> str:
    return name.replace("%", "/")
