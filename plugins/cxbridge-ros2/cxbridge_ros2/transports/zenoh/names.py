"""The names that rmw_zenoh_cpp uses in Zenoh: keys, liveliness tokens, texts of QoS, and attachments.

The design document of rmw_zenoh_cpp specifies the names. Messages and requests have keys; a token announces a
node or an endpoint: a publisher, a subscription, a server or a client of a service.
"""

from __future__ import annotations

import struct
from typing import Final, Literal

from msgspec import Struct
from xxhash import xxh3_128_intdigest

from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.names import TypeName
from cxbridge_ros2.qos import QosProfile

# Endpoints: publisher (MP), subscription (MS), server of a service (SS), client of a service (SC).
EndpointKind = Literal["MP", "MS", "SS", "SC"]

# Placeholder for the hash in distributions without hashes, such as Humble.
NO_HASH: Final = "TypeHashNotSupported"

GID_BYTES: Final = 16  # length of the GID, the unique number of an endpoint

_KEY_SPACE: Final = "@ros2_lv"
_NODE_KIND: Final = "NN"
_ENDPOINT_KINDS: Final[dict[str, EndpointKind]] = {"MP": "MP", "MS": "MS", "SS": "SS", "SC": "SC"}
_MIN_TOKEN_PARTS: Final = 13  # parts of an endpoint's token; newer releases append one
_ATTACHMENT_FORMAT: Final = struct.Struct(f"<qqB{GID_BYTES}s")
_DEFAULT_DEPTH: Final = 42  # default of rmw_zenoh_cpp, which omits this depth from the text of a QoS


class TypedName(Struct, frozen=True):
    """A topic or a service with its type. Endpoints whose values are equal reach each other.

    :param name: the name, such as ``/robot1/odom``.
    :param dds_type: the name of the type in DDS.
    :param type_hash: the hash of the type, such as ``RIHS01_df66…``.
    """

    name: str
    dds_type: str
    type_hash: str

    def make_key(self, domain: int) -> str:
        """Return the key of messages or requests in Zenoh."""
        return f"{domain}/{self.name.strip('/')}/{self.dds_type}/{self.type_hash}"


class NodeName(Struct, frozen=True):
    """A node.

    :param session: the id of the node's Zenoh session.
    :param number: the number of the node in the session.
    :param namespace: the namespace; ``/`` for none.
    :param enclave: the security enclave; ``/`` for none.
    """

    domain: int
    session: str
    number: int
    name: str
    namespace: str = "/"
    enclave: str = "/"

    @property
    def token(self) -> str:
        return self.make_token(self.number, _NODE_KIND)

    def make_token(self, number: int, kind: str) -> str:
        """Return the token of the node or of one of its endpoints, without the parts about the endpoint.

        :param number: the number of the node or endpoint in the session.
        """
        start = f"{_KEY_SPACE}/{self.domain}/{self.session}/{self.number}/{number}/{kind}"
        return f"{start}/{_mangle(self.enclave)}/{_mangle(self.namespace)}/{self.name}"


class GraphEndpoint(Struct, frozen=True):
    """A publisher, a subscription, a server or a client of our node.

    :param number: the number of the endpoint in the session.
    """

    node: NodeName
    number: int
    kind: EndpointKind
    topic: TypedName
    qos: QosProfile

    @property
    def token(self) -> str:
        start = self.node.make_token(self.number, self.kind)
        name, dds_type = _mangle(self.topic.name), _mangle(self.topic.dds_type)
        return f"{start}/{name}/{dds_type}/{self.topic.type_hash}/{format_qos(self.qos)}"

    @property
    def gid(self) -> bytes:
        """The unique number of the endpoint, which other nodes compute from the token, too."""
        return xxh3_128_intdigest(self.token.encode()).to_bytes(GID_BYTES, "little")


class MessageAttachment(Struct, frozen=True):
    """The attachment of a message, a request or a response.

    :param number: the number of the publisher's message or of the client's request.
    :param time_ns: the time of sending, in nanoseconds since the epoch.
    :param gid: the GID of the publisher or of the client.
    """

    number: int
    time_ns: int
    gid: bytes

    def __bytes__(self) -> bytes:
        return _ATTACHMENT_FORMAT.pack(self.number, self.time_ns, GID_BYTES, self.gid)


def parse_attachment(data: bytes) -> MessageAttachment | None:
    """Parse an attachment; return None for another format, such as that of releases before 2025."""
    if len(data) != _ATTACHMENT_FORMAT.size:
        return None
    number, time_ns, size, gid = _ATTACHMENT_FORMAT.unpack(data)
    return MessageAttachment(number, time_ns, gid) if size == GID_BYTES else None


def make_typed_name(
    name: str, type_name: TypeName, definitions: Definitions, *, is_service: bool = False
) -> TypedName:
    # raises the error about an unknown type, which names the type
    definitions.find_fields(type_name.derive("Request") if is_service else type_name)
    return TypedName(
        name,
        type_name.dds_name,
        definitions.compute_type_hash(type_name) if definitions.has_type_hashes else NO_HASH,
    )


def make_token_pattern(domain: int) -> str:
    """Return the key expression of Zenoh that matches all tokens of a domain."""
    return f"{_KEY_SPACE}/{domain}/**"


def parse_token(token: str) -> tuple[EndpointKind, TypedName] | None:
    """Return the kind and the topic of the endpoint in a token.

    None stands for the token of a node, and for an invalid token, which other sessions may declare.
    """
    parts = token.split("/")
    if (
        len(parts) < _MIN_TOKEN_PARTS
        or parts[0] != _KEY_SPACE
        or not all(parts)
        or parts[5] not in _ENDPOINT_KINDS
    ):
        return None
    # SPACE/DOMAIN/SESSION/NODE/NUMBER/KIND/ENCLAVE/NAMESPACE/NODE_NAME/NAME/TYPE/HASH/QOS
    return _ENDPOINT_KINDS[parts[5]], TypedName(_unmangle(parts[9]), _unmangle(parts[10]), parts[11])


def format_qos(qos: QosProfile) -> str:
    """Return the text of a QoS in tokens. Values equal to the defaults of rmw_zenoh_cpp are left out.

    The parts are reliability, durability, history and depth, deadline, lifespan, and liveliness.
    """
    reliability = "2" if qos.reliability == "best_effort" else ""
    durability = "1" if qos.durability == "transient_local" else ""
    depth = "" if qos.depth == _DEFAULT_DEPTH else qos.depth
    return f"{reliability}:{durability}:,{depth}:,:,:,,"


def _mangle(name: str) -> str:
    """Return a name as a part of a token. Slashes separate the parts, so that the name must not have any."""
    return name.replace("/", "%")


def _unmangle(name: str) -> str:
    return name.replace("%", "/")
