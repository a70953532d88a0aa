"""The choice of a spec, and checks of its configuration.

Fawkes detects mistakes in a spec during the initialisation or never: it ignores a stage that is not a list,
and the agent waits forever. Here, a wrong type is an error with its place before anything runs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

from cxbridge.config import ConfigType, Configuration, ConfigValue
from cxbridge.errors import ConfigError
from cxbridge.file_access import ABSENT, why_unreadable
from cxbridge.numbers import parse_decimal
from cxbridge.plugins import absent_package_hint, package_hint
from cxbridge.suggestions import did_you_mean, nearest_names

STAGES = ("stage-1", "stage-2", "stage-3")
_ENTRY_KEYS = {"name", "feature-request", "file", "files", "wait-for"}
_BOOLEAN_KEYS = (
    "assert-time-each-loop",
    "automatic-goal-retraction",
    "request-redefine-warning-feature",
    "steal-skiller-control",
    "debug/enable",
)
_LIST_KEYS = ("clips-dirs", "debug/unwatch-facts", "debug/unwatch-rules")
_ROOT = "/clips-executive"
# debug/enable, the last of the Boolean keys, is below the key debug
_EXECUTIVE_KEYS = ("spec", "specs", "clips-dirs", "debug", "exact-retry", "refresh-rate", *_BOOLEAN_KEYS[:-1])
_SPEC_KEYS = ("init", "action-mapping", "blackboard-preload", "parameters")
_SKILLER_KEYS = ("skillspace", "mode", "watch_files", "features", "instances")
# The minimum similarity of an unread key to an absent one that counts as a misspelling: higher than for
# names, because Fawkes' configurations have keys for other programs.
_MIN_SIMILARITY = 0.75


def choose_spec(config: Configuration, spec: str | None, config_file: Path | None = None) -> str:
    """Return the spec to run, and store the choice in the configuration.

    :param spec: the chosen spec; None: the spec that the configuration names.
    :param config_file: the place for an error without a place in the configuration.
    :raises ConfigError: if the spec does not exist, or none is named.
    """
    faulty_value = None
    if spec is None:
        faulty_value = _find_first_value(config, f"{_ROOT}/spec")
    else:
        config.set(f"{_ROOT}/spec", spec)
    chosen_spec = config.get_str(f"{_ROOT}/spec", default="")
    specs = sorted(config.keys(f"{_ROOT}/specs"))
    if chosen_spec and chosen_spec in specs:
        return chosen_spec
    # a misspelt clips-executive explains why the configuration has no specs: raise the first such mistake
    for mistake in () if config.keys(_ROOT) else _find_misspelt_keys(config, "", (_ROOT.removeprefix("/"),)):
        raise mistake
    hint = f"it has: {', '.join(specs)}" if specs else "it has no clips-executive/specs at all"
    problem = f"has no spec '{chosen_spec}'" if chosen_spec else "names no spec (clips-executive/spec)"
    faulty_value = faulty_value or min(
        (value for value in config.search(_ROOT) if value.file), key=_line_number, default=None
    )
    if faulty_value is None and config_file is not None:
        raise ConfigError(f"the configuration {problem}", file=config_file, line=1, hint=hint)
    raise _make_error(f"the configuration {problem}", faulty_value, hint)


def check_spec(config: Configuration, spec: str) -> list[str]:
    """Check the executive's part of the configuration for a spec.

    :returns: warnings about unread keys, and about components that are not installed.
    :raises ConfigError: at the first value of a wrong type, unknown stage or entry without a name.
    """
    base = f"{_ROOT}/specs/{spec}"
    # to read a value is to check its type
    for key in _BOOLEAN_KEYS:
        config.get_bool(f"{_ROOT}/{key}", default=False)
    for key in _LIST_KEYS:
        config.get_strings(f"{_ROOT}/{key}", default=[])
    config.get_uint(f"{_ROOT}/debug/level", default=0)
    config.get_str("/skiller/skillspace", default="")
    config.get_strings(f"{base}/blackboard-preload", default=[])
    for path, shape in (
        (f"{_ROOT}/debug", "a map"),
        (f"{base}/init", "a map of stages"),
        (f"{base}/action-mapping", "a map from actions to skill strings"),
        (f"{base}/parameters", "a map"),
    ):
        _check_container(config, path, shape)
    return [
        *(warning for stage in config.keys(f"{base}/init") for warning in _check_stage(config, base, stage)),
        *(
            f"{stage} waits for a component that is not installed: {hint}"
            for stage, _, file in _find_files(config, spec)
            if (hint := absent_package_hint(file))
        ),
    ]


def find_key_mistakes(config: Configuration, spec: str) -> list[ConfigError]:
    """Return an error for each misspelt key, and for each empty value or wrong type that would be fatal."""
    # with a Fawkes checkout, the caller only warns about the mistakes, because Fawkes ignores unknown keys
    base = f"{_ROOT}/specs/{spec}"
    mistakes = [
        *_find_misspelt_keys(config, _ROOT, _EXECUTIVE_KEYS),
        *_find_misspelt_keys(config, base, _SPEC_KEYS),
        *_find_misspelt_keys(config, "/skiller", _SKILLER_KEYS),
    ]
    if config.exists(base):  # a single value, even an empty one
        mistakes.append(
            _make_error(f"the spec '{spec}' must be a map", config.get(base), "write its init below it")
        )
    for _, path in _find_entries(config, spec):
        mistakes += _find_misspelt_keys(config, path, tuple(sorted(_ENTRY_KEYS)))
        for key in ("name", "file"):
            if config.exists(f"{path}/{key}") and _is_empty(value := config.get(f"{path}/{key}")):
                mistakes.append(_make_error(f"'{key}' is empty", value, f"give the {key}, or remove the key"))
    mapping = f"{base}/action-mapping"
    for action in config.keys(mapping):
        if config.exists(f"{mapping}/{action}") and _is_empty(value := config.get(f"{mapping}/{action}")):
            mistakes.append(
                _make_error(
                    f"the mapping of action '{action}' is empty", value, f"name a skill: {action}: SKILL{{}}"
                )
            )
    return mistakes


def _find_misspelt_keys(config: Configuration, path: str, known_keys: Sequence[str]) -> Iterator[ConfigError]:
    """Yield an error for each key that is similar to a known key that is absent."""
    values = {key: _find_first_value(config, f"{path}/{key}") for key in config.keys(path)}
    written_keys = [key for key, value in values.items() if value is None or value.file]
    # includes keys that only have a default
    absent_keys = [key for key in known_keys if key not in written_keys]
    for key, value in values.items():
        if key not in known_keys and (similar := nearest_names(key, absent_keys, _MIN_SIMILARITY)):
            yield _make_error(f"'{key}' is never read", value, f"did you mean {similar[0]}?")


def check_features(config: Configuration, spec: str, available: Collection[str]) -> None:
    """Check that all requested features of a spec exist.

    :raises ConfigError: for the first missing feature, with file and line.
    """
    # the core's rules find the mistake, too, but without its place; the rules of ros2_cx fail while they
    # report it, and wait forever
    for stage, path in _find_entries(config, spec):
        name = config.get_str(f"{path}/name", default="")
        # as in init.clp: an entry of stage-1 requests a feature unless it says otherwise
        is_requested = config.get_bool(f"{path}/feature-request", default=stage == STAGES[0])
        if is_requested and name not in available:
            raise _make_error(
                f"{stage} asks for the feature '{name}', which is not available",
                config.get(f"{path}/name"),
                package_hint(name)
                or f"there are: {', '.join(sorted(available))}; an entry that just loads files says "
                "feature-request: false",
            )


def find_missing_files(config: Configuration, spec: str, folders: Sequence[Path]) -> list[ConfigError]:
    """Return an error for each file of a spec that no folder has, at the place of the file's entry.

    A file that cannot be read counts as missing.
    """
    errors = []
    for stage, path, file in _find_files(config, spec):
        reasons = {folder / file: why_unreadable(folder / file) for folder in folders}
        if all(reasons.values()):
            errors.append(_make_missing_file_error(stage, file, reasons, config.get(path), folders))
    return errors


def _find_files(config: Configuration, spec: str) -> Iterator[tuple[str, str, str]]:
    """Yield stage, path in the configuration and name of each file in a spec's initialisation."""
    for stage, path in _find_entries(config, spec):
        file = config.get_str(f"{path}/file", default="")
        # a file in both places is listed once, with the key `file`
        path_by_file = dict.fromkeys([file] if file else [], f"{path}/file")
        for name in config.get_strings(f"{path}/files", default=[]):
            path_by_file.setdefault(name, f"{path}/files")
        for name, key_path in path_by_file.items():
            # a name may be BATCH|FILE: CLIPS executes that file with `batch`
            yield stage, key_path, name.rpartition("|")[2]


