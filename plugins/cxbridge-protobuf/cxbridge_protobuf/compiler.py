"""Compiles the .proto files of a folder to descriptors with protoc, the compiler of protobuf."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cxbridge.errors import ProtobufError
from cxbridge.extras import plugin_command
from cxbridge.spawning import python_command

_COMPILER_TIMEOUT_S = 60  # ends a compiler that hangs


def compile_folder(folder: Path, import_path: Sequence[Path]) -> tuple[list[Any], list[str]]:
    """Compile the .proto files of a folder.

    :param import_path: the folders in which imports are searched, including this folder.
    :returns: the descriptors (``FileDescriptorProto``) of valid files and their imports, imports first; and
        the compiler's messages about invalid files.
    :raises ProtobufError: if there is no compiler, or it does not end in time.
    """
    from google.protobuf import descriptor_pb2  # noqa: PLC0415

    file_names = sorted(file.name for file in folder.glob("*.proto"))
    if not file_names:
        return [], []
    descriptor_set, error_text = _compile_files(file_names, folder, import_path)
    if descriptor_set is None:
        # The compiler writes nothing if a file is invalid: compile each file alone to get the valid files.
        error_texts, files = [], {}
        for name in file_names:
            descriptor_set, error_text = _compile_files([name], folder, import_path)
            if descriptor_set is None:
                error_texts.append(error_text)
                continue
            files.update(
                {file.name: file for file in descriptor_pb2.FileDescriptorSet.FromString(descriptor_set).file}
            )
        return list(files.values()), list(dict.fromkeys(error_texts))
    return list(descriptor_pb2.FileDescriptorSet.FromString(descriptor_set).file), []


def _compile_files(
    file_names: Sequence[str], folder: Path, import_path: Sequence[Path]
) -> tuple[bytes | None, str]:
    """Return the descriptor set of files; if the compiler fails, None and the compiler's messages."""
    command = _find_compiler()
    with tempfile.TemporaryDirectory(prefix="cxbridge-proto-") as temporary_folder:
        output = Path(temporary_folder) / "set"
        arguments = [f"-I{folder}" for folder in import_path]
        arguments += ["--include_imports", f"--descriptor_set_out={output}"]
        try:
            process = subprocess.run(  # noqa: S603 - the compiler, with files that the configuration names
                [*command, *arguments, *file_names],
                cwd=folder,
                capture_output=True,
                timeout=_COMPILER_TIMEOUT_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise ProtobufError(f"the protobuf compiler did not end within {_COMPILER_TIMEOUT_S} s") from None
        if process.returncode == 0:
            return output.read_bytes(), ""
    return None, process.stderr.decode("utf-8", "replace").strip()


def _find_compiler() -> list[str]:
    if importlib.util.find_spec("grpc_tools") is not None:
        # A separate process, since the import of grpc_tools changes Python's import system, and its compiler
        # prints errors to stderr.
        return python_command("-m", "grpc_tools.protoc")
    protoc = shutil.which("protoc")
    if protoc is not None:
        return [protoc]
    raise ProtobufError(
        ".proto files need the protobuf compiler",
        hint=f"{plugin_command('cxbridge-protobuf')}, or put protoc into the PATH, "
        "or name compiled modules in /clips-protobuf/modules",
    )
