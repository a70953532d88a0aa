;;; The plan for a room: the remaining work in the room.

(deffunction room-step (?goal-id ?plan ?me ?step ?action ?names ?values)
  "Assert an action of the plan, and return the id of the next action."
  (assert (plan-action (id ?step) (goal-id ?goal-id) (plan-id ?plan) (action-name ?action)
                       (param-names ?names) (param-values ?values) (skiller ?me)))
  (+ ?step 1))

(defrule room-plan
  (room-seen ?id)
  ?goal <- (goal (id ?id) (mode COMMITTED) (committed-to ?plan) (params room ?room))
  (wm-fact (id "/cx/identity") (value ?me))
  =>
  (bind ?robot (sym-cat ?me))
  (bind ?step 1)
  (assert (plan (id ?plan) (goal-id ?id) (type SEQUENTIAL)))
  (if (not (house-is swept ?room)) then
    (bind ?step (room-step ?id ?plan ?me ?step sweep (create$ robot room) (create$ ?robot ?room))))
  (if (not (house-is mopped ?room)) then
    (if (not (house-is full ?robot)) then
      (bind ?step (room-step ?id ?plan ?me ?step lock name tap))
      (bind ?step (room-step ?id ?plan ?me ?step fill robot ?robot))
      (bind ?step (room-step ?id ?plan ?me ?step unlock name tap)))
    (room-step ?id ?plan ?me ?step mop (create$ robot room) (create$ ?robot ?room)))
  (modify ?goal (mode DISPATCHED)))
