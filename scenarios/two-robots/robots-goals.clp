;;; The goals: inspect all places, as many at once as there are robots, each with up to three
;;; tries.

(deffunction robots-inspect (?place)
  "Assert the goal to inspect a place, with up to three tries."
  (goal-tree-assert-retry AUTOMATIC-SUBGOAL 3
    (assert (goal (id (sym-cat INSPECT- ?place)) (class INSPECT) (params place ?place)))))

(defrule robots-round-formulate
  "Formulate the round when both Skillers are controlled and have executors."
  (domain-facts-loaded)
  (forall (robot (agent ?agent))
    (skiller-control (skiller ?agent) (acquired TRUE))
    (skill-board-executor (agent ?agent) (skills $? move $?)))
  (not (robots-begun))
  =>
  (bind ?goals (create$))
  (progn$ (?place ?*PLACES*)
    (bind ?goals (create$ ?goals (robots-inspect ?place))))
  (goal-tree-assert-run-parallel ROUND NONE ?goals)
  (assert (robots-begun)))

(defrule robots-round-advance
  "The root needs no decisions: advance it to its next mode."
  ?root <- (goal (class ROUND) (mode ?mode&FORMULATED|SELECTED|FINISHED|EVALUATED))
  =>
  (bind ?modes (create$ FORMULATED SELECTED EXPANDED FINISHED EVALUATED RETRACTED))
  (modify ?root (mode (nth$ (+ 1 (member$ ?mode ?modes)) ?modes))))

(defrule robots-inspect-commit
  ?goal <- (goal (id ?id) (class INSPECT) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule robots-inspect-dispatch
  ?goal <- (goal (class INSPECT) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule robots-inspect-evaluate
  "Free the robot, remember a failure for the next try, and retract the plan."
  ?goal <- (goal (id ?id) (class INSPECT) (mode FINISHED) (outcome ?outcome) (message ?message))
  ?robot <- (robot (name ?name) (goal ?id))
  =>
  (modify ?robot (goal nil))
  (if (eq ?outcome FAILED) then
    (printout warn ?name " could not do " ?id ": " ?message crlf))
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode EVALUATED) (meta (if (eq ?outcome FAILED) then (create$ not-with ?name)))))
