;;; The domain model: domain.pddl, facts beyond domain.pddl, and sensed facts.

(defrule talk-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)
          (skiller-control)))

(defrule talk-domain-complete
  "Assert the operators that domain.pddl lacks, and the initial state."
  (executive-init)
  (domain-loaded)
  =>
  (assert (domain-operator (name say-cleanup))
          (domain-operator (name print) (param-names severity text)))
  (progn$ (?text (create$ hello goodbye))
    (assert (domain-object (type text) (name ?text))))
  (assert (domain-object (type name) (name lock1))  ; as in Fawkes' scenario; no plan uses it
          (domain-fact (name said) (param-values bob hello)))
  (assert (domain-facts-loaded)))

(defrule talk-domain-said-is-sensed
  "The predicate said is sensed, not an assumed effect of the action."
  (executive-init)
  (domain-loaded)
  ?predicate <- (domain-predicate (name said) (sensed FALSE))
  =>
  (modify ?predicate (sensed TRUE)))

(defrule talk-domain-see-said
  "Plays a sensor: assert the effect for which an action waits."
  (plan-action (state SENSED-EFFECTS-WAIT) (param-values ?name)
               (action-name ?action&say-hello|say-hello-again|say-goodbye))
  =>
  (bind ?text (if (eq ?action say-goodbye) then goodbye else hello))
  (assert (domain-fact (name said) (param-values ?name ?text))))
