"""Fawkes' own Lua files in a bare Lua 5.1, an oracle for the drawings of skills (needs FAWKES_DIR)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

# The parts of Fawkes' C++ side that machines without interfaces need.
_WORLD = """
local lua_dir, skill_file = ...
package.path = lua_dir .. "/?.lua;" .. lua_dir .. "/?/init.lua"
local function nothing() end
logger = setmetatable({}, {__index = function() return nothing end})
config, clock, blackboard, SKILLSPACE, features_env_template = {}, {}, {}, "x", {}
fawkes = fawkes or {}
local now = setmetatable({in_msec = function() return 0 end}, {__sub = function() return 0 end})
fawkes.Time, fawkes.Clock = {new = function() return now end}, {}
require("fawkes.modinit")
require("fawkes.logprint")
fawkes.logprint.init(logger)
require("fawkes.stringext")
require("fawkes.tableext")
skillenv = require("skiller.skillenv")
local grapher = require("fawkes.fsm.grapher")

local oracle = {}
function oracle.use(name, file)
    package.preload[name] = assert(loadfile(file))
    skillenv.use_skill(name)
end
function oracle.call(text)
    local chunk = assert(loadstring(text))
    setfenv(chunk, skillenv.gensandbox())
    skillenv.reset_status()
    chunk()
end
function oracle.graph(name, direction, coloured)
    grapher.set_rankdir(direction)
    grapher.set_colored(coloured)
    return skillenv.get_skill_fsm(name):graph()
end
function oracle.dependencies()
    local shown = {}
    skillenv.write_skiller_debug({
        graph_fsm = function() return "" end, set_graph_fsm = nothing, write = nothing,
        set_graph = function(_, text) shown.text = text end,
    }, nil, "SKILL_DEP")
    return shown.text
end
return oracle
"""


class FawkesLua:
    """Skills in Fawkes' own skill environment.

    :param fawkes_dir: a Fawkes checkout.
    """

    def __init__(self, fawkes_dir: Path) -> None:
        from lupa.lua51 import LuaRuntime

        self._lua: Any = LuaRuntime(encoding="latin-1")
        self._oracle = self._lua.execute(_WORLD, str(fawkes_dir / "src" / "lua"))

    def use(self, module: str, file: Path) -> None:
        """Load a skill file."""
        self._oracle.use(module, str(file))

    def call(self, text: str) -> None:
        """Run a skill string once."""
        self._oracle.call(text)

    def graph(self, skill: str, direction: str = "TB", *, coloured: bool = True) -> str:
        """Return the graph of a skill's machine."""
        text: str = self._oracle.graph(skill, direction, coloured)
        return text

    def dependencies(self) -> str:
        """Return the graph of the dependencies between skills."""
        text: str = self._oracle.dependencies()
        return text
