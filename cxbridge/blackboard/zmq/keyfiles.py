"""Creation of the CURVE key files that :mod:`~cxbridge.blackboard.zmq.security` reads."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final

import zmq

from cxbridge.blackboard.kit.errors import EndpointError

_KEY_NAME: Final = re.compile(r"[\w.-]*\w")


def create_keys(folder: Path, name: str) -> tuple[Path, Path]:
    """Create a key pair in the format of ZeroMQ certificates; return the public and the secret file.

    Only the user can read the secret file. Existing files are never overwritten.

    :param folder: the folder of the files, created if it does not exist.
    :param name: the owner of the keys; the files are ``name.key`` and ``name.key_secret``.
    :raises EndpointError: if the name has other characters than letters, digits, ``_``, ``-`` and ``.``,
        or ends in ``-`` or ``.``; or if one of the files exists.
    :raises OSError: if the folder cannot be written.
    """
    if not _KEY_NAME.fullmatch(name):
        raise EndpointError(
            f"'{name}' is not a valid name of a key",
            hint="use letters, digits, '_', '-' and '.', with no '-' or '.' at the end",
        )
    folder.mkdir(parents=True, exist_ok=True)
    public_file, secret_file = folder / f"{name}.key", folder / f"{name}.key_secret"
    # both checks precede the first write, so that no half of a pair remains
    for file in (public_file, secret_file):
        if file.exists():
            raise EndpointError(
                "the key file exists already", file=file, hint="choose another name or folder"
            )
    public, secret = (key.decode() for key in zmq.curve_keypair())
    body = f'metadata\n    name = "{name}"\ncurve\n    public-key = "{public}"\n'
    _write_new(secret_file, f'# Secret: never leaves its host.\n{body}    secret-key = "{secret}"\n', 0o600)
    _write_new(public_file, f"# Public: for the peers of {name}.\n{body}", 0o644)
    return public_file, secret_file


def _write_new(file: Path, text: str, mode: int) -> None:
    """Create a file with at most the permissions ``mode`` from the start.

    So no other user can read a secret key while it is written.
    """
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
        stream.write(text)
