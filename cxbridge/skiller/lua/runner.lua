-- The functions that the host calls. Each call that may run code of skills has a budget, so that a skill cannot block
-- the main loop. The calls return plain values: the host never gets a function or a table of skills.

local core = ...
local budget = core.include("budget")
local modules, skillenv = core.include("modules"), core.include("skillenv")
local interfaces, graph = core.include("interfaces"), core.include("graph")
local predlib, new_sandbox = core.include("predlib"), core.include("sandbox")

-- Copies, because skills may replace functions in the library's tables.
local library = {}
for name, value in pairs(skillenv) do library[name] = value end
local read_all, write_changed, reset_predicates = interfaces.read_all, interfaces.write_changed, predlib.reset
local preloop, loop = skillenv.callbacks.preloop, skillenv.callbacks.loop
local draw_dependencies = graph.dependencies

local runner = {}
-- The function that executes the skill string once; nil without a skill string
local chunk
local S_FAILED = core.include("status").S_FAILED

local PLAIN = {boolean = true, number = true, string = true}

local function plain(value, default)
    if PLAIN[type(value)] then return value end
    return default
end

--- Make a function for the host that returns true, or false and an error.
local function attempt(name, fn)
    runner[name] = function(...)
        local ok, problem = budget.run(fn, ...)
        return ok, ok and "" or problem
    end
end

--- Make a function for the host that returns a value, or a default for an error and for a value of another type.
local function question(name, default, fn)
    runner[name] = function(...)
        local ok, value = budget.run(fn, ...)
        if ok and type(value) == type(default) then return value end
        return default
    end
end

--- Load a skill space.
-- @return true, or false and the error
function runner.load(space)
    modules.set_global("SKILLSPACE", space)
    local ok, problem = budget.run_to_load(modules.require, "skills." .. space)
    return ok, ok and "" or problem
end

--- Set the calls of skills for each loop: a list of {name=, count=number of arguments, arguments...}.
-- @return true, or false and the number of the first call of a missing skill
function runner.prepare(calls)
    chunk = nil
    for i, call in ipairs(calls) do
        if not library.has_skill(call.name) then return false, i end
    end
    local run_calls = library.run_calls
    chunk = function() run_calls(calls) end
    return true, 0
end

--- Compile a skill string as Lua, for a new sandbox.
-- @return true, or false and the error
function runner.compile(text)
    chunk = nil
    if core.native.string.sub(text, 1, 1) == "\27" then return false, "precompiled Lua is not accepted" end
    local compiled, problem = core.loadstring(text)
    if not compiled then return false, problem end
    local ok, sandbox = budget.run(new_sandbox)
    if not ok then return false, sandbox end
    chunk = core.setfenv(compiled, sandbox)
    return true, ""
end

function runner.drop() chunk = nil end

local function run_chunk()
    library.reset_status()
    read_all()
    reset_predicates()
    library.run_callbacks("preloop")
    if chunk then chunk() end
    return library.get_overall_status()
end

local function status_now()
    local ok, status = budget.run(library.get_overall_status)
    return ok and plain(status, S_FAILED) or S_FAILED
end

--- Run the skill string once.
-- @return whether the skill string ran without error, the error, and the overall status
function runner.run()
    budget.renew()
    local ok, result = budget.run(run_chunk)
    if ok then return true, "", plain(result, S_FAILED) end
    return false, result, status_now()
end

--- Reset the skills that were called.
attempt("reset_all", library.reset_all)

--- Return the reason of a failed skill string. First the error in the init of a start state: such a state loops
-- nevertheless, as in Fawkes, and its loop raises another error as a consequence. Then the error text of the first
-- called skill of the last loop, then that of the first failed skill, or the label of its last transition.
question("failure", "", function()
    local called = library.get_skill_fsm((library.get_active_skills()))
    local error = called and called.error
    local name = library.get_failed_skills()
    local failed = name and library.get_skill_fsm(name)
    for _, text in ipairs({failed and failed.init_problem or "", error or "", failed and failed.error or ""}) do
        if type(text) == "string" and text ~= "" then return text end
    end
    local last = failed and failed.previous and failed.previous:last_transition()
    return last and last.description
end)

--- Draw the state machine of a skill, or of the first called skill.
-- @param always whether to draw an unchanged machine
-- @return whether the machine exists, and its graph ("" if unchanged)
local function draw(name, direction, coloured, always)
    if name == "" then name = library.get_active_skills() end
    local fsm = library.get_skill_fsm(name)
    if not fsm then return false, "" end
    local changed = fsm:changed()
    if not changed and not always then return true, "" end
    graph.direction, graph.coloured = direction, coloured
    return true, fsm:graph()
end

function runner.graph(name, direction, coloured, always)
    local ok, exists, text = budget.run(draw, name, direction, coloured, always)
    -- a machine whose drawing fails exists, too: the host must not report it as missing
    return not ok or exists == true, ok and type(text) == "string" and text or ""
end

question("dependencies", "", function() return draw_dependencies(library.modules()) end)

--- End a loop: publish the interfaces that the skills have written.
attempt("finish_loop", function()
    library.run_callbacks("loop")
    write_changed()
end)

--- Whether loops without a skill string have work to do.
function runner.has_callbacks()
    return next(preloop) ~= nil or next(loop) ~= nil
end

--- Begin a loop without a skill string.
function runner.run_preloop_callbacks()
    budget.renew()
    local ok, problem = budget.run(library.run_callbacks, "preloop")
    return ok, ok and "" or problem
end

question("names", "", function() return table.concat(library.names(), "\n") end)

--- The documentation of a skill; "" if the skill does not exist.
question("documentation", "", function(name)
    local module = library.get_skill_module(name)
    return module and module.documentation
end)

attempt("finalize", function() library.run_callbacks("finalize") end)

return runner
