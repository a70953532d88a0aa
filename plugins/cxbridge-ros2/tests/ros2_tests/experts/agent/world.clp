;;; The initial world of the experts.

(defrule world-load
  (executive-init)
  (not (world-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (world-loaded)
          (domain-object (name r2) (type robot))
          (domain-object (name hall) (type room))
          (domain-fact (name at) (param-values r2 hall))
          (domain-fact (name open))))
