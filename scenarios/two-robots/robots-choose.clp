;;; The choice of a robot for a goal: a free robot with executors, but not the robot that failed in
;;; the last try of the goal, unless no other robot has executors.

(defrule robots-choose
  (goal (id ?id) (class INSPECT) (mode SELECTED) (meta $?meta))
  (not (robot (goal ?id)))
  ?robot <- (robot (name ?name) (agent ?agent) (goal nil))
  (skill-board-executor (agent ?agent) (skills $? move $?))
  (skill-board-executor (agent ?agent) (skills $? inspect $?))
  (or (test (not (member$ ?name ?meta)))
      (not (and (robot (name ~?name) (agent ?other))
                (skill-board-executor (agent ?other) (skills $? move $?)))))
  =>
  (printout t ?name " takes " ?id crlf)
  (modify ?robot (goal ?id)))
