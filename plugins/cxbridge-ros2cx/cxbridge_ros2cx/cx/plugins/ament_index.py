"""``cx::AmentIndexPlugin``: the installed packages and their resources."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cxbridge.executive.host.values import FALSE, TRUE, Value
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_PREFIX = "ament-index-"


class AmentIndexPlugin(CxPlugin):
    """Defines the functions ``ament-index-...``; errors are logged, and the function returns FALSE."""

    def init_context(self, env: ClipsEnvironment) -> None:
        # types are codes of CLIPS' AddUDF: any result (*), SYMBOLs or STRINGs as arguments (sy)
        for name, function, count, types in (
            ("get-package-prefix", self._package_prefix, 1, "*;sy"),
            ("get-package-share-directory", self._package_share, 1, "*;sy"),
            ("get-packages-with-prefixes", self._packages, 0, "*"),
            ("get-resource", self._resource, 2, "*;sy;sy"),
            ("get-resources", self._resources, 1, "*;sy"),
            ("get-search-paths", self._search_paths, 0, "*"),
            ("has-resource", self._has_resource, 2, "*;sy;sy"),
        ):
            env.define(f"{_PREFIX}{name}", self._with_logged_errors(name, function), count, types=types)

    def _with_logged_errors(self, name: str, function: Callable[..., Value]) -> Callable[..., Value]:
        """Return a function that logs errors and then returns FALSE."""

        def call(*arguments: str) -> Value:
            try:
                return function(*map(_require_text, arguments))
            except LookupError as error:
                self.log.error(f"{_PREFIX}{name}: {error.args[0]}")
                return FALSE

        return call

    def _package_prefix(self, package: str) -> Value:
        prefix = self.context.packages.prefix_of.get(package)
        if prefix is None:
            raise LookupError(
                f"package '{package}' not found, searching: [{', '.join(self._search_paths())}]"
            )
        return str(prefix.path)

    def _package_share(self, package: str) -> Value:
        self._package_prefix(package)  # it raises the error about an unknown package
        return str(self.context.packages.share(package))

    def _packages(self) -> Value:
        prefixes = self.context.packages.prefix_of.items()
        return tuple(text for name, prefix in prefixes for text in (name, str(prefix.path)))

    def _resource(self, kind: str, name: str) -> Value:
        resource = self.context.packages.resources(kind).get(name)
        if resource is None:
            return FALSE
        content, prefix = resource
        return content, str(prefix.path)

    def _resources(self, kind: str) -> Value:
        resources = self.context.packages.resources(kind).items()
        return tuple(text for name, (_, prefix) in resources for text in (name, str(prefix.path)))

    def _search_paths(self) -> tuple[str, ...]:
        return tuple(str(prefix.path) for prefix in self.context.packages.prefixes)

    def _has_resource(self, kind: str, name: str) -> Value:
        return TRUE if name in self.context.packages.resources(kind) else FALSE

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self.log.info(f"Destroying plugin for environment {env.name}")


def _require_text(argument: str) -> str:
    if not argument:
        raise LookupError("an argument is empty")
    return argument
