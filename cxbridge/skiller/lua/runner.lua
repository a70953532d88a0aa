-- What the host calls. Every call has its own budget, so that nothing in a skill can hold up the main loop.

local core = ...
local budget, limits = core.include("budget"), core.limits
local modules, skillenv = core.include("modules"), core.include("skillenv")
local interfaces, graph = core.include("interfaces"), core.include("graph")
local predlib = core.include("predlib")

local runner = {}
local chunk

local function bounded(fn)
    local ok, result = budget.run(limits.instructions_per_loop, limits.seconds_per_loop, fn)
    -- The garbage of a memory bomb must not starve whoever comes next.
    if not ok then core.collectgarbage() end
    return ok, result
end

--- Load a skill space.
-- @return true, or false and what is wrong
function runner.load(space)
    modules.set_global("SKILLSPACE", space)
    return budget.run(limits.instructions_to_load, limits.seconds_to_load,
                      function() modules.require("skills." .. space) end)
end

--- Compile a skill string, to be run in a new sandbox.
-- @return true, or false and what is wrong
function runner.compile(text)
    if text:sub(1, 1) == "\27" then
        chunk = nil
        return false, "precompiled Lua is not accepted"
    end
    local problem
    chunk, problem = core.loadstring(text)
    if not chunk then return false, problem end
    core.setfenv(chunk, skillenv.gensandbox())
    return true
end

function runner.drop() chunk = nil end

--- Run the compiled skill string once.
-- @return whether it ran through, the error if not, and the overall status
function runner.run()
    skillenv.reset_status()
    local ok, problem = bounded(function()
        interfaces.read_all()
        predlib.reset()
        skillenv.run_callbacks("preloop")
        chunk()
    end)
    return ok, ok and "" or tostring(problem), skillenv.get_overall_status()
end

--- Reset the skills that were called.
function runner.reset_all()
    local ok, problem = bounded(skillenv.reset_all)
    return ok, ok and "" or tostring(problem)
end

function runner.overall_status() return skillenv.get_overall_status() end

--- The error text of the skill that was called first in the last loop.
function runner.first_error()
    local fsm = skillenv.get_skill_fsm((skillenv.get_active_skills()))
    return fsm and fsm.error or ""
end

--- Why the skill string failed, as far as a skill says so: of the first skill that did.
function runner.failure_text()
    local name = skillenv.get_failed_skills()
    local fsm = name and skillenv.get_skill_fsm(name)
    if not fsm then return "" end
    if (fsm.error or "") ~= "" then return fsm.error end
    local last = fsm.previous and fsm.previous:last_transition()
    return last and last.description or ""
end

--- Draw the state machine of a skill, or of the skill that was called first.
-- @param always draw also what did not change since the last time
-- @return whether there is such a machine, and its graph ("" when it did not change)
function runner.graph(name, direction, coloured, always)
    if name == "" then name = skillenv.get_active_skills() end
    local fsm = skillenv.get_skill_fsm(name)
    if not fsm then return false, "" end
    local changed = fsm:changed()
    if not changed and not always then return true, "" end
    graph.direction, graph.coloured = direction, coloured
    local ok, text = bounded(function() return fsm:graph() end)
    return true, ok and text or ""
end

function runner.dependencies() return graph.dependencies(skillenv.modules()) end

--- End a loop: publish what the skills wrote.
function runner.finish_loop()
    local ok, problem = bounded(function()
        skillenv.run_callbacks("loop")
        interfaces.write_changed()
    end)
    return ok, ok and "" or tostring(problem)
end

--- Whether there is work to do in loops without a skill string.
function runner.has_callbacks()
    return next(skillenv.callbacks.preloop) ~= nil or next(skillenv.callbacks.loop) ~= nil
end

function runner.run_preloop_callbacks()
    local ok, problem = bounded(function() skillenv.run_callbacks("preloop") end)
    return ok, ok and "" or tostring(problem)
end

function runner.names() return table.concat(skillenv.names(), "\n") end

--- The documentation of a skill, nil when there is none of this name.
function runner.documentation(name)
    local module = skillenv.get_skill_module(name)
    return module and module.documentation
end

function runner.finalize() return bounded(function() skillenv.run_callbacks("finalize") end) end

return runner
