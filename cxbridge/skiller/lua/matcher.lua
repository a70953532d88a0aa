-- Lua 5.1's patterns, matched in Lua: slower than the C functions, but each step counts as instructions, so that a
-- pattern made to run for hours is stopped like any other endless loop. Results and errors are those of C.

local core = ...
local native = core.native.string
local byte, char, sub = native.byte, native.char, native.sub

local matcher = {}

local MAX_CAPTURES = 32
local UNFINISHED, POSITION = -1, -2

-- Patterns as lists of items

local function class_end(pattern, at)
    local first = sub(pattern, at, at)
    if first == "%" then
        if at == #pattern then return nil, "malformed pattern (ends with '%')" end
        return at + 1
    elseif first == "[" then
        local i = at + 1
        if sub(pattern, i, i) == "^" then i = i + 1 end
        repeat
            if i > #pattern then return nil, "malformed pattern (missing ']')" end
            i = i + (sub(pattern, i, i) == "%" and 2 or 1)
        until sub(pattern, i, i) == "]"
        return i
    end
    return at
end

local sets = {}

--- Which bytes a class stands for.
local function set_of(class)
    if not sets[class] then
        local set = {}
        for code = 0, 255 do set[code] = native.find(char(code), "^" .. class) ~= nil end
        sets[class] = set
    end
    return sets[class]
end

local QUANTIFIERS = {["*"] = true, ["+"] = true, ["-"] = true, ["?"] = true}

local function parse_single(pattern, at)
    local last, problem = class_end(pattern, at)
    if not last then return {kind = "error", message = problem}, #pattern + 1 end
    local class = sub(pattern, at, last)
    -- A caret is an anchor only at the start of a pattern, a dollar only at its end.
    if class == "^" or class == "$" then class = "%" .. class end
    local quantifier = sub(pattern, last + 1, last + 1)
    if not QUANTIFIERS[quantifier] then quantifier = "" end
    return {kind = "single", class = class, quantifier = quantifier}, last + 1 + #quantifier
end

local function parse_escape(pattern, at)
    local letter = sub(pattern, at + 1, at + 1)
    if letter == "b" then
        if at + 3 > #pattern then return {kind = "error", message = "unbalanced pattern"}, #pattern + 1 end
        return {kind = "balance", open = byte(pattern, at + 2), close = byte(pattern, at + 3)}, at + 4
    elseif letter == "f" then
        if sub(pattern, at + 2, at + 2) ~= "[" then
            return {kind = "error", message = "missing '[' after '%f' in pattern"}, #pattern + 1
        end
        local last, problem = class_end(pattern, at + 2)
        if not last then return {kind = "error", message = problem}, #pattern + 1 end
        return {kind = "frontier", class = sub(pattern, at + 2, last)}, last + 1
    elseif native.find(letter, "^%d") then
        return {kind = "back", index = letter + 0}, at + 2
    end
    return parse_single(pattern, at)
end

local function parse_item(pattern, at)
    local first = sub(pattern, at, at)
    if first == "(" and sub(pattern, at + 1, at + 1) == ")" then return {kind = "position"}, at + 2 end
    if first == "(" then return {kind = "open"}, at + 1 end
    if first == ")" then return {kind = "close"}, at + 1 end
    if first == "$" and at == #pattern then return {kind = "end"}, at + 1 end
    if first == "%" then return parse_escape(pattern, at) end
    return parse_single(pattern, at)
end

