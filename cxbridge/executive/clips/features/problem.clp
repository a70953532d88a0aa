; problem.clp - what clients of PlanSys2 want, of the feature `problem-expert`.

(deftemplate problem-goal
  "What somebody wants: an event for rules, which make goals of it. Each has an id of its own."
  (slot id (type SYMBOL))
  ; in PDDL, as planner-plan takes it
  (slot formula (type STRING)))
