;;; The rooms, the open doors (pairs of rooms), and a door that closes during the run.

(defglobal ?*DETOUR-DOORS* =
  (create$ hall office office store hall yard yard shed shed store))

(defrule detour-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (blackboard-open-reading "SkillerInterface" "robot")
  (assert (skiller-control (skiller "robot"))
          (domain-fact (name at) (param-values hall)))
  (loop-for-count (?door 1 (div (length$ ?*DETOUR-DOORS*) 2))
    (bind ?room (nth$ (- (* 2 ?door) 1) ?*DETOUR-DOORS*))
    (bind ?next-room (nth$ (* 2 ?door) ?*DETOUR-DOORS*))
    (assert (domain-fact (name door) (param-values ?room ?next-room))
            (domain-fact (name door) (param-values ?next-room ?room))))
  (assert (domain-loaded)))

(defrule detour-door-falls-shut
  "Plays a sensor: while the robot drives to the office, the door behind the office closes."
  (plan-action (action-name drive) (param-values hall office) (state RUNNING))
  ?way-there <- (domain-fact (name door) (param-values office store))
  ?way-back <- (domain-fact (name door) (param-values store office))
  =>
  (printout warn "The door between office and store falls shut" crlf)
  (retract ?way-there ?way-back))
