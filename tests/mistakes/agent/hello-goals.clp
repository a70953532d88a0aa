(deftemplate hello-visitor "Somebody to be greeted."
  (slot name (type SYMBOL))
  (slot age (type INTEGER) (default 30)))

(deffunction hello-id (?name)
  "The id of the goal of a visitor."
  (sym-cat GREET- ?name))

(defrule hello-visitors
  (domain-facts-loaded)
  =>
  (assert (hello-visitor (name ann))))

(defrule hello-formulate
  (domain-facts-loaded)
  (hello-visitor (name ?name))
  (not (goal (class GREET)))
  (not (hello-done))
  =>
  (assert (goal (id (hello-id ?name)) (class GREET) (params who ?name))
          (hello-done)))

(defrule hello-select
  ?goal <- (goal (class GREET) (mode FORMULATED))
  (skiller-control (acquired TRUE))
  =>
  (modify ?goal (mode SELECTED)))

(defrule hello-commit
  ?goal <- (goal (id ?id) (class GREET) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule hello-dispatch
  ?goal <- (goal (class GREET) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule hello-evaluate
  ?goal <- (goal (class GREET) (mode FINISHED) (outcome ?outcome))
  =>
  (printout t "It is " ?outcome crlf)
  (modify ?goal (mode EVALUATED)))

(defrule hello-retract
  ?goal <- (goal (class GREET) (mode EVALUATED))
  =>
  (modify ?goal (mode RETRACTED)))
