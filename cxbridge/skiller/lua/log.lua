-- The print functions of skills, which write to the host's logger.

local core = ...
local send, charge = core.host.log, core.charge
local format = string.format

local log = {}

local function emit(level, text)
    charge(200) -- instructions of the budget: a rough price of formatting and storing the line
    send(level, text)
end

local function printer(level)
    return function(text, ...) emit(level, format(text, ...)) end
end

log.debug, log.info, log.warn, log.error = printer("debug"), printer("info"), printer("warn"), printer("error")

--- Print values, separated by commas, as print() of skill modules.
function log.values(...)
    local texts = {}
    for i = 1, select("#", ...) do texts[i] = tostring((select(i, ...))) end
    emit("info", table.concat(texts, ", "))
end

--- The object that Fawkes calls logger.
log.logger = {}
for _, level in ipairs {"debug", "info", "warn", "error"} do
    log.logger["log_" .. level] = function(_, text) emit(level, tostring(text)) end
end

--- Add the print functions to a module.
function log.register(module)
    module.print_debug, module.print_info = log.debug, log.info
    module.print_warn, module.print_error = log.warn, log.error
    module.print, module.printf = log.values, log.info
end

return log
