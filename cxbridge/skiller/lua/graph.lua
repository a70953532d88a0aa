-- State machines in the dot language, in the colours that Fawkes' viewers know.
-- Nodes come in the order of their names and attributes in theirs, so that equal machines give equal texts.

local core = ...

local graph = {direction = "TB", coloured = true}

local function quote(text)
    -- \n in labels is dot's, so backslashes stay
    return '"' .. tostring(text):gsub('"', '\\"'):gsub("\n", "\\n") .. '"'
end

local function node_name(name) return name:match("^[%w_]+$") and name or quote(name) end

local function attributes(attr)
    local names = {}
    for name in pairs(attr) do table.insert(names, name) end
    if #names == 0 then return "" end
    table.sort(names)
    for i, name in ipairs(names) do
        names[i] = attr[name] == "" and name or name .. "=" .. quote(attr[name])
    end
    return " [" .. table.concat(names, ", ") .. "]"
end

local function merge(into, from)
    for name, value in pairs(from or {}) do into[name] = value end
    return into
end

-- What a state looks like

local function border(fsm, name)
    if name == fsm.exit_state then return "#6fdd6f" end
    if name == fsm.fail_state or name == fsm.recover_state then return "#ff8080" end
end

local function filling(fsm, name)
    return name == fsm.exit_state and "#ccffcc" or name == fsm.fail_state and "#ffcccc" or
               name == fsm.recover_state and "#ffff88" or "#ffc080"
end

local function mark_progress(fsm, state, attr)
    if fsm.current == state then
        attr.active = "true"
        if graph.coloured then attr.fillcolor = filling(fsm, state.name) else attr.style = "dotted" end
    elseif state.name ~= fsm.start and fsm:traced_state(state) then
        if graph.coloured then attr.color = "#ff8000" else attr.style = "dashed,rounded" end
    end
end

local function describe_state(fsm, state)
    local attr = {}
    local name = state.name
    if name == fsm.start then
        attr.penwidth = "4.0"
        if graph.coloured then attr.color = "#ffc080" end
    elseif border(fsm, name) then
        merge(attr, {shape = "doubleoctagon", style = "solid,filled", penwidth = "1.0"})
    end
    mark_progress(fsm, state, attr)
    if graph.coloured and name ~= fsm.start then attr.color = border(fsm, name) or attr.color end
    merge(attr, state.dotattr)
    if attr.comment then attr.label = (attr.label or name) .. "\\n(" .. attr.comment .. ")" end
    return attr
end

local function describe_transition(fsm, state, transition)
    local attr = merge({label = transition.description}, transition.dotattr)
    if transition.state.name == fsm.fail_state and graph.coloured then attr.style = "dotted" end
    if state.name == fsm.exit_state or state.name == fsm.fail_state then
        attr.style = "dashed"
        if graph.coloured then attr.color = "red3" end
    end
    local taken, entries = fsm:traced_trans(transition)
    if taken then
        local numbers = {}
        for i in pairs(entries) do table.insert(numbers, i) end
        table.sort(numbers)
        attr.taillabel = table.concat(numbers, ",")
        merge(attr, graph.coloured and {color = "#ff8000", labelfontcolor = "#ff8000"} or {style = "dashed"})
    end
    return attr
end

-- The start state first, which is what puts it on top; then by name.
local function shown_states(fsm)
    local names = {}
    for name in pairs(fsm.states) do
        local kept = not fsm.graph_collapse or name == fsm.start or border(fsm, name)
        if kept and name ~= fsm.start then table.insert(names, name) end
    end
    table.sort(names)
    table.insert(names, 1, fsm.start)
    return names
end

local draw

