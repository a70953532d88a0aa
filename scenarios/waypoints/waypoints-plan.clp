;;; The plan, as it was found once: seven moves. In place of this file a planner may make
;;; the plan for each goal of the class TOUR that is SELECTED.

(defrule waypoints-plan-given
  (goal (id ?goal) (class TOUR) (mode SELECTED) (params robot ?robot target ?))
  (not (plan (goal-id ?goal)))
  =>
  (assert (plan (id TOUR-PLAN) (goal-id ?goal) (type SEQUENTIAL)))
  (progn$ (?to (rest$ ?*WAYPOINTS*))
    (assert (plan-action (id ?to-index) (plan-id TOUR-PLAN) (goal-id ?goal) (action-name move)
                         (param-names r from to)
                         (param-values ?robot (nth$ ?to-index ?*WAYPOINTS*) ?to)
                         (skiller (str-cat ?robot))))))
