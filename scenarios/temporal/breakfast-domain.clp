;;; The domain model: two cooks with a Skiller each, two dishes.

(defglobal ?*COOKS* = (create$ ann ben)
           ?*DISHES* = (create$ egg toast))

(defrule breakfast-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)))

(defrule breakfast-domain-facts
  (executive-init)
  (domain-loaded)
  =>
  (progn$ (?cook ?*COOKS*)
    (blackboard-open-reading "SkillerInterface" (str-cat ?cook))
    (assert (skiller-control (skiller (str-cat ?cook)))
            (domain-object (name ?cook) (type cook))
            (domain-fact (name free) (param-values ?cook))))
  (progn$ (?dish ?*DISHES*)
    (assert (domain-object (name ?dish) (type dish))
            (domain-fact (name raw) (param-values ?dish))))
  (assert (domain-facts-loaded)))