def _make_missing_file_error(
    stage: str, file: str, reasons: Mapping[Path, str], value: ConfigValue, folders: Sequence[Path]
) -> ConfigError:
    """Return the error for a file of a spec that no folder has, or that cannot be read.

    :param reasons: why the file cannot be read, by path.
    """
    for path, reason in reasons.items():
        if reason != ABSENT:
            return value.error(f"{stage} loads {file}: {path} {reason}")
    names = {path.name for folder in folders for path in folder.glob("*.clp")}
    return value.error(f"{stage} loads {file}, which no folder has", did_you_mean(file, names) or None)


def _find_entries(config: Configuration, spec: str) -> Iterator[tuple[str, str]]:
    """Yield stage and path of each entry in a spec's initialisation."""
    for stage in STAGES:
        path = f"{_ROOT}/specs/{spec}/init/{stage}"
        for index in config.keys(path):
            yield stage, f"{path}/{index}"


def _check_stage(config: Configuration, base: str, stage: str) -> Iterator[str]:
    """Yield warnings about the entries of a stage.

    :param base: the path of the spec.
    :raises ConfigError: if there is no such stage; at the first entry or value that is wrong.
    """
    path = f"{base}/init/{stage}"
    if stage not in STAGES:
        raise _make_error(
            f"there is no '{stage}'",
            _find_first_value(config, path),
            f"the stages are {', '.join(STAGES)}",
        )
    _check_container(config, path, "a list of entries, each with a name")
    for index in config.keys(path):
        number = parse_decimal(index)
        if number is None:
            raise _make_error(
                f"{stage} must be a list of entries",
                _find_first_value(config, f"{path}/{index}"),
                "begin each with a dash: - name: ...",
            )
        yield from _check_entry(config, f"{path}/{index}", f"{stage}, entry {number + 1}")


