(defrule wanted-begin
  "The goal of a client becomes a goal of the executive."
  (problem-goal (id ?id))
  (not (goal (id ?id)))
  =>
  (assert (goal (id ?id) (class WANTED))))

(defrule wanted-select
  ?goal <- (goal (class WANTED) (mode FORMULATED))
  =>
  (modify ?goal (mode SELECTED)))

(defrule wanted-plan
  (goal (id ?id) (class WANTED) (mode SELECTED))
  (problem-goal (id ?id) (formula ?formula))
  (not (planner-call (goal-id ?id)))
  =>
  (planner-plan ?id ?formula))

(defrule wanted-commit
  ?goal <- (goal (id ?id) (class WANTED) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule wanted-dispatch
  ?goal <- (goal (class WANTED) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule wanted-evaluate
  ?goal <- (goal (class WANTED) (mode FINISHED))
  =>
  (modify ?goal (mode EVALUATED)))

(defrule wanted-end
  "Remove the goal of the client after success or failure."
  ?goal <- (goal (id ?id) (class WANTED) (mode EVALUATED))
  =>
  (do-for-fact ((?wanted problem-goal)) (eq ?wanted:id ?id) (retract ?wanted))
  (modify ?goal (mode RETRACTED)))
