"""Compilation of folders of .proto files to descriptors with the official compiler."""

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

_TIMEOUT_S = 60


def compile_folder(folder: Path, path: Sequence[Path]) -> tuple[list[Any], list[str]]:
    """Compile the .proto files of a folder.

    :param path: the import path, including the folder.
    :returns: the descriptors (``FileDescriptorProto``) of valid files and their imports, imports first; and
        the compiler's messages about invalid files.
    :raises ProtobufError: if there is no compiler, or it does not end in time.
    """
    from google.protobuf import descriptor_pb2  # noqa: PLC0415

    names = sorted(file.name for file in folder.glob("*.proto"))
    if not names:
        return [], []
    data, messages = _run(names, folder, path)
    if data is None:
        # compile one by one, so that one invalid file does not exclude the rest
        problems, files = [], {}
        for name in names:
            data, messages = _run([name], folder, path)
            if data is None:
                problems.append(messages)
                continue
            files.update({file.name: file for file in descriptor_pb2.FileDescriptorSet.FromString(data).file})
        return list(files.values()), list(dict.fromkeys(problems))
    return list(descriptor_pb2.FileDescriptorSet.FromString(data).file), []


def _run(names: Sequence[str], folder: Path, path: Sequence[Path]) -> tuple[bytes | None, str]:
    """Return the descriptor set of files; None with the compiler's messages on failure."""
    command = _command()
    with tempfile.TemporaryDirectory(prefix="cxbridge-proto-") as temporary_folder:
        output = Path(temporary_folder) / "set"
        arguments = [f"-I{folder}" for folder in path]
        arguments += ["--include_imports", f"--descriptor_set_out={output}"]
        try:
            process = subprocess.run(  # noqa: S603 - the compiler, with files that the configuration names
                [*command, *arguments, *names],
                cwd=folder,
                capture_output=True,
                timeout=_TIMEOUT_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise ProtobufError(f"the protobuf compiler did not end within {_TIMEOUT_S} s") from None
        if process.returncode == 0:
            return output.read_bytes(), ""
    return None, process.stderr.decode("utf-8", "replace").strip()


def _command() -> list[str]:
    if importlib.util.find_spec("grpc_tools") is not None:
        # as a child process: the import of grpc_tools changes Python's import system, and its compiler prints
        # errors to stderr
        return python_command("-m", "grpc_tools.protoc")
    protoc = shutil.which("protoc")
    if protoc is not None:
        return [protoc]
    raise ProtobufError(
        ".proto files need the protobuf compiler",
        hint=f"{plugin_command('cxbridge-protobuf')}, or put protoc into the PATH, "
        "or name compiled modules in /clips-protobuf/modules",
    )