local function draw_inner(fsm, out, indent, prefix, state, counter)
    if not state.subfsm then return end
    local inner = "g" .. counter.n .. "_"
    table.insert(out, indent .. "\tsubgraph cluster_" .. counter.n .. " {")
    counter.n = counter.n + 1
    local look = {label = state.subfsm.name, style = "filled", fillcolor = "#f4f4f4", labeljust = "r"}
    table.insert(out, indent .. "\t\tgraph" .. attributes(look) .. ";")
    draw(state.subfsm, out, indent .. "\t", inner, counter)
    table.insert(out, indent .. "\t}")
    local function link(from, to)
        table.insert(out, indent .. "\t" .. node_name(from) .. " -> " .. node_name(to) .. ";")
    end
    link(prefix .. state.name, inner .. state.subfsm.start)
    for _, ends in ipairs {{state.subfsm.exit_state, state.exit_to}, {state.subfsm.fail_state, state.fail_to}} do
        if ends[1] and ends[2] then link(inner .. ends[1], prefix .. ends[2]) end
    end
end

function draw(fsm, out, indent, prefix, counter)
    local names = shown_states(fsm)
    local shown = {}
    for _, name in ipairs(names) do
        shown[name] = true
        local attr = describe_state(fsm, fsm.states[name])
        if prefix ~= "" then attr.label = attr.label or name end
        table.insert(out, indent .. "\t" .. node_name(prefix .. name) .. attributes(attr) .. ";")
    end
    for _, name in ipairs(names) do
        local state = fsm.states[name]
        draw_inner(fsm, out, indent, prefix, state, counter)
        for _, transition in ipairs(state.transitions) do
            local own = state.subfsm and
                            (transition == state.final_transition or transition == state.failure_transition)
            local to = transition.state.name
            if to and shown[to] and not transition.hide and not own then
                table.insert(out, string.format("%s\t%s -> %s%s;", indent, node_name(prefix .. name),
                                                node_name(prefix .. to),
                                                attributes(describe_transition(fsm, state, transition))))
            end
        end
    end
end

local function default_looks()
    local node = {penwidth = "2.0", shape = "rect", style = "rounded,filled"}
    local edge = {penwidth = "2.0"}
    if graph.coloured then
        node.color, node.fillcolor, edge.color = "#cacaff", "#e6e6ff", "#8080ff"
    end
    return node, edge
end

--- The graph of a state machine.
function graph.fsm(fsm)
    assert(fsm.states[fsm.start], "FSM grapher: No start node set for FSM or start node not created")
    local node, edge = default_looks()
    local out = {
        "digraph " .. node_name(fsm.name) .. " {",
        "\tgraph " .. attributes(merge({rankdir = graph.direction, penwidth = "2.0"}, fsm.dotattr)) .. ";",
        "\tnode" .. attributes(node) .. ";",
        "\tedge" .. attributes(edge) .. ";",
    }
    draw(fsm, out, "", "", {n = 1})
    table.insert(out, "}\n")
    return table.concat(out, "\n")
end

--- The graph of which skill uses which; skills that use none share a rank.
function graph.dependencies(skills)
    local out = {
        "digraph skill_dependencies {",
        "\tgraph " .. attributes {rankdir = "LR", penwidth = "1.0", compound = "true"} .. ";",
        "\tnode" .. attributes {
            penwidth = "1.0", shape = "rect", style = "rounded,filled", color = "#8080ff", fillcolor = "#e6e6ff",
        } .. ";",
        "\tedge" .. attributes {penwidth = "1.0", color = "#8080ff"} .. ";",
    }
    local edges, basic = {}, {}
    for _, skill in ipairs(skills) do
        local name, uses = node_name(skill.name), skill.depends_skills or {}
        local look = #uses == 0 and {color = "#80c65e", fillcolor = "#dfffd0"} or {}
        if #uses == 0 then table.insert(basic, "\t\t" .. name .. ";") end
        table.insert(out, "\t" .. name .. attributes(look) .. ";")
        for _, used in ipairs(uses) do
            table.insert(edges, "\t" .. name .. " -> " .. node_name(used) .. ";")
        end
    end
    for _, edge in ipairs(edges) do table.insert(out, edge) end
    if #basic > 0 then table.insert(out, "\t{rank=same;\n" .. table.concat(basic, "\n") .. "\n\t}") end
    table.insert(out, "}\n")
    return table.concat(out, "\n")
end

return graph
