"""Chooses the spec of the configuration that is run, and checks that the executive can read it.

Fawkes finds out while the rules initialise the executive, or never: a stage that is not a list is not a
stage, and the agent waits forever. Here a wrong type is an error with its place before anything runs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from cxbridge.config import ConfigType, Configuration, ConfigValue
from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean

STAGES = ("stage-1", "stage-2", "stage-3")
_ENTRY_KEYS = {"name", "feature-request", "file", "files", "wait-for"}
_BOOLS = (
    "assert-time-each-loop",
    "automatic-goal-retraction",
    "request-redefine-warning-feature",
    "steal-skiller-control",
    "debug/enable",
)
_LISTS = ("clips-dirs", "debug/unwatch-facts", "debug/unwatch-rules")
_ROOT = "/clips-executive"


def choose_spec(config: Configuration, spec: str | None) -> str:
    """Return the spec to run, and see to it that the configuration names it.

    :raises ConfigError: when the configuration has no such spec.
    """
    place = _first(config, f"{_ROOT}/spec") if spec is None else None
    if spec is not None:
        config.set(f"{_ROOT}/spec", spec)
    chosen = config.get_str(f"{_ROOT}/spec", default="")
    specs = sorted(config.keys(f"{_ROOT}/specs"))
    if chosen and chosen in specs:
        return chosen
    known = f"it has: {', '.join(specs)}" if specs else "it has no clips-executive/specs at all"
    what = f"has no spec '{chosen}'" if chosen else "names no spec (clips-executive/spec)"
    if place is None and (anything := _first(config, _ROOT)) is not None:
        raise ConfigError(f"the configuration {what}", file=anything.file or None, hint=known)
    raise _error(f"the configuration {what}", place, known)


def check_spec(config: Configuration, spec: str) -> list[str]:
    """Check the parts of the configuration that the executive reads for a spec.

    :returns: what is strange, but no error: keys that nobody reads.
    :raises ConfigError: at the first value of a wrong type, with file and line.
    """
    base = f"{_ROOT}/specs/{spec}"
    for key in _BOOLS:
        config.get_bool(f"{_ROOT}/{key}", default=False)
    for key in _LISTS:
        config.get_strings(f"{_ROOT}/{key}", default=[])
    config.get_uint(f"{_ROOT}/debug/level", default=0)
    config.get_str("/skiller/skillspace", default="")
    config.get_strings(f"{base}/blackboard-preload", default=[])
    for path, what in (
        (f"{_ROOT}/debug", "a map"),
        (f"{base}/init", "a map of stages"),
        (f"{base}/action-mapping", "a map from actions to skill strings"),
        (f"{base}/parameters", "a map"),
    ):
        _must_have_parts(config, path, what)
    return [warning for stage in config.keys(f"{base}/init") for warning in _check_stage(config, base, stage)]


def check_features(config: Configuration, spec: str, available: Collection[str]) -> None:
    """See to it that the features that a spec asks for can be had.

    The rules would find out, too, but cannot say where they are asked for; those of the original for ROS 2
    trip over their own error, and wait forever.

    :raises ConfigError: for the first that cannot be had, with file and line.
    """
    for stage, path in _entries(config, spec):
        name = config.get_str(f"{path}/name", default="")
        asks = config.get_bool(f"{path}/feature-request", default=stage == STAGES[0])
        if asks and name not in available:
            raise _error(
                f"{stage} asks for the feature '{name}', which is not available",
                config.get(f"{path}/name"),
                f"there are: {', '.join(sorted(available))}; an entry that just loads files says "
                "feature-request: false",
            )


def check_files(config: Configuration, spec: str, folders: Sequence[Path]) -> list[ConfigError]:
    """Return what a spec wants to load that is not there, with file and line.

    :param folders: where CLIPS files are searched for.
    """
    missing = []
    for stage, path in _entries(config, spec):
        names = config.get_strings(f"{path}/files", default=[])
        if one := config.get_str(f"{path}/file", default=""):
            names = [one, *names]
        for name in names:
            file = name.rpartition("|")[2]  # BATCH|FILE
            if not any((folder / file).is_file() for folder in folders):
                place = config.get(path + ("/file" if name == one else "/files"))
                missing.append(
                    _error(f"{stage} loads {file}, which no folder has", place, _meant(file, folders))
                )
    return missing


def _meant(file: str, folders: Sequence[Path]) -> str | None:
    """Return which file was probably meant."""
    return did_you_mean(file, {path.name for folder in folders for path in folder.glob("*.clp")}) or None


def _entries(config: Configuration, spec: str) -> Iterator[tuple[str, str]]:
    """Yield the entries of a spec's initialisation: stage and path."""
    for stage in STAGES:
        path = f"{_ROOT}/specs/{spec}/init/{stage}"
        for index in config.keys(path):
            yield stage, f"{path}/{index}"


