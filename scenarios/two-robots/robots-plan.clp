;;; The plan for a place: drive there, and inspect it. The slot skiller names the Skiller of the robot.

(deffunction robots-step (?goal ?agent ?step ?action ?names ?values)
  "Assert an action of the goal's plan; the agent is the name of the Skiller."
  (assert (plan-action (id ?step) (goal-id ?goal) (plan-id (sym-cat ?goal -PLAN)) (action-name ?action)
                       (param-names ?names) (param-values ?values) (skiller ?agent))))

(defrule robots-plan
  ?goal <- (goal (id ?id) (class INSPECT) (mode SELECTED) (params place ?place))
  (robot (name ?robot) (agent ?agent) (goal ?id))
  (domain-fact (name at) (param-values ?robot ?from))
  =>
  (assert (plan (id (sym-cat ?id -PLAN)) (goal-id ?id) (type SEQUENTIAL)))
  (robots-step ?id ?agent 1 move (create$ r from to) (create$ ?robot ?from ?place))
  (robots-step ?id ?agent 2 inspect (create$ r p) (create$ ?robot ?place))
  (modify ?goal (mode EXPANDED)))