--- The items of a pattern from a position on.
function matcher.parse(pattern, at)
    local items = {}
    while at <= #pattern do
        items[#items + 1], at = parse_item(pattern, at)
    end
    return items
end

local function compile(pattern, at)
    local items = matcher.parse(pattern, at)
    for _, item in ipairs(items) do item.set = item.class and set_of(item.class) end
    return items
end

-- Matching: functions of the state and the position in the subject, which give the position after the match or nil

local run

local function match_quantified(state, s, i, item)
    local subject, set, quantifier = state.subject, item.set, item.quantifier
    if quantifier == "-" then
        while true do
            local e = run(state, s, i + 1)
            if e then return e end
            if not set[byte(subject, s)] then return nil end
            s = s + 1
        end
    end
    local least = quantifier == "+" and 1 or 0
    local most = 0
    while set[byte(subject, s + most)] and (quantifier ~= "?" or most == 0) do most = most + 1 end
    for count = most, least, -1 do
        local e = run(state, s + count, i + 1)
        if e then return e end
    end
end

local function start_capture(state, s, i, length)
    local level = state.level + 1
    if level > MAX_CAPTURES then error("too many captures", 0) end
    state[level], state.level = {start = s, length = length}, level
    local e = run(state, s, i + 1)
    if not e then state.level = level - 1 end
    return e
end

local function end_capture(state, s, i)
    for level = state.level, 1, -1 do
        local capture = state[level]
        if capture.length == UNFINISHED then
            capture.length = s - capture.start
            local e = run(state, s, i + 1)
            if not e then capture.length = UNFINISHED end
            return e
        end
    end
    error("invalid pattern capture", 0)
end

local function match_balance(state, s, item)
    local subject, depth = state.subject, 1
    if byte(subject, s) ~= item.open then return nil end
    for at = s + 1, #subject do
        local code = byte(subject, at)
        if code == item.close then
            depth = depth - 1
            if depth == 0 then return at + 1 end
        elseif code == item.open then
            depth = depth + 1
        end
    end
end

local function match_back(state, s, item)
    local capture = state[item.index]
    if item.index == 0 or item.index > state.level or capture.length == UNFINISHED then
        error("invalid capture index", 0)
    end
    -- A capture of a position has no text; what C does then is to compare nothing that could be there.
    if capture.length == POSITION then return nil end
    local text = sub(state.subject, capture.start, capture.start + capture.length - 1)
    if sub(state.subject, s, s + #text - 1) == text then return s + #text end
end

function run(state, s, i)
    local subject, items = state.subject, state.items
    while true do
        local item = items[i]
        if not item then return s end
        local kind = item.kind
        if kind == "single" then
            if item.quantifier ~= "" then return match_quantified(state, s, i, item) end
            if not item.set[byte(subject, s)] then return nil end
            s = s + 1
        elseif kind == "open" then
            return start_capture(state, s, i, UNFINISHED)
        elseif kind == "position" then
            return start_capture(state, s, i, POSITION)
        elseif kind == "close" then
            return end_capture(state, s, i)
        elseif kind == "end" then
            return s == #subject + 1 and s or nil
        elseif kind == "frontier" then
            if item.set[byte(subject, s - 1) or 0] or not item.set[byte(subject, s) or 0] then return nil end
        elseif kind == "error" then
            error(item.message, 0)
        else
            s = (kind == "balance" and match_balance or match_back)(state, s, item)
            if not s then return nil end
        end
        i = i + 1
    end
end

local function match_at(state, s)
    state.level = 0
    return run(state, s, 1)
end

local function capture_value(state, i, s, e)
    if i > state.level then
        if i == 1 then return sub(state.subject, s, e - 1) end
        error("invalid capture index", 0)
    end
    local capture = state[i]
    if capture.length == POSITION then return capture.start end
    if capture.length == UNFINISHED then error("unfinished capture", 0) end
    return sub(state.subject, capture.start, capture.start + capture.length - 1)
end

--- The captures of a match, or the whole of it when there are none.
local function captures(state, s, e)
    local list = {}
    for i = 1, math.max(state.level, 1) do list[i] = capture_value(state, i, s, e) end
    return list
end

-- The four functions; subject and pattern are strings, init is within the subject or one beyond

local function new_state(subject, pattern)
    local anchored = sub(pattern, 1, 1) == "^"
    return {subject = subject, items = compile(pattern, anchored and 2 or 1), level = 0}, anchored
end

local function first_match(subject, pattern, init)
    local state, anchored = new_state(subject, pattern)
    for s = init, anchored and init or #subject + 1 do
        local e = match_at(state, s)
        if e then return state, s, e end
    end
end

--- Whether a pattern is just a text to look for, which is how string.find takes it.
function matcher.is_plain(pattern) return not native.find(pattern, "[%^%$%*%+%?%.%(%[%%%-]") end

function matcher.find(subject, pattern, init)
    if matcher.is_plain(pattern) then return native.find(subject, pattern, init, true) end
    local state, s, e = first_match(subject, pattern, init)
    if not state then return nil end
    if state.level == 0 then return s, e - 1 end
    return s, e - 1, unpack(captures(state, s, e))
end

function matcher.match(subject, pattern, init)
    local state, s, e = first_match(subject, pattern, init)
    if not state then return nil end
    return unpack(captures(state, s, e))
end

function matcher.gmatch(subject, pattern)
    local state, at = {subject = subject, items = compile(pattern, 1), level = 0}, 1
    return function()
        for s = at, #subject + 1 do
            local e = match_at(state, s)
            if e then
                at = e > s and e or e + 1
                return unpack(captures(state, s, e))
            end
        end
    end
end

local function expand(state, s, e, replacement)
    return (native.gsub(replacement, "%%(.?)", function(letter)
        if letter == "0" then return sub(state.subject, s, e - 1) end
        if native.find(letter, "^%d") then return tostring(capture_value(state, letter + 0, s, e)) end
        return letter
    end))
end

local function replace(state, s, e, replacement)
    local value
    if type(replacement) == "function" then
        value = replacement(unpack(captures(state, s, e)))
    elseif type(replacement) == "table" then
        value = replacement[capture_value(state, 1, s, e)]
    else
        return expand(state, s, e, replacement)
    end
    if not value then return sub(state.subject, s, e - 1) end
    if type(value) ~= "string" and type(value) ~= "number" then
        error("invalid replacement value (a " .. type(value) .. ")", 0)
    end
    return value
end

function matcher.gsub(subject, pattern, replacement, most)
    local state, anchored = new_state(subject, pattern)
    local parts, count, s = {}, 0, 1
    while count < most do
        local e = match_at(state, s)
        if e then
            count = count + 1
            parts[#parts + 1] = replace(state, s, e, replacement)
        end
        if e and e > s then
            s = e
        elseif s <= #subject then
            parts[#parts + 1] = sub(subject, s, s)
            s = s + 1
        else
            break
        end
        if anchored then break end
    end
    parts[#parts + 1] = sub(subject, s)
    return table.concat(parts), count
end

return matcher
