;;; One goal: the robot has said goodbye to PEGGY. The goal has up to three tries.

(defglobal ?*MEET-WANTED* = "(said PEGGY GOODBYE)"
           ?*MEET-MAX-TRIES* = 3)

(defrule meet-begin
  "Formulate the goal once, when the domain is loaded and the skiller is controlled."
  (domain-facts-loaded)
  (skiller-control (acquired TRUE))
  (not (meet-tries ?))
  =>
  (assert (goal (id TESTGOAL) (class SAY-GOODBYE))
          (meet-tries 1)))

(defrule meet-select
  ?goal <- (goal (id TESTGOAL) (mode FORMULATED))
  =>
  (modify ?goal (mode SELECTED)))

(defrule meet-plan
  "Call the planner, which expands the goal with the plan, or fails the goal."
  (goal (id ?id) (class SAY-GOODBYE) (mode SELECTED))
  (not (planner-call (goal-id ?id)))
  =>
  (planner-plan ?id ?*MEET-WANTED*))

(defrule meet-commit
  "Commit to the only plan."
  ?goal <- (goal (id ?id) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule meet-dispatch
  ?goal <- (goal (id TESTGOAL) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule meet-evaluate
  ?goal <- (goal (id TESTGOAL) (mode FINISHED) (outcome ?outcome))
  =>
  (printout t "Goal 'TESTGOAL' is " ?outcome crlf)
  (modify ?goal (mode EVALUATED)))

;; a failed goal is planned again from the present state, until its tries are used up
(defrule meet-try-again
  ?goal <- (goal (id ?id) (class SAY-GOODBYE) (mode EVALUATED) (outcome FAILED))
  ?tries <- (meet-tries ?number&:(< ?number ?*MEET-MAX-TRIES*))
  =>
  (retract ?tries)
  (assert (meet-tries (+ ?number 1)))
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode SELECTED) (outcome UNKNOWN) (error) (message "") (committed-to nil)))

(defrule meet-end
  ?goal <- (goal (id ?id) (class SAY-GOODBYE) (mode EVALUATED) (outcome ?outcome))
  (meet-tries ?number)
  (test (or (neq ?outcome FAILED) (>= ?number ?*MEET-MAX-TRIES*)))
  =>
  (modify ?goal (mode RETRACTED)))
