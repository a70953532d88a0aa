;;; The only goal: the robot is at the last waypoint and has visited all waypoints.

(defrule waypoints-goal-formulate
  "Formulate the goal once, when the skill board has an executor."
  (domain-facts-loaded)
  (skill-board-executor (agent "tb3") (skills $? move $?))
  (not (waypoints-begun))
  =>
  (assert (goal (id TOUR) (class TOUR) (params robot tb3 target wp-final))
          (waypoints-begun)))

(defrule waypoints-goal-select
  ?goal <- (goal (class TOUR) (mode FORMULATED))
  =>
  (modify ?goal (mode SELECTED)))

(defrule waypoints-goal-commit
  ?goal <- (goal (id ?id) (class TOUR) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule waypoints-goal-dispatch
  ?goal <- (goal (class TOUR) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule waypoints-goal-evaluate
  "Warn of each waypoint at which the robot has not been; print the outcome, which is that of the plan."
  ?goal <- (goal (class TOUR) (mode FINISHED) (outcome ?outcome))
  =>
  (progn$ (?waypoint ?*WAYPOINTS*)
    (if (not (any-factp ((?fact domain-fact))
               (and (eq ?fact:name visited) (eq ?fact:param-values (create$ ?waypoint)))))
     then (printout warn "The robot has never been at " ?waypoint crlf)))
  (printout t "The tour is " ?outcome crlf)
  (modify ?goal (mode EVALUATED)))

(defrule waypoints-goal-retract
  ?goal <- (goal (class TOUR) (mode EVALUATED))
  =>
  (modify ?goal (mode RETRACTED)))