def _check_entry(config: Configuration, path: str, entry: str) -> Iterator[str]:
    """Yield warnings about an entry of a stage.

    :param entry: the name of the entry in warnings, e.g. ``stage-1, entry 2``.
    :raises ConfigError: if the entry has no name, or a value of a wrong type.
    """
    keys = config.keys(path)
    if "name" not in keys:
        raise _make_error(f"{entry} has no name", _find_first_value(config, path), "give it one: - name: ...")
    for key in ("name", "file", "wait-for"):
        config.get_str(f"{path}/{key}", default="")
    config.get_bool(f"{path}/feature-request", default=False)
    if "files" in keys:
        if config.keys(f"{path}/files"):
            raise _make_error(
                f"the files of {entry} must be a list, not a map",
                _find_first_value(config, f"{path}/files"),
                "write [a.clp, b.clp]",
            )
        files = config.get(f"{path}/files")
        if not files.is_list or (files.items and files.type is not ConfigType.STRING):
            raise _make_error(
                f"the files of {entry} must be a list of file names", files, "write [a.clp, b.clp]"
            )
    for key in sorted(set(keys) - _ENTRY_KEYS):
        value = _find_first_value(config, f"{path}/{key}")
        location = f"{value.location}: " if value is not None and value.location else ""
        yield f"{location}'{key}' of {entry} is never read; known are {', '.join(sorted(_ENTRY_KEYS))}"


def _check_container(config: Configuration, path: str, shape: str) -> None:
    """Raise an error if a path has a value instead of a container. A missing value or an empty text is valid.

    :param shape: the expected map or list of maps, as text for the error.
    """
    # a path exists only if it has a value: a list of plain values, too, but not a map or a list of maps
    if config.exists(path) and (value := config.get(path)) and (value.is_list or value.text):
        raise _make_error(f"'{path.rpartition('/')[2]}' must be {shape}", value, None)


def _find_first_value(config: Configuration, path: str) -> ConfigValue | None:
    """Return the value of a path, or the first value below the path; None if there is none."""
    return (
        config.get(path) if config.exists(path) else min(config.search(path), key=_line_number, default=None)
    )


def _is_empty(value: ConfigValue) -> bool:
    return not value.is_list and not value.text


def _line_number(value: ConfigValue) -> int:
    return value.line


def _make_error(message: str, value: ConfigValue | None, hint: str | None) -> ConfigError:
    """Return an error at the place of a value; without a place if the value is missing."""
    return ConfigError(message, hint=hint) if value is None else value.error(message, hint)


def init_mentions(config: Configuration, spec: str, *names: str) -> bool:
    """Return whether a value of the initialisation, e.g. a feature or a file, contains one of the names."""
    values = config.search(f"{_ROOT}/specs/{spec}/init/")
    return any(name in text for value in values for text in (value.text, *value.items) for name in names)
