; problem.clp - goals of PlanSys2 clients, for the feature `problem-expert`.

(deftemplate problem-goal
  "A goal that a client requests, with a unique id. Rules formulate goals for it and retract it."
  (slot id (type SYMBOL))
  ; in PDDL, as an argument of planner-plan
  (slot formula (type STRING)))
