; plan.clp - plans and their actions
;
; A plan is a set of actions which together achieve a goal. Action selection changes the state of an
; action from FORMULATED to PENDING, an executor up to EXECUTION-SUCCEEDED or EXECUTION-FAILED, and
; domain-effects.clp from there to FINAL or FAILED.

(deftemplate plan
  "A way to achieve a goal; the goal's committed-to names the plan that is executed."
  (slot id (type SYMBOL)) (slot goal-id (type SYMBOL))
  ; how actions are selected: SEQUENTIAL or TEMPORAL; nil: no rule selects actions
  (slot type (type SYMBOL))
  (slot cost (type FLOAT))
  ; when the execution of a TEMPORAL plan began, in seconds and microseconds; 0 0 before
  (multislot start-time (default 0 0) (type INTEGER) (cardinality 2 2))
  ; no further action of a suspended plan is selected
  (slot suspended (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE))
  (slot suspension-reason (default nil) (type SYMBOL)))

(deftemplate plan-action
  "A step of a plan: an operator with values for its parameters."
  ; the order in a sequential plan
  (slot id (type INTEGER)) (slot plan-id (type SYMBOL)) (slot goal-id (type SYMBOL))
  ; the operator, and the names and values of its arguments
  (slot action-name (type SYMBOL)) (multislot param-names) (multislot param-values)
  ; in seconds: the planned duration, and the dispatch time after the start of a TEMPORAL plan; the default
  ; is Fawkes', and selects the action when the plan starts
  (slot duration (type FLOAT)) (slot dispatch-time (default -1.0) (type FLOAT))
  ; the states in their order; FAILED follows EXECUTION-FAILED, or PENDING (execmon/stalled-action.clp)
  (slot state (type SYMBOL)
    (allowed-values
      FORMULATED PENDING WAITING RUNNING
      EXECUTION-SUCCEEDED SENSED-EFFECTS-WAIT SENSED-EFFECTS-HOLD EFFECTS-APPLIED FINAL
      EXECUTION-FAILED FAILED))
  ; whether the precondition holds now, and the id of its pddl-grounding (nil: none)
  (slot executable (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE))
  (slot precondition (default nil) (type SYMBOL))
  ; the executing Skiller, or agent on the skill board
  (slot skiller (default "Skiller") (type STRING))
  ; the executing agent in rules of ros2-clips-executive (2021), whose actions have no Skiller
  (slot agent-id (default "") (type STRING))
  ; the time of the selection from a TEMPORAL plan (0 0: not selected); the reason of a failure
  (multislot start-time (default 0 0) (type INTEGER) (cardinality 2 2))
  (slot error-msg (type STRING)))

(deffunction plan-action-arg
  "The value of a parameter. Without such a parameter the first of $?default; FALSE without a default."
  (?param-name ?param-names ?param-values $?default)
  (bind ?position (member$ ?param-name ?param-names))
  (if ?position then (return (nth$ ?position ?param-values)))
  (if (= (length$ ?default) 0) then (return FALSE))
  (return (nth$ 1 ?default)))

(deffunction plan-retract-all-for-goal
  "Retract the plans of a goal together with their actions. Actions without a plan stay."
  (?goal-id)
  (bind ?plans (create$))
  (do-for-all-facts ((?p plan)) (eq ?p:goal-id ?goal-id)
    (bind ?plans (create$ ?plans ?p:id)))
  (if (= (length$ ?plans) 0) then (return))
  (delayed-do-for-all-facts ((?a plan-action))
      (and (eq ?a:goal-id ?goal-id) (member$ ?a:plan-id ?plans))
    (retract ?a))
  (delayed-do-for-all-facts ((?p plan)) (eq ?p:goal-id ?goal-id)
    (retract ?p)))
