;;; Orders: the choice of the next order, and its steps. A step has up to three tries, but
;;; the handing over, the last step, has only one.

(deffunction workshop-step (?order ?priority ?goal)
  "Make the goal, with up to three tries, a sub-goal of its order; a higher priority is selected earlier."
  (goal-tree-update-child (goal-tree-assert-retry AUTOMATIC-SUBGOAL 3 ?goal) ?order ?priority))

(defrule workshop-order-select
  "Select the order that is due first; two at a time, because there are two robots."
  ?goal <- (goal (id ?id) (class ORDER) (mode FORMULATED) (priority ?priority))
  (not (goal (class ORDER) (mode FORMULATED) (priority ?p&:(> ?p ?priority))))
  (GameInterface (phase PRODUCTION))
  (not (and (goal (id ?one) (class ORDER) (mode ~FORMULATED&~RETRACTED))
            (goal (id ~?one) (class ORDER) (mode ~FORMULATED&~RETRACTED))))
  =>
  (modify ?goal (mode SELECTED)))

(defrule workshop-order-expand
  "Assert the steps in their order: 9 cut, 8 carry to the booth, 7 and below paint, 2 carry to the counter,
   1 hand over. An order has two coats at most."
  ?goal <- (goal (id ?id) (class ORDER) (mode SELECTED)
                 (params order ?order piece ?piece wood ?wood coats $?coats))
  =>
  (workshop-step ?id 9
    (assert (goal (id (sym-cat CUT- ?piece)) (class CUT) (params order ?id piece ?piece wood ?wood))))
  (bind ?from saw)
  (if (> (length$ ?coats) 0) then
    (workshop-step ?id 8 (assert (goal (id (sym-cat CARRY- ?piece -TO-BOOTH)) (class CARRY)
                                       (params order ?id piece ?piece from saw to booth))))
    (progn$ (?coat ?coats)
      (workshop-step ?id (- 8 ?coat-index)
        (assert (goal (id (sym-cat PAINT- ?piece - ?coat)) (class PAINT)
                      (params order ?id piece ?piece colour ?coat)))))
    (bind ?from booth))
  (workshop-step ?id 2 (assert (goal (id (sym-cat CARRY- ?piece -TO-COUNTER)) (class CARRY)
                                     (params order ?id piece ?piece from ?from to counter))))
  (goal-tree-update-child
    (assert (goal (id (sym-cat HAND-OVER- ?piece)) (class HAND-OVER)
                  (params order ?id piece ?piece for ?order))) ?id 1)
  (modify ?goal (mode EXPANDED)))

(defrule workshop-order-evaluate
  ?goal <- (goal (class ORDER) (mode FINISHED))
  =>
  (modify ?goal (mode EVALUATED)))

(defrule workshop-order-retract
  ?goal <- (goal (id ?id) (class ORDER|CLEAR|DROP) (mode EVALUATED))
  =>
  (modify ?goal (mode RETRACTED)))

;; ---- cleaning up after a failed order

(defrule workshop-clear-formulate
  (machine (name ?machine) (order ?id))
  (goal (id ?id) (class ORDER) (mode RETRACTED))
  (domain-fact (name in) (param-values ?piece ?machine))
  (not (goal (class CLEAR) (params piece ?piece machine ?machine) (outcome ~FAILED)))
  =>
  (assert (goal (id (sym-cat CLEAR- (gensym*))) (class CLEAR) (parent GAME) (mode SELECTED)
                (params piece ?piece machine ?machine))))

(defrule workshop-machine-is-empty
  ?machine <- (machine (name ?name) (order ?id))
  (goal (id ?id) (class ORDER) (mode RETRACTED))
  (not (domain-fact (name in) (param-values ? ?name)))
  =>
  (modify ?machine (order nil)))

(defrule workshop-drop-formulate
  (goal (class ORDER) (mode RETRACTED) (params $? piece ?piece $?))
  (domain-fact (name holds) (param-values ?robot ?piece))
  ?free <- (robot (name ?robot) (goal nil))
  =>
  (bind ?goal (sym-cat DROP- (gensym*)))
  (modify ?free (goal ?goal))
  (assert (goal (id ?goal) (class DROP) (parent GAME) (mode SELECTED) (params robot ?robot piece ?piece))))
