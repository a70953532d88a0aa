"""Secret values of a configuration: docs/configuration.md, Secrets.

The same rule applies wherever a configuration leaves the process: REST, Fawkes' protocol, recordings, errors.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import Final

from msgspec.structs import replace

from cxbridge.config.documents import YamlList, YamlMap, YamlNode, YamlScalar, parse_documents
from cxbridge.config.scalars import ConfigType, scalar_type
from cxbridge.config.tree import ConfigValue
from cxbridge.errors import ConfigError

MASKED_TEXT: Final = "(not told)"
"""The text in place of a secret."""

# The words of a name: api and Key in apiKey, API and Key in APIKey.
_WORD: Final = re.compile(r"[A-Z]?[a-z0-9]+|[A-Z0-9]+(?![a-z])")
# The endings of words that name secrets.
_ENDINGS: Final = tuple(
    name + plural
    for name in ("password", "passwd", "pwd", "passphrase", "secret", "token", "credential", "psk")
    for plural in ("", "s")
)
# The kinds of keys that are secrets, such as ``crypto-key`` or ``apikey``.
_KEY_KINDS: Final = ("encryption", "crypto", "private", "api", "access", "shared", "auth", "signing")
_KEY_ENDINGS: Final = tuple(f"{kind}key" for kind in _KEY_KINDS)
# A path at which each key is a user, and each value a password or its hash.
_USER_MAP: Final = re.compile(r"/*webview/+users/")

# The user in a URI, with or without a password: user:password@ in mongodb://user:password@host/. The password
# may have further @ and /, so it ends at the last @ before a blank.
_USER: Final = re.compile(r"(?<=://)(?:[^\s/:@]*:\S*|[^\s/:@]+)@")
# A parameter of a URI with the name of a secret: token=abc in http://host/?token=abc. A masked value is kept.
_PARAMETER: Final = re.compile(
    rf"([?&;][^=&;\s]*(?:{'|'.join(_ENDINGS)}|(?:{'|'.join(_KEY_KINDS)})[-_]?key)=)"
    rf"(?!{re.escape(MASKED_TEXT)})[^&;#\s]+",
    re.IGNORECASE,
)
_PEM: Final = re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY-----")


def is_secret(path: str) -> bool:
    """Return whether the values at or below a path are secret, by the names in the path."""
    return bool(_USER_MAP.match(path)) or any(map(_is_secret_name, path.split("/")))


@lru_cache(maxsize=4096)  # the paths of a configuration have the same elements
def _is_secret_name(name: str) -> bool:
    words = [word.lower() for word in _WORD.findall(name)]
    # apiKey and api-key have two words
    word_pairs = (word + following for word, following in zip(("", *words), words, strict=False))
    return any(word.endswith(_ENDINGS) for word in words) or any(
        word.removesuffix("s").endswith(_KEY_ENDINGS) for word in word_pairs
    )


def mask(path: str, text: str) -> str:
    """Return a value's text without secrets.

    :param path: the path of the value, empty if it is unknown.
    """
    # a switch such as `use-password: true` reveals nothing
    is_public = not text or not is_secret(path) or scalar_type(text) is ConfigType.BOOL
    if _PEM.search(text) or not is_public:
        return MASKED_TEXT
    if "://" in text:
        text = _USER.sub(f"{MASKED_TEXT}@", text)
        text = _PARAMETER.sub(rf"\g<1>{MASKED_TEXT}", text)
    return text


def mask_value(value: ConfigValue) -> ConfigValue:
    """Return a value without secrets."""
    return replace(
        value,
        text=mask(value.path, value.text),
        items=tuple(mask(value.path, text) for text in value.items),
    )


def has_secrets(content: bytes) -> bool:
    """Return whether a configuration file has secrets, or cannot be searched for secrets."""
    try:
        return any(
            mask(path, node.text) != node.text
            for root in parse_documents(content, "")
            for path, node in _walk_scalars(root, "")
        )
    except ConfigError:
        return True


def _walk_scalars(node: YamlNode, path: str) -> Iterator[tuple[str, YamlScalar]]:
    """Yield path and node of each scalar; the elements of a list have the path of the list."""
    if isinstance(node, YamlScalar):
        yield path, node
    elif isinstance(node, YamlList):
        for item in node.items:
            yield from _walk_scalars(item, path)
    elif isinstance(node, YamlMap):
        for key, value in node.pairs:
            name = key.text if isinstance(key, YamlScalar) else ""
            yield from _walk_scalars(value, f"{path}/{name}")
