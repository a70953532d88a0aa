(defrule hello-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)
          (skiller-control)))

(defrule hello-domain-facts
  (domain-loaded)
  =>
  (assert (domain-facts-loaded)))

(defrule hello-eye
  "Who is there is on the blackboard."
  (executive-init)
  =>
  (blackboard-open-writing "HelloInterface" "eye"))
