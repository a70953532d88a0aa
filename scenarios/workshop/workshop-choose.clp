;;; Who works for a step. A machine is kept for an order from the time on when its piece is to
;;; come, until it is taken out. A robot works for one step.

(deftemplate workshop-chosen "A step that has all that it needs."
  (slot goal (type SYMBOL))
  (slot robot (type SYMBOL) (default nil)))

(defrule workshop-choose-saw
  (goal (id ?id) (class CUT) (mode SELECTED) (params order ?order $?))
  ?saw <- (machine (name saw) (order nil))
  =>
  (modify ?saw (order ?order))
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-choose-saw-again
  "The first try has failed."
  (goal (id ?id) (class CUT) (mode SELECTED) (params order ?order $?))
  (machine (name saw) (order ?order))
  =>
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-choose-machine
  "The piece is there already."
  (goal (id ?id) (class PAINT|HAND-OVER|CLEAR) (mode SELECTED))
  =>
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-keep-machine
  "Somewhere to go to, before anybody sets out."
  (goal (class CARRY) (mode SELECTED) (params order ?order piece ? from ? to ?to))
  ?machine <- (machine (name ?to) (order nil))
  =>
  (modify ?machine (order ?order)))

(defrule workshop-choose-robot
  "The robot that has the piece; if none has it one that is free, best one that is there already."
  (goal (id ?id) (class CARRY) (mode SELECTED) (params order ?order piece ?piece from ?from to ?to))
  (machine (name ?to) (order ?order))
  (not (workshop-chosen (goal ?id)))
  ?robot <- (robot (name ?name) (goal nil))
  (or (domain-fact (name holds) (param-values ?name ?piece))
      (and (not (domain-fact (name holds) (param-values ? ?piece)))
           (not (domain-fact (name loaded) (param-values ?name)))
           (or (domain-fact (name at) (param-values ?name ?from))
               (not (and (domain-fact (name at) (param-values ?other&~?name ?from))
                         (robot (name ?other) (goal nil)))))))
  =>
  (modify ?robot (goal ?id))
  (assert (workshop-chosen (goal ?id) (robot ?name))))

(defrule workshop-choose-for-drop
  (goal (id ?id) (class DROP) (mode SELECTED) (params robot ?robot piece ?))
  =>
  (assert (workshop-chosen (goal ?id) (robot ?robot))))

(defrule workshop-machine-free
  "The piece was taken out, or handed over."
  ?machine <- (machine (name ?from) (order ?order&~nil))
  (goal (id ?order) (mode DISPATCHED))
  (goal (class CARRY|HAND-OVER) (mode DISPATCHED) (params order ?order piece ?piece $?))
  (or (domain-fact (name holds) (param-values ? ?piece))
      (domain-fact (name handed-over) (param-values ?piece ?)))
  (goal (class CARRY|HAND-OVER) (mode DISPATCHED) (params order ?order piece ?piece $? ~?from))
  =>
  (modify ?machine (order nil)))

(defrule workshop-step-evaluate
  "All that it had is free again; a machine that has its piece stays with the order."
  ?goal <- (goal (id ?id) (class CUT|CARRY|PAINT|HAND-OVER|CLEAR|DROP) (mode FINISHED))
  ?chosen <- (workshop-chosen (goal ?id))
  =>
  (retract ?chosen)
  (do-for-fact ((?robot robot)) (eq ?robot:goal ?id)
    (modify ?robot (goal nil)))
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode EVALUATED)))
