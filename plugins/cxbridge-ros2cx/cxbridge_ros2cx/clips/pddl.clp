;;; Plans for goals, made by the feature `plansys2` from the facts of domain and world.
;;;
;;;   (pddl-request-plan GOAL FORMULA)   asks for a plan; the goal becomes EXPANDED, or FINISHED and FAILED

(deftemplate pddl-plan "A plan that was asked for."
  (slot goal-id (type SYMBOL))
  (slot plan-id (type SYMBOL))
  (slot status
    (type SYMBOL) (allowed-values NOT-STARTED RUNNING PLANNED PLAN-FAILED))
  (slot goal                ; the PDDL formula
    (type STRING)))

(deftemplate pddl-plan-feedback "What came of it."
  (slot plan-id (type SYMBOL))
  (slot status
    (type SYMBOL) (allowed-values RUNNING PLANNED PLAN-FAILED)))

(deffunction plan-with-psys2 (?goal-id ?goal ?plan-id)
  "Tell the planner of all objects and facts, and have it plan."
  (do-for-all-facts ((?object domain-object)) TRUE
    (psys2-add-domain-instance ?object:name ?object:type))
  (do-for-all-facts ((?fact domain-fact)) TRUE
    (psys2-add-domain-predicate
      (str-cat "(" (implode$ (create$ ?fact:name ?fact:param-values)) ")")))
  (psys2-call-planner ?goal-id ?goal ?plan-id))

(deffunction pddl-request-plan (?goal-id ?goal)
  "Ask for a plan that makes a formula true for a goal."
  (bind ?plan-id (sym-cat ?goal-id - (gensym*)))
  (assert (pddl-plan (goal-id ?goal-id) (plan-id ?plan-id) (goal ?goal) (status NOT-STARTED)))
  (printout t "Requested plan with id: " ?plan-id crlf))

(defrule pddl-call
  "One plan at a time: the planner knows one problem."
  ?plan <- (pddl-plan (goal-id ?goal-id) (plan-id ?plan-id) (goal ?goal) (status NOT-STARTED))
  (goal (id ?goal-id))
  (not (pddl-plan (status ~NOT-STARTED)))
  =>
  (modify ?plan (status RUNNING))
  (plan-with-psys2 ?goal-id ?goal ?plan-id))

(defrule pddl-expand-goal
  ?feedback <- (pddl-plan-feedback (plan-id ?plan-id) (status PLANNED))
  ?plan <- (pddl-plan (plan-id ?plan-id) (goal-id ?goal-id))
  ?goal <- (goal (id ?goal-id) (mode SELECTED))
  =>
  (printout t "Fetched a new plan!" crlf)
  (modify ?goal (mode EXPANDED))
  (retract ?feedback ?plan)
  (psys2-clear-knowledge))

(defrule pddl-check-if-planner-failed
  ?feedback <- (pddl-plan-feedback (plan-id ?plan-id) (status PLAN-FAILED))
  ?plan <- (pddl-plan (plan-id ?plan-id) (goal-id ?goal-id))
  ?goal <- (goal (id ?goal-id))
  =>
  (modify ?goal (mode FINISHED) (outcome FAILED) (error PLANNING-FAILED) (message "Planning failed"))
  (retract ?feedback ?plan)
  (psys2-clear-knowledge))

(defrule pddl-forget-plan-without-goal
  "The goal went away while its plan was made."
  ?plan <- (pddl-plan (plan-id ?plan-id) (goal-id ?goal-id))
  ?feedback <- (pddl-plan-feedback (plan-id ?plan-id))
  (not (goal (id ?goal-id)))
  =>
  (retract ?feedback ?plan)
  (psys2-clear-knowledge))

(deffunction pddl-get-max-action-id ()
  "The greatest id of all actions, 0 when there is none."
  (bind ?id 0)
  (do-for-all-facts ((?action plan-action)) (> ?action:id ?id)
    (bind ?id ?action:id))
  ?id)
