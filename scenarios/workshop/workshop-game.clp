;;; The game: one goal until the end that the referee sets, with a sub-goal for each order.

(deffunction workshop-split-product (?product)
  "Return the wood and the coats of a product as symbols: oak red blue for oak+red+blue."
  (bind ?wood-and-coats (create$))
  (progn$ (?material (str-split ?product "+"))
    (bind ?wood-and-coats ?wood-and-coats (sym-cat ?material)))
  ?wood-and-coats)

(defrule workshop-game-open-interface
  "Open the interface of the referee."
  (domain-facts-loaded)
  =>
  (blackboard-open-reading "GameInterface" "Game"))

(defrule workshop-game-formulate
  (GameInterface (phase PRODUCTION))
  (not (goal (class GAME)))
  =>
  (assert (goal (id GAME) (class GAME))))

(defrule workshop-game-advance
  "The goal needs no decisions: advance it to its next mode until it is dispatched."
  ?goal <- (goal (class GAME) (mode ?mode&FORMULATED|SELECTED|EXPANDED|COMMITTED))
  =>
  (bind ?modes (create$ FORMULATED SELECTED EXPANDED COMMITTED DISPATCHED))
  (modify ?goal (mode (nth$ (+ 1 (member$ ?mode ?modes)) ?modes))))

(defrule workshop-order-open-interfaces
  "Open the interface of each order, into which the referee writes the order at its announcement."
  (goal (id GAME) (mode DISPATCHED))
  (GameInterface (orders ?count))
  (not (workshop-order-interfaces-open ?count))
  =>
  (assert (workshop-order-interfaces-open ?count))
  (loop-for-count (?number 1 ?count)
    (blackboard-open-reading "OrderInterface" (str-cat "order" ?number))))

(defrule workshop-order-formulate
  "Formulate a goal for an announced order. The number is 0 before the announcement, the time of the delivery
   is 0.0 before the delivery."
  (goal (id GAME) (mode DISPATCHED))
  (OrderInterface (id ?id) (number ?number&:(> ?number 0)) (product ?product)
                  (end ?end) (delivered 0.0))
  (not (goal (class ORDER) (params $? order =(sym-cat ?id) $?)))
  =>
  (bind ?order (sym-cat ?id))
  (bind ?piece (sym-cat piece ?number))
  (bind ?wood-and-coats (workshop-split-product ?product))
  (assert (domain-object (name ?piece) (type piece))
          (domain-object (name ?order) (type order))
          (goal (id (sym-cat ORDER- ?number)) (class ORDER) (sub-type RUN-ALL-OF-SUBGOALS) (parent GAME)
                (priority (- 0 ?end))  ; the order with the earliest end has the highest priority
                (params order ?order piece ?piece wood (first$ ?wood-and-coats)
                        coats (rest$ ?wood-and-coats)))))

(defrule workshop-game-over
  "Finish the game after the production, when no sub-goal is in work; the game fails if an order was not
   delivered. A FORMULATED order does not delay the end, because no order is selected after the production."
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
