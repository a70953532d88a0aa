; calls.clp - plans being made, of the feature `planner`. Loaded when the feature is requested.

(deftemplate planner-call
  "A plan being made, or made, or not."
  (slot id (type SYMBOL))
  ; the goal it is for; nil: of no concern to goals.clp
  (slot goal-id (type SYMBOL))
  (slot status (type SYMBOL)
    (allowed-values RUNNING PLANNED NO-PLAN FAILED TIMEOUT CANCELLED))
  ; who plans: what was asked for, then who did it
  (slot planner (type SYMBOL))
  ; id of the plan once PLANNED
  (slot plan-id (type SYMBOL))
  ; why there is no plan
  (slot message (type STRING))
  (slot seconds (type FLOAT)))

(deffunction planner-call-ended
  "Note how a call ended. The feature does this."
  (?id ?status ?planner ?plan-id ?message ?seconds)
  (do-for-fact ((?call planner-call)) (eq ?call:id ?id)
    (modify ?call (status ?status) (planner ?planner) (plan-id ?plan-id)
                  (message ?message) (seconds ?seconds))))
