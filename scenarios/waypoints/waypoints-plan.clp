;;; The plan: a planner finds the seven moves.

(deffunction waypoints-wanted (?target)
  "The goal as a PDDL formula: everywhere was somebody, and now we are there."
  (bind ?formula (str-cat "(at tb3 " ?target ")"))
  (progn$ (?waypoint ?*WAYPOINTS*)
    (bind ?formula (str-cat ?formula " (visited " ?waypoint ")")))
  (return (str-cat "(and " ?formula ")")))

(defrule waypoints-plan-wanted
  (goal (id ?goal) (class TOUR) (mode SELECTED) (params robot ? target ?target))
  (not (planner-call (goal-id ?goal)))
  (not (plan (goal-id ?goal)))
  =>
  (planner-plan ?goal (waypoints-wanted ?target)))

(defrule waypoints-plan-whose-move
  "The first parameter of each move is the robot, the skill board's agent of that name drives."
  (declare (salience ?*SALIENCE-HIGH*))
  ?move <- (plan-action (action-name move) (param-values ?robot $?) (skiller "Skiller"))
  =>
  (modify ?move (skiller (str-cat ?robot))))
