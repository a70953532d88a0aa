"""Security of endpoints: an endpoint that other machines can reach needs CURVE keys.

ZeroMQ's CURVE encrypts a connection, and each peer proves that it has its secret key. The protocol has no
other login.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import zmq

from cxbridge.blackboard.kit.errors import EndpointError, InsecureEndpointError
from cxbridge.listening import check_server_address, is_abstract_socket, is_private_endpoint

SCHEMES: Final = ("tcp", "ipc")
"""The ZeroMQ transports that the blackboard uses."""


@dataclass(frozen=True, slots=True)
class CurveServer:
    """The keys of a server.

    :param secret_key: a secret file of :func:`~cxbridge.blackboard.zmq.keyfiles.create_keys`.
    :param clients: the folder with the public keys of allowed clients.
    """

    secret_key: Path
    clients: Path

    def apply(self, socket: zmq.Socket[bytes]) -> None:
        """Make an unbound socket refuse connections without CURVE keys.

        The authenticator of the server compares the keys with those in the folder.

        :raises EndpointError: if the folder or a file is missing or invalid.
        """
        if not self.clients.is_dir():
            raise EndpointError("the folder with the clients' public keys does not exist", file=self.clients)
        socket.curve_publickey, socket.curve_secretkey = load_keys(self.secret_key)
        socket.curve_server = True


@dataclass(frozen=True, slots=True)
class CurveClient:
    """The keys of a client.

    :param secret_key: the file with the secret key of the client.
    :param server_key: the file with the public key of the server.
    """

    secret_key: Path
    server_key: Path

    def apply(self, socket: zmq.Socket[bytes]) -> None:
        """Restrict an unconnected socket to the server that has the key.

        :raises EndpointError: if a file is missing or invalid.
        """
        socket.curve_publickey, socket.curve_secretkey = load_keys(self.secret_key)
        socket.curve_serverkey, _ = load_keys(self.server_key, needs_secret=False)


def load_keys(path: Path, *, needs_secret: bool = True) -> tuple[bytes, bytes]:
    """Return the public and the secret key of a file; the secret key is empty if the file has none.

    :param needs_secret: whether a file without secret key is an error.
    :raises EndpointError: if the file is missing or unusable, or lacks the key.
    """
    from zmq.auth import load_certificate  # noqa: PLC0415 - slow to import, and rarely needed

    try:
        public_key, secret_key = load_certificate(path)
    except (OSError, ValueError) as error:
        raise EndpointError(f"the key file is unusable: {error}", file=path) from error
    if needs_secret and secret_key is None:
        raise EndpointError("the key file has no secret key", file=path, hint="use the .key_secret file")
    return public_key, secret_key or b""


def check_endpoint(endpoint: str, *, has_keys: bool, is_insecure_allowed: bool) -> None:
    """Check the form of an endpoint and its security.

    :param has_keys: whether the endpoint has CURVE keys.
    :param is_insecure_allowed: whether the user accepts connections without keys.
    :raises EndpointError: if the text is not an endpoint.
    :raises InsecureEndpointError: if the endpoint needs keys.
    """
    scheme, separator, address = endpoint.partition("://")
    if not separator or scheme not in SCHEMES or not address:
        raise EndpointError(f"'{endpoint}' is not an endpoint", hint="write tcp://host:port or ipc://path")
    check_server_address(
        "a blackboard",
        endpoint,
        is_local=is_private_endpoint(endpoint),
        is_restricted=has_keys or is_insecure_allowed,
        hint="it needs CURVE keys, which 'cxbridge keys' makes, see docs/security.md; "
        "the option 'insecure' allows connections without keys",
        error_class=InsecureEndpointError,
    )


def uses_curve(endpoint: str) -> bool:
    """Return whether CURVE keys apply to an endpoint."""
    # file permissions protect an ipc endpoint
    return endpoint.startswith("tcp:") or is_abstract_socket(endpoint)
