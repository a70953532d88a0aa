;;; The world that clients find.

(defrule world-load
  (executive-init)
  (not (world-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (world-loaded)
          (domain-object (name r2) (type robot))
          (domain-object (name hall) (type room))
          (domain-fact (name at) (param-values r2 hall))
          (domain-fact (name open))
          ; what the domain file does not say
          (domain-object-type (name crate) (super-type object))
          (domain-predicate (name full) (param-names c) (param-types crate))
          (domain-operator (name fill) (param-names c))
          (domain-operator-parameter (name c) (operator fill) (type crate))
          (pddl-formula (part-of fill) (id fill1) (type negation))
          (pddl-formula (part-of fill1) (id fill11) (type atom))
          (pddl-predicate (part-of fill11) (id fill111) (predicate full)
                          (param-names c) (param-constants nil))
          (domain-effect (part-of fill) (predicate full) (param-names c) (param-constants nil))))
