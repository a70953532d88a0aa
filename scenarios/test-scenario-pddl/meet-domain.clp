;;; The domain model: domain.pddl, the people, and the sensed facts.

(defrule meet-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)
          (skiller-control)))

(defrule meet-domain-people
  "BOB was greeted before the run, PEGGY was not."
  (executive-init)
  (domain-loaded)
  =>
  (progn$ (?person (create$ BOB PEGGY))
    (assert (domain-object (name ?person) (type name))))
  (assert (domain-fact (name said) (param-values BOB HELLO))
          (domain-facts-loaded)))

(defrule meet-domain-said-is-sensed
  (executive-init)
  (domain-loaded)
  ?predicate <- (domain-predicate (name said) (sensed FALSE))
  =>
  (modify ?predicate (sensed TRUE)))

(defrule meet-domain-see-said
  "Plays a sensor: assert the effect for which an action waits."
  (plan-action (state SENSED-EFFECTS-WAIT) (param-values ?name)
               (action-name ?action&say-hello|say-goodbye))
  =>
  (bind ?text (if (eq ?action say-goodbye) then GOODBYE else HELLO))
  (assert (domain-fact (name said) (param-values ?name ?text))))
