;;; The plan: a planner finds the seven moves.

(deffunction waypoints-goal-formula (?target)
  "Return the goal as a PDDL formula: all waypoints are visited, and the robot is at the target."
  (bind ?formula (str-cat "(at tb3 " ?target ")"))
  (progn$ (?waypoint ?*WAYPOINTS*)
    (bind ?formula (str-cat ?formula " (visited " ?waypoint ")")))
  (return (str-cat "(and " ?formula ")")))

(defrule waypoints-plan
  "Call the planner, which expands the goal with the plan, or fails the goal."
  (goal (id ?goal) (class TOUR) (mode SELECTED) (params robot ? target ?target))
  (not (planner-call (goal-id ?goal)))
  (not (plan (goal-id ?goal)))
  =>
  (planner-plan ?goal (waypoints-goal-formula ?target)))

(defrule waypoints-plan-set-agent
  "The first parameter of a move is the robot, which is also the agent of the move on the skill board. The
   salience is above that of waypoints-goal-commit."
  (declare (salience ?*SALIENCE-HIGH*))
  ?move <- (plan-action (action-name move) (param-values ?robot $?) (skiller "Skiller"))
  =>
  (modify ?move (skiller (str-cat ?robot))))
