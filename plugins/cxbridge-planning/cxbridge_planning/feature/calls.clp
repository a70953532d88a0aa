; calls.clp - calls of planners, for the feature `planner`. Loaded when the feature is requested.

(deftemplate planner-call
  "A call of a planner, and its result."
  (slot id (type SYMBOL))
  ; the goal of the plan; nil: goals.clp ignores the call
  (slot goal-id (type SYMBOL))
  (slot status (type SYMBOL)
    (allowed-values RUNNING PLANNED NO-PLAN FAILED TIMEOUT CANCELLED INVALID))
  ; the requested planner; after the call, the planner that made the result, if one did
  (slot planner (type SYMBOL))
  ; id of the plan when the call is PLANNED
  (slot plan-id (type SYMBOL))
  ; the reason for a missing plan
  (slot message (type STRING))
  ; why this planner has made the result; with the planner auto: the planners that were skipped or
  ; failed before, and the reasons
  (slot why (type STRING))
  (slot seconds (type FLOAT)))

(deftemplate plan-valid
  "Whether the rest of a planner's plan is valid in the present world. Checked after changes of the
   world or of the plan's actions, unless /planner/check-plans is false in the configuration."
  (slot plan-id (type SYMBOL)) (slot goal-id (type SYMBOL))
  (slot valid (default TRUE) (type SYMBOL) (allowed-values TRUE FALSE))
  ; the first step that is not executable, and its false condition
  (slot message (type STRING)))

(deffunction planner-call-ended
  "Set the result of a call; for the feature only."
  (?id ?status ?planner ?plan-id ?message ?seconds ?why)
  (do-for-fact ((?call planner-call)) (eq ?call:id ?id)
    (modify ?call (status ?status) (planner ?planner) (plan-id ?plan-id)
                  (message ?message) (seconds ?seconds) (why ?why))))
