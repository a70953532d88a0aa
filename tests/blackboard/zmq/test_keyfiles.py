"""Key files: their access rights, and the refusal to replace them."""

from __future__ import annotations

import os

import pytest

from cxbridge.blackboard.kit.errors import EndpointError
from cxbridge.blackboard.zmq.keyfiles import create_keys
from cxbridge.blackboard.zmq.security import load_keys


def test_only_user_may_read_secret_key(tmp_path):
    before = os.umask(0)
    try:
        public_file, secret_file = create_keys(tmp_path, "robot")
    finally:
        os.umask(before)
    assert secret_file.stat().st_mode & 0o777 == 0o600
    assert public_file.stat().st_mode & 0o777 == 0o644
    assert load_keys(secret_file)[1].decode() not in public_file.read_text()


@pytest.mark.parametrize("suffix", ["key", "key_secret"])
def test_existing_key_files_are_kept(tmp_path, suffix):
    (tmp_path / f"robot.{suffix}").write_text("mine")
    with pytest.raises(EndpointError, match="the key file exists already"):
        create_keys(tmp_path, "robot")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [(f"robot.{suffix}", "mine")]


@pytest.mark.parametrize("name", ["", "..", "a/b", "/etc/robot", 'a"b', "a\nb", "a "])
def test_invalid_key_names_are_refused(tmp_path, name):
    with pytest.raises(EndpointError, match="is not a valid name of a key"):
        create_keys(tmp_path, name)
    assert list(tmp_path.iterdir()) == []