def _check_stage(config: Configuration, base: str, stage: str) -> Iterator[str]:
    path = f"{base}/init/{stage}"
    if stage not in STAGES:
        raise _error(f"there is no '{stage}'", _first(config, path), f"the stages are {', '.join(STAGES)}")
    _must_have_parts(config, path, "a list of entries, each with a name")
    for index in config.keys(path):
        if not index.isdigit():
            hint = "begin each with a dash: - name: ..."
            raise _error(f"{stage} is a list of entries", _first(config, f"{path}/{index}"), hint)
        yield from _check_entry(config, f"{path}/{index}", f"{stage}, entry {int(index) + 1}")


def _check_entry(config: Configuration, path: str, where: str) -> Iterator[str]:
    keys = config.keys(path)
    place = _first(config, path)
    if "name" not in keys:
        raise _error(f"{where} has no name", place, "give it one: - name: ...")
    for key in ("name", "file", "wait-for"):
        config.get_str(f"{path}/{key}", default="")
    config.get_bool(f"{path}/feature-request", default=False)
    if "files" in keys:
        if config.keys(f"{path}/files"):
            raise _error(
                f"the files of {where} are a map", _first(config, f"{path}/files"), "write [a.clp, b.clp]"
            )
        files = config.get(f"{path}/files")
        if not files.is_list or (files.items and files.type is not ConfigType.STRING):
            raise _error(f"the files of {where} are not a list of file names", files, "write [a.clp, b.clp]")
    for key in sorted(set(keys) - _ENTRY_KEYS):
        known = ", ".join(sorted(_ENTRY_KEYS))
        yield f"{_at(config, f'{path}/{key}')}nobody reads '{key}' of {where}; known are {known}"
    if not where.startswith(STAGES[0]) and not _ENTRY_KEYS.intersection(keys) - {"name"}:
        yield f"{_at(config, path)}{where} does nothing: it names no file"


def _must_have_parts(config: Configuration, path: str, what: str) -> None:
    """Raise when there is a value where a map or a list of maps belongs; nothing at all is fine."""
    if config.exists(path) and (value := config.get(path)) and (value.is_list or value.text):
        name = path.rsplit("/", 1)[1]
        raise _error(f"'{name}' must be {what}", value, None)


def _first(config: Configuration, path: str) -> ConfigValue | None:
    """Return the value at the path, or the first below it: its place is where to look."""
    return config.get(path) if config.exists(path) else next(config.search(path), None)


def _at(config: Configuration, path: str) -> str:
    """Return ``FILE:LINE: `` of what is at the path, or first below it; empty when it was set at run time."""
    place = _first(config, path)
    return f"{place.file}:{place.line}: " if place is not None and place.file else ""


def _error(message: str, place: ConfigValue | None, hint: str | None) -> ConfigError:
    if place is None or not place.file:
        return ConfigError(message, hint=hint)
    return ConfigError(message, file=place.file, line=place.line, hint=hint)
