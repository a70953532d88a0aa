"""Compiles the .proto files of a folder to descriptors with protoc, the compiler of protobuf."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cxbridge.errors import ProtobufError
from cxbridge.spawning import python_command


def compile_folder(folder: Path, import_path: Sequence[Path]) -> list[Any]:
    """Compile the .proto files of a folder.

    :param import_path: the folders in which imports are searched, including this folder.
    :returns: the descriptors (``FileDescriptorProto``) of the files and their imports, imports first.
    :raises ProtobufError: with the compiler's messages if a file is invalid.
    """
    from google.protobuf import descriptor_pb2  # noqa: PLC0415 - slow to import

    file_names = sorted(file.name for file in folder.glob("*.proto"))
    if not file_names:
        return []
    descriptor_set = compile_files(file_names, folder, import_path)
    return list(descriptor_pb2.FileDescriptorSet.FromString(descriptor_set).file)


def compile_files(file_names: Sequence[str], folder: Path, import_path: Sequence[Path]) -> bytes:
    """Compile files of a folder; return the encoded ``FileDescriptorSet`` of the files and their imports.

    :param import_path: as in :func:`compile_folder`.
    :raises ProtobufError: with the compiler's messages if a file is invalid.
    """
    with tempfile.TemporaryDirectory(prefix="cxbridge-proto-") as temporary_folder:
        descriptor_file = Path(temporary_folder) / "set"
        arguments = [f"-I{import_folder}" for import_folder in import_path]
        arguments += ["--include_imports", f"--descriptor_set_out={descriptor_file}", *file_names]
        process = subprocess.run(  # noqa: S603 - the compiler, with files of a folder from the configuration
            # a separate process, since the import of grpc_tools changes Python's import system, and its
            # compiler prints errors to stderr
            python_command("-m", "grpc_tools.protoc", *arguments),
            cwd=folder,
            capture_output=True,
            check=False,
        )
        if process.returncode != 0:
            raise ProtobufError(process.stderr.decode("utf-8", "replace").strip())
        return descriptor_file.read_bytes()
