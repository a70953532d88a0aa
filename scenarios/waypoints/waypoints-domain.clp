;;; The domain model: domain.pddl and the initial state.

(defglobal
  ?*WAYPOINTS* = (create$ wp-init wp1 wp2 wp3 wp4 wp5 wp6 wp-final))

(defrule waypoints-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)))

(defrule waypoints-domain-facts
  "The robot is at the first waypoint; each waypoint is connected to its neighbours."
  (executive-init)
  (domain-loaded)
  =>
  (assert (domain-fact (name at) (param-values tb3 wp-init))
          (domain-fact (name visited) (param-values wp-init)))
  (progn$ (?to (rest$ ?*WAYPOINTS*))
    (bind ?from (nth$ ?to-index ?*WAYPOINTS*))
    (assert (domain-fact (name connected) (param-values ?from ?to))
            (domain-fact (name connected) (param-values ?to ?from))))
  (assert (domain-facts-loaded)))
