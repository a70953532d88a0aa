; calls.clp - plans being made, of the feature `planner`. Loaded when the feature is requested.

(deftemplate planner-call
  "A plan being made, or made, or not."
  (slot id (type SYMBOL))
  ; the goal it is for; nil: of no concern to goals.clp
  (slot goal-id (type SYMBOL))
  (slot status (type SYMBOL)
    (allowed-values RUNNING PLANNED NO-PLAN FAILED TIMEOUT CANCELLED INVALID))
  ; who plans: what was asked for, then who did it
  (slot planner (type SYMBOL))
  ; id of the plan once PLANNED
  (slot plan-id (type SYMBOL))
  ; why there is no plan
  (slot message (type STRING))
  ; with the planner auto: which other planners were left out or failed before, and why
  (slot why (type STRING))
  (slot seconds (type FLOAT)))

(deftemplate plan-valid
  "Whether what is left of a planner's plan holds in the world as it is. Checked when the world
   or the plan's actions have changed; /planner/check-plans: false in the configuration: no check."
  (slot plan-id (type SYMBOL)) (slot goal-id (type SYMBOL))
  (slot valid (default TRUE) (type SYMBOL) (allowed-values TRUE FALSE))
  ; the first step that cannot be done, and the condition that is false
  (slot message (type STRING)))

(deffunction planner-call-ended
  "Note how a call ended. The feature does this."
  (?id ?status ?planner ?plan-id ?message ?seconds ?why)
  (do-for-fact ((?call planner-call)) (eq ?call:id ?id)
    (modify ?call (status ?status) (planner ?planner) (plan-id ?plan-id)
                  (message ?message) (seconds ?seconds) (why ?why))))
