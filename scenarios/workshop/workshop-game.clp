;;; The game: one goal until the end that the referee sets, with a sub-goal for each order.

(deffunction workshop-words (?product)
  "A product such as oak+red+blue: its wood, then its coats."
  (bind ?words (create$))
  (progn$ (?word (str-split ?product "+"))
    (bind ?words ?words (sym-cat ?word)))
  ?words)

(defrule workshop-game-open
  "Open the interface of the referee."
  (domain-facts-loaded)
  =>
  (blackboard-open-reading "GameInterface" "Game"))

(defrule workshop-game-formulate
  (GameInterface (phase PRODUCTION))
  (not (goal (class GAME)))
  =>
  (assert (goal (id GAME) (class GAME))))

(defrule workshop-game-goes-on
  "The goal needs no decisions: advance it to its next mode until it is dispatched."
  ?goal <- (goal (class GAME) (mode ?mode&FORMULATED|SELECTED|EXPANDED|COMMITTED))
  =>
  (bind ?modes (create$ FORMULATED SELECTED EXPANDED COMMITTED DISPATCHED))
  (modify ?goal (mode (nth$ (+ 1 (member$ ?mode ?modes)) ?modes))))

(defrule workshop-order-look
  "Open an interface for each order; the referee writes the orders during the game."
  (goal (id GAME) (mode DISPATCHED))
  (GameInterface (orders ?count))
  (not (workshop-orders ?count))
  =>
  (assert (workshop-orders ?count))
  (loop-for-count (?number 1 ?count)
    (blackboard-open-reading "OrderInterface" (str-cat "order" ?number))))

(defrule workshop-order-formulate
  (goal (id GAME) (mode DISPATCHED))
  (OrderInterface (id ?id) (number ?number&:(> ?number 0)) (product ?product)
                  (end ?end) (delivered 0.0))
  (not (goal (class ORDER) (params $? order =(sym-cat ?id) $?)))
  =>
  (bind ?order (sym-cat ?id))
  (bind ?piece (sym-cat piece ?number))
  (bind ?words (workshop-words ?product))
  (assert (domain-object (name ?piece) (type piece))
          (domain-object (name ?order) (type order))
          (goal (id (sym-cat ORDER- ?number)) (class ORDER) (sub-type RUN-ALL-OF-SUBGOALS) (parent GAME)
                (priority (- 0 ?end))
                (params order ?order piece ?piece wood (first$ ?words)
                        coats (rest$ ?words)))))

(defrule workshop-game-over
  "Finish the game; it fails if an order was not delivered."
  ?game <- (goal (id GAME) (mode DISPATCHED))
  (GameInterface (phase POST_GAME) (points ?points) (deliveries ?deliveries) (orders ?orders))
  (not (goal (parent GAME) (mode ~FORMULATED&~RETRACTED)))
  =>
  (printout t ?deliveries " of " ?orders " orders, " ?points " points" crlf)
  (modify ?game (mode FINISHED)
          (outcome (if (= ?deliveries ?orders) then COMPLETED else FAILED))
          (message (str-cat ?deliveries " of " ?orders " orders were delivered"))))

(defrule workshop-game-evaluate
  ?game <- (goal (id GAME) (mode FINISHED))
  =>
  (modify ?game (mode EVALUATED)))

(defrule workshop-game-retract
  ?game <- (goal (id GAME) (mode EVALUATED))
  =>
  (modify ?game (mode RETRACTED)))
