"""The message types that an environment knows, by name and by their numbers on the wire."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from google.protobuf import (
    descriptor_pool,
    message,
    message_factory,
)

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.compiler import compile_folder
from cxbridge_protobuf.frames import Frame

Message: TypeAlias = Any
"""A protobuf message: its classes are made when the program runs."""

_MOST = 65535


class MessageTypes:
    """Message types from .proto files and from compiled modules.

    :param warn: called for files, modules and types that cannot be used.
    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self._pool = descriptor_pool.DescriptorPool()
        self._files: set[str] = set()
        self._by_key: dict[tuple[int, int], Any] = {}

    def add_folders(self, folders: Sequence[Path]) -> None:
        """Compile the .proto files of folders, and register their types that have numbers."""
        present = [folder.resolve() for folder in folders if folder.is_dir()]
        for folder in folders:
            if not folder.is_dir():
                self._warn(f"There is no folder {folder} for .proto files (/clips-protobuf/proto-dirs)")
        for folder in present:
            try:
                files, problems = compile_folder(folder, [folder, *present])
            except ProtobufError as error:
                self._warn(f"The .proto files of {folder} are not read: {error}")
                return
            for problem in problems:
                self._warn(f"A .proto file of {folder} is left out: {problem}")
            for file in files:
                self._add_file(file, register="/" not in file.name and (folder / file.name).is_file())

    def add_module(self, name: str) -> None:
        """Import a module that protoc made, and register its types that have numbers."""
        try:
            descriptor = importlib.import_module(name).DESCRIPTOR
        except Exception as error:  # noqa: BLE001 - whatever a module does
            self._warn(f"The module {name} is not read (/clips-protobuf/modules): {error}")
            return
        self._register_all(descriptor)

    def _add_file(self, file: Any, *, register: bool) -> None:
        if file.name in self._files:
            return
        try:
            self._pool.AddSerializedFile(file.SerializeToString())
            descriptor = self._pool.FindFileByName(file.name)
        except (TypeError, KeyError) as error:
            self._warn(f"{file.name} is left out: {error}")
            return
        self._files.add(file.name)
        if register:
            self._register_all(descriptor)

    def _register_all(self, file: Any) -> None:
        for name, descriptor in file.message_types_by_name.items():
            if "CompType" in descriptor.enum_types_by_name:
                try:
                    self.register(descriptor.full_name)
                except ProtobufError as error:
                    self._warn(f"Type {name} of {file.name} is not registered: {error}")

    def register(self, full_name: str) -> None:
        """Let messages of a type be received.

        :raises ProtobufError: when there is no such type, it has no numbers, or they are taken.
        """
        cls = self._class(full_name)
        key = numbers_of(cls.DESCRIPTOR)
        if key in self._by_key:
            raise ProtobufError(f"Message type {key[0]}:{key[1]} already registered")
        self._by_key[key] = cls

    def is_registered(self, full_name: str) -> bool:
        """Return whether messages of a type can be received."""
        return any(each.DESCRIPTOR.full_name == full_name for each in self._by_key.values())

    def create(self, full_name: str) -> Message:
        """Return a new message.

        :raises ProtobufError: when there is no such type.
        """
        return self._class(full_name)()

    def parse(self, frame: Frame) -> Message:
        """Return the message of a frame.

        :raises ProtobufError: when its type is not registered, or it does not parse.
        """
        cls = self._by_key.get((frame.component, frame.type))
        if cls is None:
            raise ProtobufError(f"Message type {frame.component}:{frame.type} not registered")
        try:
            parsed = cls.FromString(frame.data)
        except (message.DecodeError, RuntimeError):
            raise ProtobufError("Failed to parse message") from None
        if not parsed.IsInitialized():
            raise ProtobufError("Failed to parse message: required fields are missing")
        return parsed

    def _class(self, full_name: str) -> Any:
        # compiled modules first, as protobuf_comm looks
        for pool in (descriptor_pool.Default(), self._pool):
            try:
                descriptor = pool.FindMessageTypeByName(full_name)
            except KeyError:
                continue
            return message_factory.GetMessageClass(descriptor)
        raise ProtobufError("Unknown message type")


def numbers_of(descriptor: Any) -> tuple[int, int]:
    """Return the component id and the message type of a type of messages.

    :raises ProtobufError: when it has none.
    """
    enum = descriptor.enum_types_by_name.get("CompType")
    if enum is None:
        raise ProtobufError("Message does not have CompType enum")
    values = [enum.values_by_name.get(name) for name in ("COMP_ID", "MSG_TYPE")]
    if None in values:
        raise ProtobufError("Message CompType enum has no COMP_ID or MSG_TYPE value")
    component, type_ = (int(value.number) for value in values)
    if not (0 <= component <= _MOST and 0 <= type_ <= _MOST):
        raise ProtobufError("Message has an invalid COMP_ID or MSG_TYPE")
    return component, type_


def frame_of(sent: Message) -> Frame:
    """Return the frame of a message.

    :raises ProtobufError: when its type has no numbers, or required fields are missing.
    """
    component, type_ = numbers_of(sent.DESCRIPTOR)
    try:
        return Frame(component, type_, sent.SerializeToString())
    except message.EncodeError as error:
        raise ProtobufError(str(error)) from None
