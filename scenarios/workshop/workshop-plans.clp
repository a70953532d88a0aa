;;; Plans for the steps and for cleaning up, made from the state of the world when a goal begins.
;;; The slot skiller names the robot or the machine that executes an action.

(deffunction workshop-action (?goal ?action ?who ?names ?values)
  "Assert the next action of the goal's plan; ?who is the robot or the machine that executes the action."
  (bind ?id (+ 1 (length$ (find-all-facts ((?a plan-action)) (eq ?a:goal-id ?goal)))))
  (assert (plan-action (id ?id) (goal-id ?goal) (plan-id (sym-cat ?goal -PLAN)) (skiller (str-cat ?who))
                       (action-name ?action) (param-names ?names) (param-values ?values))))

(deffunction workshop-move (?goal ?robot ?from ?to)
  "Assert a move, unless the robot is at the place already."
  (if (neq ?from ?to) then
    (workshop-action ?goal move ?robot (create$ r from to) (create$ ?robot ?from ?to))))

(defrule workshop-plan
  ?goal <- (goal (id ?id) (mode SELECTED) (class ?class) (params $?params))
  (workshop-chosen (goal ?id) (robot ?robot))
  =>
  (assert (plan (id (sym-cat ?id -PLAN)) (goal-id ?id) (type SEQUENTIAL)))
  (bind ?piece (nth$ (+ 1 (member$ piece ?params)) ?params))
  ; the last parameter: the wood, the colour, the order or the machine
  (bind ?last (nth$ (length$ ?params) ?params))
  (switch ?class
    (case CUT then (workshop-action ?id cut saw (create$ w k) (create$ ?piece ?last)))
    (case PAINT then (workshop-action ?id paint booth (create$ w c) (create$ ?piece ?last)))
    (case HAND-OVER then (workshop-action ?id hand-over counter (create$ w o) (create$ ?piece ?last)))
    (case CLEAR then (workshop-action ?id clear ?last (create$ w m) (create$ ?piece ?last)))
    (case DROP then (workshop-action ?id drop ?robot (create$ r w) (create$ ?robot ?piece)))
    (case CARRY then (assert (workshop-carry ?id))))
  (modify ?goal (mode EXPANDED)))

(defrule workshop-plan-carry
  "Plan from the place of the robot. A robot that holds the piece after a failed try need not fetch it."
  ?carry <- (workshop-carry ?id)
  (goal (id ?id) (params order ? piece ?piece from ?from to ?to))
  (workshop-chosen (goal ?id) (robot ?robot))
  (domain-fact (name at) (param-values ?robot ?here))
  =>
  (retract ?carry)
  (if (not (any-factp ((?f domain-fact))
             (and (eq ?f:name holds) (eq ?f:param-values (create$ ?robot ?piece))))) then
    (workshop-move ?id ?robot ?here ?from)
    (workshop-action ?id take ?robot (create$ r w m) (create$ ?robot ?piece ?from))
    (bind ?here ?from))
  (workshop-move ?id ?robot ?here ?to)
  (workshop-action ?id put ?robot (create$ r w m) (create$ ?robot ?piece ?to)))

(defrule workshop-commit
  ?goal <- (goal (id ?id) (class CUT|CARRY|PAINT|HAND-OVER|CLEAR|DROP) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  (not (workshop-carry ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule workshop-dispatch
  ?goal <- (goal (class CUT|CARRY|PAINT|HAND-OVER|CLEAR|DROP) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))
