"""The plug-in ``cx::AmentIndexPlugin``: functions about installed ROS packages and their resources.

The index of ament, the build system of ROS 2, lists packages, and resources by kind and name.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cxbridge.executive.host.values import FALSE, TRUE, Value
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_FUNCTION_PREFIX = "ament-index-"


class AmentIndexPlugin(CxPlugin):
    """Defines the functions ``ament-index-...``, which log an error and return FALSE if a lookup fails."""

    def init_context(self, env: ClipsEnvironment) -> None:
        # types are the codes of CLIPS' AddUDF: any result (*), SYMBOLs or STRINGs as arguments (sy)
        for name, function, count, types in (
            ("get-package-prefix", self._get_package_prefix, 1, "*;sy"),
            ("get-package-share-directory", self._get_package_share, 1, "*;sy"),
            ("get-packages-with-prefixes", self._get_packages, 0, "*"),
            ("get-resource", self._get_resource, 2, "*;sy;sy"),
            ("get-resources", self._get_resources, 1, "*;sy"),
            ("get-search-paths", self._get_search_paths, 0, "*"),
            ("has-resource", self._has_resource, 2, "*;sy;sy"),
        ):
            env.define(f"{_FUNCTION_PREFIX}{name}", self._wrap_function(name, function), count, types=types)

    def _wrap_function(self, name: str, function: Callable[..., Value]) -> Callable[..., Value]:
        """Return a function that logs a failed lookup and then returns FALSE."""

        def call(*arguments: str) -> Value:
            try:
                return function(*map(_check_argument, arguments))
            except LookupError as error:
                self.log.error(f"{_FUNCTION_PREFIX}{name}: {error.args[0]}")
                return FALSE

        return call

    def _get_package_prefix(self, package: str) -> Value:
        prefix = self.context.packages.prefix_by_package.get(package)
        if prefix is None:
            raise LookupError(
                f"package '{package}' not found, searching: [{', '.join(self._get_search_paths())}]"
            )
        return str(prefix.path)

    def _get_package_share(self, package: str) -> Value:
        self._get_package_prefix(package)  # raises LookupError for an unknown package
        return str(self.context.packages.find_share_folder(package))

    def _get_packages(self) -> Value:
        prefixes = self.context.packages.prefix_by_package.items()
        return tuple(item for name, prefix in prefixes for item in (name, str(prefix.path)))

    def _get_resource(self, kind: str, name: str) -> Value:
        resource = self.context.packages.find_resources(kind).get(name)
        if resource is None:
            return FALSE
        content, prefix = resource
        return content, str(prefix.path)

    def _get_resources(self, kind: str) -> Value:
        resources = self.context.packages.find_resources(kind).items()
        return tuple(item for name, (_, prefix) in resources for item in (name, str(prefix.path)))

    def _get_search_paths(self) -> tuple[str, ...]:
        return tuple(str(prefix.path) for prefix in self.context.packages.prefixes)

    def _has_resource(self, kind: str, name: str) -> Value:
        return TRUE if name in self.context.packages.find_resources(kind) else FALSE

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self.log.info(f"Destroying plugin for environment {env.name}")


def _check_argument(argument: str) -> str:
    if not argument:
        raise LookupError("an argument is empty")
    return argument
