"""Folders of .proto files to descriptors, by the official compiler."""

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
from cxbridge.process.python import python_command

_SECONDS = 60


def compile_folder(folder: Path, path: Sequence[Path]) -> tuple[list[Any], list[str]]:
    """Compile the .proto files of a folder.

    :param path: where their imports are looked for, the folder among them.
    :returns: the descriptors (``FileDescriptorProto``) of the files and of all that they import, imports
        first; and the compiler's messages about files with a mistake, which are left out.
    :raises ProtobufError: when there is no compiler, or it does not come to an end.
    """
    from google.protobuf import descriptor_pb2  # noqa: PLC0415

    names = sorted(file.name for file in folder.glob("*.proto"))
    if not names:
        return [], []
    data, trouble = _run(names, folder, path)
    if data is None:
        # one by one: those without a mistake remain
        problems, files = [], {}
        for name in names:
            data, trouble = _run([name], folder, path)
            if data is None:
                problems.append(trouble)
                continue
            files.update({file.name: file for file in descriptor_pb2.FileDescriptorSet.FromString(data).file})
        return list(files.values()), list(dict.fromkeys(problems))
    return list(descriptor_pb2.FileDescriptorSet.FromString(data).file), []


def _run(names: Sequence[str], here: Path, path: Sequence[Path]) -> tuple[bytes | None, str]:
    """Return the descriptor set of files; without one, the compiler's messages."""
    command = _command()
    with tempfile.TemporaryDirectory(prefix="cxbridge-proto-") as made:
        out = Path(made) / "set"
        arguments = [f"-I{each}" for each in path] + ["--include_imports", f"--descriptor_set_out={out}"]
        try:
            done = subprocess.run(  # noqa: S603 - the compiler, with files that the configuration names
                [*command, *arguments, *names], cwd=here, capture_output=True, timeout=_SECONDS, check=False
            )
        except subprocess.TimeoutExpired:
            raise ProtobufError(f"the protobuf compiler did not end within {_SECONDS} s") from None
        if done.returncode == 0:
            return out.read_bytes(), ""
    return None, done.stderr.decode("utf-8", "replace").strip()


def _command() -> list[str]:
    """Return how to call the compiler.

    :raises ProtobufError: when there is none.
    """
    if importlib.util.find_spec("grpc_tools") is not None:
        # as a child process: imported it changes how Python imports, and prints its errors
        return python_command("-m", "grpc_tools.protoc")
    found = shutil.which("protoc")
    if found is not None:
        return [found]
    raise ProtobufError(
        ".proto files need the protobuf compiler",
        hint=f"{plugin_command('cxbridge-protobuf')}, or put protoc into the PATH, "
        "or name compiled modules in /clips-protobuf/modules",
    )
