;;; The choice of robots and machines for a step. A machine is reserved for an order until its
;;; piece is taken out. A robot works for one step at a time.

(deftemplate workshop-chosen "A step with all its resources."
  (slot goal (type SYMBOL))
  (slot robot (type SYMBOL) (default nil)))

(defrule workshop-choose-saw
  (goal (id ?id) (class CUT) (mode SELECTED) (params order ?order $?))
  ?saw <- (machine (name saw) (order nil))
  =>
  (modify ?saw (order ?order))
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-choose-saw-again
  "Choose again after a failed try."
  (goal (id ?id) (class CUT) (mode SELECTED) (params order ?order $?))
  (machine (name saw) (order ?order))
  =>
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-choose-machine
  "The piece is at the machine already."
  (goal (id ?id) (class PAINT|HAND-OVER|CLEAR) (mode SELECTED))
  =>
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-keep-machine
  "Reserve the machine before a robot leaves for it."
  (goal (class CARRY) (mode SELECTED) (params order ?order piece ? from ? to ?to))
  ?machine <- (machine (name ?to) (order nil))
  =>
  (modify ?machine (order ?order)))

(defrule workshop-choose-robot
  "The robot with the piece, or else a free robot, preferably one at the place."
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
  "The piece was taken out or delivered. A machine that is the last parameter, the destination, stays reserved."
  ?machine <- (machine (name ?from) (order ?order&~nil))
  (goal (id ?order) (mode DISPATCHED))
  (goal (class CARRY|HAND-OVER) (mode DISPATCHED) (params order ?order piece ?piece $?))
  (or (domain-fact (name holds) (param-values ? ?piece))
      (domain-fact (name handed-over) (param-values ?piece ?)))
  (goal (class CARRY|HAND-OVER) (mode DISPATCHED) (params order ?order piece ?piece $? ~?from))
  =>
  (modify ?machine (order nil)))

(defrule workshop-step-evaluate
  "Release the resources of the step; a machine with its piece stays reserved for the order."
  ?goal <- (goal (id ?id) (class CUT|CARRY|PAINT|HAND-OVER|CLEAR|DROP) (mode FINISHED))
  ?chosen <- (workshop-chosen (goal ?id))
  =>
  (retract ?chosen)
  (do-for-fact ((?robot robot)) (eq ?robot:goal ?id)
    (modify ?robot (goal nil)))
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode EVALUATED)))
