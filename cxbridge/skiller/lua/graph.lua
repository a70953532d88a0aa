-- State machines in the dot language, byte for byte as Fawkes: nodes, edges and attributes have the order of Lua's
-- tables, so they are inserted into tables in Fawkes' order. (Lua 5.1 orders equal tables equally.)

local core = ...

local graph = {direction = "TB", coloured = true}

-- The dot language

-- A cache, because the graphs of a machine repeat the same texts, and quoting is most of the work.
local function cached(fn)
    local results, count = {}, 0
    return function(text)
        if text ~= text then return fn(text) end -- NaN is not a key
        local result = results[text]
        if not result then
            -- an empty cache from time to time bounds the memory
            if count >= 1000 then results, count = {}, 0 end
            result = fn(text)
            results[text], count = result, count + 1
        end
        return result
    end
end

local quote = cached(function(text)
    text = tostring(text)
    local quoted = string.format("%q", text)
    -- \n in labels belongs to dot, so backslashes are doubled only in a text with one before a quote, which may be
    -- the closing quote
    if text:find('\\"', 1, true) or text:sub(-1) == "\\" then return quoted end
    return (quoted:gsub("\\\\", "\\"))
end)

local node_name = cached(function(name)
    return name:match("^[%w_]+$") and name or string.format("%q", name)
end)

local function attributes(attr)
    local text
    for name, value in pairs(attr) do
        local assignment = value == "" and name or name .. "=" .. quote(value)
        text = text and text .. ", " .. assignment or assignment
    end
    return text and " [" .. text .. "]" or ""
end

local function set(attr, ...)
    for i = 1, select("#", ...), 2 do
        local name, value = select(i, ...)
        attr[name] = value
    end
end

local function merge(attr, more)
    for name, value in pairs(more or {}) do attr[name] = value end
end

-- A graph or subgraph of dot: its head, its attributes, the default attributes of its nodes and edges, its nodes,
-- subgraphs and edges, and the names of the nodes that share a rank.
local function new_drawing(kind, name)
    return {
        head = kind .. " " .. name, attr = {}, node = {}, edge = {}, nodes = {}, subgraphs = {}, edges = {}, rank = {},
    }
end

