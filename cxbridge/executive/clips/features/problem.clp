; problem.clp - what clients of PlanSys2 want, and the numbers that they set: of the feature `problem-expert`.

(deftemplate problem-goal
  "What somebody wants: an event for rules, which make goals of it. Each has an id of its own."
  (slot id (type SYMBOL))
  ; in PDDL, as planner-plan takes it
  (slot formula (type STRING)))

(deftemplate problem-function
  "The value of a numeric function. The core does not look at it, planners do."
  (slot name (type SYMBOL)) (multislot param-values) (slot value (type FLOAT)))
