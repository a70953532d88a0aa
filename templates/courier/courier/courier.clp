(defrule courier-load-domain
  "Load the domain once, and request control of the Skiller."
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded) (skiller-control)))

(defrule courier-know-the-world
  (domain-loaded)
  =>
  (assert (domain-object (name kitchen) (type place))
          (domain-object (name table) (type place))
          (domain-object (name cup) (type thing))
          (domain-fact (name robot-at) (param-values table))
          (domain-fact (name at) (param-values cup kitchen))
          (domain-fact (name hand-free))
          (domain-facts-loaded)))

(defrule courier-formulate
  (domain-facts-loaded)
  (skiller-control (acquired TRUE))
  (not (tries ?))
  =>
  (assert (goal (id DELIVER-CUP) (class DELIVER)) (tries 1)))

(defrule courier-select
  ?goal <- (goal (class DELIVER) (mode FORMULATED))
  =>
  (modify ?goal (mode SELECTED)))

(defrule courier-expand
  "The planner expands the goal with a plan, or fails the goal."
  (goal (id ?id) (class DELIVER) (mode SELECTED))
  (not (planner-call (goal-id ?id)))
  =>
  (planner-plan ?id "(at cup table)"))

(defrule courier-commit
  ?goal <- (goal (id ?id) (class DELIVER) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule courier-dispatch
  ?goal <- (goal (class DELIVER) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule courier-evaluate
  ?goal <- (goal (class DELIVER) (mode FINISHED))
  =>
  (modify ?goal (mode EVALUATED)))

(defrule courier-end
  ?goal <- (goal (class DELIVER) (mode EVALUATED))
  =>
  (modify ?goal (mode RETRACTED)))

(defrule courier-try-again
  "Give a failed goal three tries. The salience is above that of courier-end, which would retract the goal."
  (declare (salience 10))
  ?goal <- (goal (id ?id) (class DELIVER) (mode EVALUATED) (outcome FAILED))
  ?tries <- (tries ?number&:(< ?number 3))
  =>
  (retract ?tries)
  (assert (tries (+ ?number 1)))
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode SELECTED) (outcome UNKNOWN) (error) (message "") (committed-to nil)))