local function add_node(drawing, name)
    local node, nodes = {name = name, attr = {}}, drawing.nodes
    nodes[#nodes + 1] = node
    return node.attr
end

local function add_edge(drawing, from, to)
    local edge, edges = {from = from, to = to, attr = {}}, drawing.edges
    edges[#edges + 1] = edge
    return edge.attr
end

local function add_cluster(drawing, name, label, filling)
    local cluster = new_drawing("subgraph", name)
    set(cluster.attr, "label", label, "style", "filled", "fillcolor", filling, "fontweight", "bold", "labeljust", "r")
    table.insert(drawing.subgraphs, cluster)
    return cluster
end

local function add_comment(node)
    local text = node.attr.comment
    if text then node.attr.label = (node.attr.label or node.name) .. "\\n(" .. text .. ")" end
end

local function write_attributes(out, indent, element, attr)
    if next(attr) then out[#out + 1] = indent .. "\t" .. element .. attributes(attr) .. ";" end
end

local function write(drawing, out, indent)
    local inner = indent .. "\t"
    out[#out + 1] = indent .. drawing.head .. " {"
    write_attributes(out, indent, "graph ", drawing.attr)
    write_attributes(out, indent, "node", drawing.node)
    write_attributes(out, indent, "edge", drawing.edge)
    for _, node in ipairs(drawing.nodes) do
        add_comment(node)
        out[#out + 1] = inner .. node_name(node.name) .. attributes(node.attr) .. ";"
    end
    for _, cluster in ipairs(drawing.subgraphs) do write(cluster, out, inner) end
    for _, edge in ipairs(drawing.edges) do
        out[#out + 1] = inner .. node_name(edge.from) .. " -> " .. node_name(edge.to) .. attributes(edge.attr) .. ";"
    end
    if #drawing.rank > 0 then
        out[#out + 1] = inner .. "{rank=same;"
        for _, name in ipairs(drawing.rank) do out[#out + 1] = inner .. "\t" .. node_name(name) .. ";" end
        out[#out + 1] = inner .. "}"
    end
    out[#out + 1] = indent .. "}"
end

local function as_text(drawing)
    local out = {}
    write(drawing, out, "")
    return table.concat(out, "\n") .. "\n"
end

-- From one pass over the trace: the set of the states in it, and the numbers of the entries of each transition as a text,
-- e.g. "1,3".

local function traces(fsm)
    local states, transitions = {}, {}
    for i, entry in ipairs(fsm.tracing and fsm.trace or {}) do
        if entry.from then states[entry.from] = true end
        if entry.to then states[entry.to] = true end
        if entry.transition then
            local numbers = transitions[entry.transition]
            transitions[entry.transition] = numbers and numbers .. "," .. i or tostring(i)
        end
    end
    return {states = states, transitions = transitions}
end

-- Attributes of states, with the colours of Fawkes

local function is_end(fsm, name)
    return name == fsm.exit_state or name == fsm.fail_state or name == fsm.recover_state
end

local function filling(fsm, name)
    return name == fsm.exit_state and "#ccffcc" or name == fsm.fail_state and "#ffcccc" or
               name == fsm.recover_state and "#ffff88" or "#ffc080"
end

local function style_start(fsm, state, attr, label)
    attr.penwidth = "4.0"
    if graph.coloured then attr.color = "#ffc080" end
    if label then attr.label = label end
    if fsm.current == state then
        attr.active = "true"
        if graph.coloured then attr.fillcolor = "#ffc080" else attr.style = "dotted" end
    end
    merge(attr, state.dotattr)
end

local function style_state(fsm, traced, state, attr, label)
    local name = state.name
    merge(attr, state.dotattr)
    if label then attr.label = label end
    if is_end(fsm, name) then
        -- single assignments, because a constructor would insert the attributes in another order
        attr.shape = "doubleoctagon"
        attr.style = "solid,filled"
        attr.penwidth = "1.0"
    end
    if fsm.current and fsm.current.name == name then
        attr.active = "true"
        if graph.coloured then
            attr.fillcolor = filling(fsm, name)
        else
            attr.style = "dotted"
        end
    elseif traced.states[state] then
        if graph.coloured then attr.color = "#ff8000" else attr.style = "dashed,rounded" end
    end
    if graph.coloured and is_end(fsm, name) then
        attr.color = name == fsm.exit_state and "#6fdd6f" or "#ff8080"
    end
end

-- Attributes of transitions

local function style_transition(fsm, traced, from, transition, attr)
    if transition.description then attr.label = tostring(transition.description) end
    merge(attr, transition.dotattr)
    if transition.state.name == fsm.fail_state and graph.coloured then attr.style = "dotted" end
    if from.name == fsm.exit_state or from.name == fsm.fail_state then
        if graph.coloured then attr.color = "red3" end
        attr.style = "dashed"
    end
    local numbers = traced.transitions[transition]
    if numbers then
        attr.taillabel = numbers
        if graph.coloured then
            attr.labelfontcolor = "#ff8000"
            attr.color = "#ff8000"
        else
            attr.style = "dashed"
        end
    end
end

-- Machines

local draw

local function add_prefix(prefix, name) return prefix and prefix .. "_" .. name or name end

local function draw_inner_machine(drawing, prefix, state, counter)
    local inner, name = state.subfsm, state.subfsm.name
    local inner_prefix = "g" .. counter.n
    -- dot draws a frame only around a subgraph whose name begins with cluster
    if not name:match("^cluster") then
        name = "cluster_" .. counter.n
        counter.n = counter.n + 1
    end
    draw(inner, add_cluster(drawing, name, inner.name, "#f4f4f4"), inner_prefix, counter)
    add_edge(drawing, add_prefix(prefix, state.name), add_prefix(inner_prefix, inner.start))
    local function add_way_out(from, to)
        if from and to then add_edge(drawing, add_prefix(inner_prefix, from), add_prefix(prefix, to)) end
    end
    add_way_out(inner.exit_state, state.exit_to)
    add_way_out(inner.fail_state, state.fail_to)
end

-- Machines in a list are drawn, machines with names are not, as in Fawkes.
local function draw_inner_machines(drawing, prefix, state, counter)
    local hub = add_prefix("g" .. counter.n, "RUN_SUBFSMS")
    local cluster = add_cluster(drawing, "cluster_" .. counter.n, state.name, "#f8f8ff")
    counter.n = counter.n + 1
    set(add_node(cluster, hub), "label", "RUN_SUBFSMS")
    for _, inner in ipairs(state.subfsms) do
        local inner_prefix, name = "g" .. counter.n, "cluster_" .. counter.n
        counter.n = counter.n + 1
        local subgraph = new_drawing("subgraph", name)
        set(subgraph.attr, "comment", inner_prefix, "label", inner.name, "style", "filled", "fillcolor", "#f4f4f4",
            "fontweight", "bold", "labeljust", "r")
        table.insert(cluster.subgraphs, subgraph)
        draw(inner, subgraph, inner_prefix, counter)
        set(add_edge(cluster, hub, add_prefix(inner_prefix, inner.start)), "lhead", name, "arrowhead", "dot", "label",
            "uses", "style", "dashed")
    end
    add_edge(drawing, add_prefix(prefix, state.name), hub)
    if state.exit_to then set(add_edge(drawing, hub, add_prefix(prefix, state.exit_to)), "label", "FSMs succeeded") end
    if state.fail_to then set(add_edge(drawing, hub, add_prefix(prefix, state.fail_to)), "label", "FSM failed") end
end

local function shown_states(fsm)
    if not fsm.graph_collapse then return fsm.states end
    local shown = {[fsm.start] = fsm.states[fsm.start]}
    for _, name in ipairs {fsm.exit_state or "", fsm.fail_state or "", fsm.recover_state or ""} do
        shown[name] = fsm.states[name]
    end
    return shown
end

-- The start state first, so that dot draws it at the top.
function draw(fsm, drawing, prefix, counter)
    merge(drawing.attr, fsm.dotattr)
    local first = assert(fsm.states[fsm.start], "FSM grapher: No start node set for FSM or start node not created")
    style_start(fsm, first, add_node(drawing, add_prefix(prefix, fsm.start)), prefix and fsm.start)
    local shown, traced = shown_states(fsm), traces(fsm)
    for name, state in pairs(shown) do
        if name ~= fsm.start then
            style_state(fsm, traced, state, add_node(drawing, add_prefix(prefix, name)), prefix and name)
        end
        if state.subfsm then draw_inner_machine(drawing, prefix, state, counter) end
        if state.subfsms then draw_inner_machines(drawing, prefix, state, counter) end
        for _, transition in ipairs(state.transitions) do
            local is_own = state.subfsm and
                               (transition == state.final_transition or transition == state.failure_transition)
            local to = transition.state.name
            if to and shown[to] and not transition.hide and not is_own then
                style_transition(fsm, traced, state, transition,
                                 add_edge(drawing, add_prefix(prefix, name), add_prefix(prefix, to)))
            end
        end
    end
end

--- The graph of a state machine.
function graph.fsm(fsm)
    local drawing = new_drawing("digraph", node_name(fsm.name))
    set(drawing.attr, "rankdir", graph.direction, "penwidth", "2.0")
    set(drawing.node, "penwidth", "2.0", "shape", "rect", "style", "rounded,filled")
    set(drawing.edge, "penwidth", "2.0")
    if graph.coloured then
        set(drawing.node, "color", "#cacaff", "fillcolor", "#e6e6ff")
        set(drawing.edge, "color", "#8080ff")
    end
    draw(fsm, drawing, nil, {n = 1})
    return as_text(drawing)
end

--- The graph of the dependencies of skills; skills without dependencies share a rank.
function graph.dependencies(skills)
    local drawing = new_drawing("digraph", "skill_dependencies")
    set(drawing.attr, "rankdir", "LR", "penwidth", "1.0", "compound", "true")
    set(drawing.node, "penwidth", "1.0", "shape", "rect", "style", "rounded,filled", "color", "#8080ff", "fillcolor",
        "#e6e6ff")
    set(drawing.edge, "penwidth", "1.0", "color", "#8080ff")
    for _, skill in ipairs(skills) do
        local attr, uses = add_node(drawing, skill.name), skill.depends_skills or {}
        if #uses == 0 then
            table.insert(drawing.rank, skill.name)
            set(attr, "color", "#80c65e", "fillcolor", "#dfffd0")
        end
        for _, used in ipairs(uses) do add_edge(drawing, skill.name, used) end
    end
    return as_text(drawing)
end

return graph
