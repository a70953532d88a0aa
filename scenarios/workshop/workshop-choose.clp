;;; The choice of robots and machines for a step. A machine is reserved for an order until the piece of the
;;; order has left it. A robot works for one step at a time.

(deftemplate workshop-chosen "A step for which the machine and the robot are chosen."
  (slot goal (type SYMBOL))
  (slot robot (type SYMBOL) (default nil)))  ; nil if machines alone execute the step

(defrule workshop-choose-saw
  (goal (id ?id) (class CUT) (mode SELECTED) (params order ?order $?))
  ?saw <- (machine (name saw) (order nil))
  =>
  (modify ?saw (order ?order))
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-choose-reserved-saw
  "The order has kept the saw after a failed try."
  (goal (id ?id) (class CUT) (mode SELECTED) (params order ?order $?))
  (machine (name saw) (order ?order))
  =>
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-choose-machine
  "There is no choice: the piece is in the machine, which is reserved for the order."
  (goal (id ?id) (class PAINT|HAND-OVER|CLEAR) (mode SELECTED))
  =>
  (assert (workshop-chosen (goal ?id))))

(defrule workshop-reserve-machine
  "Reserve the machine before a robot leaves for it."
  (goal (class CARRY) (mode SELECTED) (params order ?order piece ? from ? to ?to))
  ?machine <- (machine (name ?to) (order nil))
  =>
  (modify ?machine (order ?order)))

(defrule workshop-choose-robot
  "Choose the robot that holds the piece. If no robot holds it, choose a free robot, preferably at the place
   of the piece."
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
  "Free a machine whose piece a robot has taken out, or which has handed the piece over. The last parameter of
   CARRY is the destination, which stays reserved."
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
