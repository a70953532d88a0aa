"""The plug-in ``cx::AmentIndexPlugin``: functions about installed ROS packages and their resources.

The index of ament, the build system of ROS 2, lists packages, and resources by kind and name.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE, Value
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def _refuse_empty(function: Callable[..., Value]) -> Callable[..., Value]:
    """Wrap a function for rules: the wrapper raises an error for an empty argument."""

    def call(*arguments: str) -> Value:
        if not all(arguments):
            raise ClipsError("an argument is empty")
        return function(*arguments)

    return call


class AmentIndexPlugin(CxPlugin):
    """Defines the functions ``ament-index-...``.

    For an empty argument or an unknown package, they log an error and return FALSE. For an unknown resource,
    ``ament-index-get-resource`` returns FALSE without an error, as in the ROS 2 CX.
    """

    def init_context(self, env: ClipsEnvironment) -> None:
        # types are the codes of CLIPS' AddUDF: any result (*), SYMBOLs or STRINGs as arguments (sy)
        for name, function, argument_count, types in (
            ("get-package-prefix", self._get_package_prefix, 1, "*;sy"),
            ("get-package-share-directory", self._get_package_share, 1, "*;sy"),
            ("get-packages-with-prefixes", self._get_packages, 0, "*"),
            ("get-resource", self._get_resource, 2, "*;sy;sy"),
            ("get-resources", self._get_resources, 1, "*;sy"),
            ("get-search-paths", self._get_search_paths, 0, "*"),
            ("has-resource", self._has_resource, 2, "*;sy;sy"),
        ):
            full_name = f"ament-index-{name}"
            env.define(
                full_name,
                self.with_false_on_error(_refuse_empty(function), f"{full_name}: "),
                argument_count,
                types=types,
            )

    def _get_package_prefix(self, package: str) -> Value:
        prefix = self.context.packages.prefix_by_package.get(package)
        if prefix is None:
            raise ClipsError(
                f"package '{package}' not found, searching: [{', '.join(self._get_search_paths())}]"
            )
        return str(prefix.path)

    def _get_package_share(self, package: str) -> Value:
        self._get_package_prefix(package)  # raises ClipsError for an unknown package
        return str(self.context.packages.find_share_folder(package))

    def _get_packages(self) -> Value:
        return self._get_resources("packages")

    def _get_resource(self, kind: str, name: str) -> Value:
        """Return the content and the prefix of a resource as a multifield; FALSE for an unknown resource."""
        resource = self.context.packages.find_resources(kind).get(name)
        if resource is None:
            return FALSE
        content, prefix = resource
        return content, str(prefix.path)

    def _get_resources(self, kind: str) -> Value:
        """Return a multifield in which names and prefixes alternate."""
        resources = self.context.packages.find_resources(kind).items()
        return tuple(item for name, (_, prefix) in resources for item in (name, str(prefix.path)))

    def _get_search_paths(self) -> tuple[str, ...]:
        return tuple(str(prefix.path) for prefix in self.context.packages.prefixes)

    def _has_resource(self, kind: str, name: str) -> Value:
        return TRUE if name in self.context.packages.find_resources(kind) else FALSE

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self.log.info(f"Destroying plugin for environment {env.name}")
