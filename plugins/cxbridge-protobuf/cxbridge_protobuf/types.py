"""The message types of an environment, by name and by their numbers in frames.

A type with numbers has a nested enumeration ``CompType`` with the values ``COMP_ID`` (the component) and
``MSG_TYPE``. Frames identify a type by these numbers.
"""

from __future__ import annotations

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

Message: TypeAlias = Any  # a protobuf message; its class is created at run time

_MAX_NUMBER = 65535  # in frames, both numbers have 16 bits


class MessageTypes:
    """Message types from .proto files.

    :param warn: called with a line about each unusable folder, file or type.
    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self._pool = descriptor_pool.DescriptorPool()
        self._file_names: set[str] = set()
        self._classes_by_numbers: dict[tuple[int, int], Any] = {}  # by component id and message type

    def add_folders(self, folders: Sequence[Path]) -> None:
        """Compile the .proto files of folders, and register the types in them that have numbers."""
        existing_folders = [folder.resolve() for folder in folders if folder.is_dir()]
        for folder in folders:
            if not folder.is_dir():
                self._warn(f"There is no folder {folder} for .proto files (/clips-protobuf/proto-dirs)")
        for folder in existing_folders:
            try:
                # protoc searches in this order: the folder's own files hide files of the same name
                file_definitions = compile_folder(folder, [folder, *existing_folders])
            except ProtobufError as error:
                self._warn(f"Cannot read the .proto files of {folder}: {error}")
                continue
            for definition in file_definitions:
                # the types of imported files are known, but only the types of this folder are registered
                self._add_file(
                    definition,
                    registers_types="/" not in definition.name and (folder / definition.name).is_file(),
                )

    def _add_file(self, definition: Any, *, registers_types: bool) -> None:
        if definition.name in self._file_names:
            return
        try:
            self._pool.AddSerializedFile(definition.SerializeToString())
            file_descriptor = self._pool.FindFileByName(definition.name)
        # for a missing import or a conflict: TypeError of protobuf in C, KeyError of protobuf in Python
        except (TypeError, KeyError) as error:
            self._warn(f"Skipping {definition.name}: {error}")
            return
        self._file_names.add(definition.name)
        if registers_types:
            self._register_numbered_types(file_descriptor)

    def _register_numbered_types(self, file_descriptor: Any) -> None:
        for name, descriptor in file_descriptor.message_types_by_name.items():
            if "CompType" in descriptor.enum_types_by_name:  # frames cannot have other types
                try:
                    self.register(descriptor.full_name)
                except ProtobufError as error:
                    self._warn(f"Type {name} of {file_descriptor.name} is not registered: {error}")

    def register(self, full_name: str) -> None:
        """Register a type, so that frames with its numbers are accepted.

        :raises ProtobufError: if the type is unknown or has no valid numbers, or its numbers are registered
            already.
        """
        message_class = self._find_class(full_name)
        component, type_ = message_numbers(message_class.DESCRIPTOR)
        if (component, type_) in self._classes_by_numbers:
            raise ProtobufError(f"Message type {component}:{type_} already registered")
        self._classes_by_numbers[component, type_] = message_class

    def is_registered(self, full_name: str) -> bool:
        return any(
            message_class.DESCRIPTOR.full_name == full_name
            for message_class in self._classes_by_numbers.values()
        )

    def create(self, full_name: str) -> Message:
        """Return a new message without values.

        :raises ProtobufError: if the type is unknown.
        """
        return self._find_class(full_name)()

    def parse(self, frame: Frame) -> Message:
        """Return the message of a frame.

        :raises ProtobufError: if the type of the message is not registered, or parsing fails.
        """
        message_class = self._classes_by_numbers.get((frame.component, frame.type))
        if message_class is None:
            raise ProtobufError(f"Message type {frame.component}:{frame.type} not registered")
        try:
            parsed_message = message_class.FromString(frame.encoded_message)
        # RecursionError, a RuntimeError: older versions of protobuf in Python, for deep nesting
        except (message.DecodeError, RuntimeError):
            raise ProtobufError("Failed to parse message") from None
        if not parsed_message.IsInitialized():  # FromString accepts messages without required fields
            raise ProtobufError("Failed to parse message: required fields are missing")
        return parsed_message

    def _find_class(self, full_name: str) -> Any:
        try:
            descriptor = self._pool.FindMessageTypeByName(full_name)
        except KeyError:
            raise ProtobufError("Unknown message type") from None
        return message_factory.GetMessageClass(descriptor)


def message_numbers(descriptor: Any) -> tuple[int, int]:
    """Return the numbers that identify a type in frames: its component id and its message type.

    :raises ProtobufError: if the type has no valid numbers.
    """
    enum = descriptor.enum_types_by_name.get("CompType")
    if enum is None:
        raise ProtobufError("Message does not have CompType enum")
    enum_values = [enum.values_by_name.get(name) for name in ("COMP_ID", "MSG_TYPE")]
    if None in enum_values:
        raise ProtobufError("Message CompType enum has no COMP_ID or MSG_TYPE value")
    component, type_ = (int(enum_value.number) for enum_value in enum_values)
    if not (0 <= component <= _MAX_NUMBER and 0 <= type_ <= _MAX_NUMBER):
        raise ProtobufError("Message has an invalid COMP_ID or MSG_TYPE")
    return component, type_


def make_frame(protobuf_message: Message) -> Frame:
    """Return the frame of a message.

    :raises ProtobufError: if the type of the message has no valid numbers, or required fields are missing.
    """
    component, type_ = message_numbers(protobuf_message.DESCRIPTOR)
    try:
        return Frame(component, type_, protobuf_message.SerializeToString())
    except message.EncodeError as error:
        raise ProtobufError(str(error)) from None
